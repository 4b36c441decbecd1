"""Poses of an object that a moving palm carries: the palm's own motion taken away, and added again."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.motion import nearest_exponential
from casadi_hands.stages.model import Model

Array = NDArray[np.float64]


def seen_from_palm(model: Model, poses: Array, samples: NDArray[np.int64]) -> Array:
    """Poses as they would be had the palm stayed where it is at the first sample.

    Args:
        model: the task, with the palm's motion.
        poses: (K, 6) position and rotation vector from the reference, world.
        samples: (K,) index of each.

    Returns:
        (K, 6) likewise.
    """
    if _stands(model):
        return poses
    return np.array([_moved(pose, *_since_start(model, k), back=True) for pose, k in zip(poses, samples, strict=True)])


def carried_by_palm(model: Model, poses: Array, samples: NDArray[np.int64]) -> Array:
    """The inverse of ``seen_from_palm``."""
    if _stands(model):
        return poses
    return np.array([_moved(pose, *_since_start(model, k), back=False) for pose, k in zip(poses, samples, strict=True)])


def goals_seen_from_palm(model: Model) -> Array:
    """The goals (G, 6) as ``seen_from_palm`` has them."""
    return seen_from_palm(model, model.goal_poses, model.schedule.goal_samples)


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
