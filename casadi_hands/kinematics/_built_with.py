"""Written by the build: the libraries the extension was compiled against."""

CASADI_VERSION = "3.8.2"
