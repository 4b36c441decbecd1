"""Where fingers must let go: a contact that the object's turn would carry too far around it is taken anew."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.stages.grasp import inward_normals, on_capsules
from casadi_hands.stages.model import Model, Regrasp, palm_from_world

Array = NDArray[np.float64]
FARTHEST = np.radians(
    100
)  # that a contact travels around the object, seen from the palm: beyond it fingers reach around


def planned_regrasp(model: Model, pose: Array) -> Regrasp | None:
    """Contacts that let go before they have travelled too far, and take the object again where they first took it.

    A contact's way is the angle at the object's centre, in the palm frame, between where it touched and where the
    object's turn has carried it. It lifts one keyframe before that exceeds ``FARTHEST`` and touches again at the next.

    Args:
        model: the task.
        pose: (N, 6) of the object at the keyframes.

    Returns:
        The plan, or None where every contact can stay.
    """
    keyframes = model.schedule.keyframes
    reference = pin.Quaternion(*model.reference).matrix()
    turns = [
        palm_from_world(model, t)[0] @ pin.exp3(row[3:]) @ reference for t, row in zip(keyframes, pose, strict=True)
    ]
    patches = model.keyframe_patches.copy()
    lifted = np.zeros(patches.shape[:2], bool)
    for c in range(model.contacts):
        taken = turns[0] @ patches[0, c]  # where a finger takes the object, palm frame from its centre
        for k in range(1, len(keyframes)):
            # The last keyframe is too late to touch again.
            if _angle(turns[k] @ patches[k, c], taken) > FARTHEST and k < len(keyframes) - 1:
                lifted[k - 1, c] = True
                anew, capsule = (turns[k].T @ taken)[None], model.capsules[c : c + 1]
                patches[k:, c] = on_capsules(anew, capsule, inward_normals(anew, capsule))[0]
    return Regrasp(lifted, patches) if lifted.any() else None


def _angle(first: Array, second: Array) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(first, second)), first @ second))
