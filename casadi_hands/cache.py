"""Where what takes long to make is kept."""

from __future__ import annotations

import os
from pathlib import Path


def cache_folder() -> Path:
    """Folder for compiled kernels and meshes cut into parts: ``$CASADI_HANDS_CACHE``, else the user's cache folder.

    Raises:
        RuntimeError: the user has no home folder.
    """
    named = os.environ.get("CASADI_HANDS_CACHE")
    if named:
        # The loader searches its own path for a bare file name, so the folder has to be absolute.
        return Path(named).absolute()
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache").absolute() / "casadi-hands"
