"""Times in the task's terms."""

from __future__ import annotations

import numpy as np

from casadi_hands.motion import Schedule


def goal_at(schedule: Schedule, time: float) -> int | None:
    """Index of the goal at a time of the schedule, s; None between goals."""
    at = np.flatnonzero(np.abs(schedule.keyframes[list(schedule.goals)] - time) < 1e-6)
    return int(at[0]) if len(at) else None


def moment(schedule: Schedule, time: float) -> str:
    """A time of the schedule, s, in the task's terms: ``goal 2 (3 s)``, ``2.5 s (between goals 1 and 2)``."""
    return real_moment(schedule, float(schedule.real(time)))


def real_moment(schedule: Schedule, time: float) -> str:
    """A time of what is written, s, in the task's terms."""
    times = schedule.real(schedule.keyframes[list(schedule.goals)])
    at = np.flatnonzero(np.abs(times - time) < 1e-6)
    if len(at):
        return f"goal {at[0] + 1} ({time:.3g} s)"
    passed = int((times < time).sum())
    if passed == len(times):
        return f"{time:.3g} s (after the last goal)"
    return f"{time:.3g} s (between goals {passed} and {passed + 1})" if passed else f"{time:.3g} s"
