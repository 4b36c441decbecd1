"""The figures of the certificate, measured from the files."""
