"""The witness: recompute a finished design from its files, sharing no formula with the optimiser."""

from casadi_hands.verify.audit import audit, audit_files
from casadi_hands.verify.replays.perturb import Perturbation
from casadi_hands.verify.replays.replay import Replay, replay, replay_many
from casadi_hands.verify.replays.series import TOGETHER, Replays, run_replays
from casadi_hands.verify.report import Audit, Figure

__all__ = [
    "TOGETHER",
    "Audit",
    "Figure",
    "Perturbation",
    "Replay",
    "Replays",
    "audit",
    "audit_files",
    "replay",
    "replay_many",
    "run_replays",
]
