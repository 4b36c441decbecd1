"""Times in the task's terms."""

from __future__ import annotations

import numpy as np

from casadi_hands.motion import Schedule


def goal_at(schedule: Schedule, time: float) -> int | None:
    """Index of the goal at a time in s; None between goals."""
    at = np.flatnonzero(np.abs(schedule.keyframes[list(schedule.goals)] - time) < 1e-6)
    return int(at[0]) if len(at) else None


def moment(schedule: Schedule, time: float) -> str:
    """A time in the task's terms: ``goal 2 (3 s)``, ``2.5 s (between goals 1 and 2)``."""
    goal = goal_at(schedule, time)
    if goal is not None:
        return f"goal {goal + 1} ({time:.3g} s)"
    times = schedule.keyframes[list(schedule.goals)]
    passed = int((times < time).sum())
    if passed == len(times):
        return f"{time:.3g} s (after the last goal)"
    return f"{time:.3g} s (between goals {passed} and {passed + 1})" if passed else f"{time:.3g} s"
