"""When contacts touch: how firmly they press then, for how long, and when the object rests meanwhile."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from casadi_hands.problem.model import Model

Array = NDArray[np.float64]
RAMP = 0.5  # s over which a contact that touches or lifts comes to press with its full force, or to let go


def resting(model: Model) -> NDArray[np.bool_]:
    """At which samples (S,) the object is planned to rest, held by two, while another finger goes around it."""
    flags, at = np.zeros(len(model.schedule.samples), bool), model.schedule.keyframe_samples
    if model.regrasp is not None and model.regrasp.still is not None:
        for k in np.flatnonzero(model.regrasp.still):
            flags[at[k] : at[k + 1] + 1] = True
    return flags


def force_ramp(bearing: NDArray[np.bool_], times: Array) -> Array:
    """Share (S,) of the normal force asked of a contact at times (S,): it grows after a touch, falls before a lift."""
    if bearing.all():
        return np.ones(len(bearing))
    away = np.abs(times[:, None] - times[~bearing]).min(axis=1)
    return np.asarray(np.minimum(away / RAMP, 1.0))


def longest_run(flags: NDArray[np.bool_], lengths: Array) -> float:
    """Longest stretch of intervals (K,) with set flags, in all of their lengths; 0 where none is set."""
    passed = np.append(0.0, np.cumsum(lengths))
    return float(max((passed[run[-1] + 1] - passed[run[0]] for run in runs(flags)), default=0.0))


def runs(flags: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """The indices of each stretch with set flags (K,)."""
    found = np.flatnonzero(flags)
    return [run for run in np.split(found, np.flatnonzero(np.diff(found) > 1) + 1) if len(run)]
