"""The witness: recompute a finished design from its files, sharing no formula with the optimiser."""

from casadi_hands.verify.audit import audit
from casadi_hands.verify.perturb import Perturbation
from casadi_hands.verify.replay import Replay, replay, replay_many
from casadi_hands.verify.report import Audit, Figure

__all__ = ["Audit", "Figure", "Perturbation", "Replay", "audit", "replay", "replay_many"]
