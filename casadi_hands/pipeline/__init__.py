"""From a task to a design: the stages in order, the loop of certification, the reasons, the record."""

from casadi_hands.pipeline.record import STAGES, Progress, Stage
from casadi_hands.pipeline.run import solve

__all__ = ["STAGES", "Progress", "Stage", "solve"]
