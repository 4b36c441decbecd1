"""What a solver may fail with."""

from __future__ import annotations


class SolverError(RuntimeError):
    """IPOPT, or the linear solver in it, broke off with an error of its own; from another start it may not."""
