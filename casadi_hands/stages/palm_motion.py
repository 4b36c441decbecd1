"""Poses of an object that a moving palm carries: the palm's own motion taken away, and added again."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.motion import nearest_exponential
from casadi_hands.stages.model import Model

Array = NDArray[np.float64]


def goals_seen_from_palm(model: Model) -> Array:
    """The goals (G, 6) as they would be had the palm stayed where it is at the first sample.

    Position and rotation vector from the reference, world.
    """
    return _all_moved(model, model.goal_poses, model.schedule.goal_samples, back=True)


def carried_by_palm(model: Model, poses: Array, samples: NDArray[np.int64]) -> Array:
    """Poses as they are on the palm that moves; the inverse of what ``goals_seen_from_palm`` does.

    Args:
        model: the task, with the palm's motion.
        poses: (K, 6) position and rotation vector from the reference, world, had the palm stayed.
        samples: (K,) index of each.

    Returns:
        (K, 6) likewise.
    """
    return _all_moved(model, poses, samples, back=False)


def _all_moved(model: Model, poses: Array, samples: NDArray[np.int64], back: bool) -> Array:
    if _stands(model):
        return poses
    return np.array([_moved(pose, *_since_start(model, k), back) for pose, k in zip(poses, samples, strict=True)])


def _stands(model: Model) -> bool:
    return not (np.ptp(model.palm_position, axis=0).any() or np.ptp(model.palm_quaternion, axis=0).any())


def _since_start(model: Model, sample: int) -> tuple[Array, Array]:
    """Rotation (3, 3) and translation (3,) of the palm from its first pose to that at a sample, world."""
    turned, first = (pin.Quaternion(*model.palm_quaternion[k]).matrix() for k in (sample, 0))
    rotation = turned @ first.T
    return rotation, model.palm_position[sample] - rotation @ model.palm_position[0]


def _moved(pose: Array, rotation: Array, translation: Array, back: bool) -> Array:
    """A pose moved along, or back."""
    position, vector, turn = pose[:3], pose[3:], pin.log3(rotation)
    if back:
        position, rotation, turn = rotation.T @ (position - translation), rotation.T, -turn
    else:
        position = rotation @ position + translation
    return np.concatenate([position, nearest_exponential(rotation @ pin.exp3(vector), vector + turn)])
