"""The witness: recompute a finished design from its files, sharing no formula with the optimiser."""

from casadi_hands.verify.audit import audit
from casadi_hands.verify.report import Audit, Figure

__all__ = ["Audit", "Figure", "audit"]
