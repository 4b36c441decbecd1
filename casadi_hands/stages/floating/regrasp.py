"""Where fingers cannot follow: contacts that the object's turn would carry too far regrasp, or travel less."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.problem.model import Model, palm_from_world
from casadi_hands.problem.regrasp import Regrasp
from casadi_hands.problem.structure import LEAST_HOLDING
from casadi_hands.stages.object_motion.values import straight_path

Array = NDArray[np.float64]
# That a contact travels around the object, seen from the palm: beyond it fingers reach around.
FARTHEST = np.radians(100)
MOST_TRAVEL = np.radians(60)  # likewise, of contacts that cannot be regrasped: near enough for fingers to roll on


def planned_regrasp(model: Model, pose: Array, active: NDArray[np.bool_] | None = None) -> Regrasp | None:
    """Contacts that let go before they have travelled too far, and take the object again where they first took it.

    A contact's travel is the angle at the object's centre, in the palm frame, between where it touched and where the
    object's turn has carried it. It lifts one keyframe before that exceeds ``FARTHEST`` and touches again at the next.

    Args:
        model: the task.
        pose: (N, 6) of the object at the keyframes.
        active: (N, C) which contacts act from a keyframe to the next; by default all.

    Returns:
        The plan, or None where every contact can stay.
    """
    turns, keyframes = turns_seen(model, pose), model.schedule.keyframes
    patches = model.keyframe_patches.copy()
    lifted = np.zeros(patches.shape[:2], bool)
    for c in range(model.contacts):
        taken = turns[0] @ patches[0, c]  # where a finger takes the object, palm frame from its centre
        for k in range(1, len(keyframes)):
            # The last keyframe is too late to touch again.
            if angle_between(turns[k] @ patches[k, c], taken) > FARTHEST and k < len(keyframes) - 1:
                lifted[k - 1, c] = True
                patches[k:, c] = model.touched[c].on_surface(turns[k].T @ taken)
    if not lifted.any():
        return None
    still = resting_intervals(model, lifted, np.ones_like(lifted) if active is None else active)
    while still.any():  # the object is elsewhere then when it is touched again
        plan = Regrasp(lifted, patches.copy(), still=still)
        turns = turns_seen(model, straight_path(replace(model, regrasp=plan)))
        first = turns[0] @ patches[0].T
        for k, c in np.argwhere(lifted):
            plan.patches[k + 1 :, c] = model.touched[c].on_surface(turns[k + 1].T @ first[:, c])
        far = [
            k
            for k in range(len(turns) - 1)
            for c in range(model.contacts)
            if angle_between(turns[k] @ plan.patches[k, c], first[:, c]) > FARTHEST
        ]
        if not far:
            return plan
        # What it makes up for carries a contact too far: there it does not rest.
        begin = max(goal for goal in model.schedule.goals if goal <= far[0])
        end = min((goal for goal in model.schedule.goals if goal > far[0]), default=len(still))
        still[slice(begin, end) if still[begin:end].any() else slice(None)] = False
    return Regrasp(lifted, patches)


def resting_intervals(model: Model, lifted: NDArray[np.bool_], active: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """From which keyframes (N,) to the next the object rests: where a finger is off it and fewer than three hold it.

    Two hold an object by their fingertips' torsion alone, which is no way to swing it about. It does not rest where it
    has to move all the way from one goal to the next, where a joint holds it, where it draws, or where the palm moves.

    Args:
        model: the task.
        lifted: (N, C) who is off it from a keyframe to the next.
        active: (N, C) who ever acts there.
    """
    still: NDArray[np.bool_] = (lifted & active).any(axis=1) & ((active & ~lifted).sum(axis=1) < LEAST_HOLDING)
    carried = np.ptp(np.hstack([model.palm_position, model.palm_quaternion]), axis=0).any()
    if model.attachment is not None or model.tool is not None or carried:
        return np.zeros_like(still)
    for begin, end in pairwise(model.schedule.goals):
        if still[begin:end].all():
            still[begin:end] = False
    return still


def limited_travel(model: Model, pose: Array) -> Regrasp:
    """Contacts that stay within ``MOST_TRAVEL`` of where they touched, while the object turns on beneath them.

    For a turn that fingers cannot follow and during which none of them can let go: they must roll, or slide.

    Args:
        model: the task.
        pose: (N, 6) of the object at the keyframes.
    """
    turns, patches = turns_seen(model, pose), model.keyframe_patches.copy()
    for c in range(model.contacts):
        taken = turns[0] @ patches[0, c]
        for k in range(1, len(turns)):
            carried = turns[k] @ patches[k - 1, c]
            patches[k, c] = patches[k - 1, c]
            beyond = angle_between(carried, taken) - MOST_TRAVEL
            if beyond > 0:
                axis = np.cross(carried, taken)
                back = pin.exp3(beyond * axis / np.linalg.norm(axis)) @ carried
                patches[k, c] = model.touched[c].on_surface(turns[k].T @ back)
    return Regrasp(np.zeros(patches.shape[:2], bool), patches)


def turns_seen(model: Model, pose: Array) -> list[Array]:
    """Rotations (3, 3) of the object at the keyframes, palm frame; pose (N, 6)."""
    reference = pin.Quaternion(*model.reference).matrix()
    return [
        palm_from_world(model, t)[0] @ pin.exp3(row[3:]) @ reference
        for t, row in zip(model.schedule.keyframes, pose, strict=True)
    ]


def angle_between(first: Array, second: Array) -> float:
    """Of two vectors (3,), rad."""
    return float(np.arctan2(np.linalg.norm(np.cross(first, second)), first @ second))
