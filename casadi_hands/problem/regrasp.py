"""Planned regrasps: contacts that let go of the object and touch it again elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from casadi_hands.motion import Schedule
from casadi_hands.problem.units import round_off
from casadi_hands.task import Task

Array = NDArray[np.float64]
_SOON = 1e-9  # s, in which nothing happens


@dataclass(frozen=True)
class Regrasp:
    """Contacts that are to move on the object, planned: fingers lift and touch again elsewhere, or slide there.

    Attributes:
        lifted: (N, C) bool, from its keyframe to the next; the ground's contact, if any, last.
        patches: (N, C, 3) where contacts are wanted at the keyframes, object frame.
        asked: whether the task says who lifts, when and where to.
        still: (N,) bool, from which keyframes to the next the object rests, as too few others hold it; None: never.
    """

    lifted: NDArray[np.bool_]
    patches: Array
    asked: bool = False
    still: NDArray[np.bool_] | None = None


def regrasp_times(task: Task) -> list[float]:
    """When fingers lift and touch again as the task says, s."""
    return [time for finger in task.fingers.values() for each in finger.regrasps or () for time in each.times]


def asked_regrasp(
    task: Task, schedule: Schedule, names: Sequence[str], patches: Array, length: float
) -> Regrasp | None:
    """What the task says of fingers that let go and touch again; None where it leaves that to the program.

    Args:
        task: as loaded.
        schedule: with keyframes at the ``regrasp_times``.
        names: of the fingers' contacts.
        patches: (C, 3) where contacts are wanted at first, object frame, lengths.
        length: the characteristic length, m.
    """
    keyframes = schedule.keyframes
    wanted = np.tile(patches, (len(keyframes), 1, 1))
    lifted = np.zeros(wanted.shape[:2], bool)
    for c, name in enumerate(names):
        for each in task.fingers[name].regrasps or ():
            lifted[(keyframes > each.start - _SOON) & (keyframes < each.end - _SOON), c] = True
            wanted[keyframes > each.end - _SOON, c] = round_off(np.array(each.touches) / length)
    return Regrasp(lifted, wanted, asked=True) if lifted.any() else None
