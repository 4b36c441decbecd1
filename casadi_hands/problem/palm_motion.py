"""Poses of an object that a moving palm carries: the palm's own motion taken away, and added again."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.motion import nearest_exponential
from casadi_hands.problem.model import Model

Array = NDArray[np.float64]
_INSTANT = 1e-2  # steps, over which velocities are differences


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


def carried_along(model: Model, times: Array) -> Array:
    """Poses (T, 6) at times (T,) in s of an object that stays, seen from the palm, where its motion starts.

    A drawing's stays in the world.
    """
    start = np.concatenate([model.goal_positions[0], model.goal_vectors[0]])
    if not _carries(model):
        return np.tile(start, (len(times), 1))
    first = model.palm_path.at(model.schedule.samples[:1])[0]
    return np.array([_moved(start, *gone, back=False) for gone in _since(first, model.palm_path.at(times))])


def carried_velocity(model: Model) -> Array:
    """Velocity (S, 3), lengths/s, at the samples, of an object that stays on its palm; a drawing's has none."""
    before, after = (carried_along(model, model.schedule.at(share)) for share in (-_INSTANT, _INSTANT))
    return np.asarray((after - before)[:, :3] / (2 * _INSTANT * model.schedule.step))


def added_to_spline(model: Model, offset: int) -> Array:
    """What keyframe poses' spline lacks (S, 6), ``offset`` (-1, 0 or 1) steps later, to go along with the palm.

    Nothing is added at keyframes, and nothing at all where the palm stands.
    """
    schedule = model.schedule
    along = carried_along(model, schedule.at(offset))
    if not _carries(model):
        return np.zeros_like(along)
    return np.asarray(along - schedule.spline(offset) @ carried_along(model, schedule.keyframes))


def poses_at(model: Model, keyframes: Array, offset: int = 0) -> Array:
    """Poses (S, 6) of the object, ``offset`` (-1, 0 or 1) steps after the samples, from those (N, 6) at the keyframes.

    A spline as the palm sees it: what stays where it is on a palm that moves goes all its way with it.
    """
    return np.asarray(model.schedule.spline(offset) @ keyframes + added_to_spline(model, offset))


def _all_moved(model: Model, poses: Array, samples: NDArray[np.int64], back: bool) -> Array:
    if stands(model) or model.attachment is not None:
        return poses
    palm = np.hstack([model.palm_position, model.palm_quaternion])
    gone = _since(palm[0], palm)
    return np.array([_moved(pose, *gone[int(k)], back) for pose, k in zip(poses, samples, strict=True)])


def _carries(model: Model) -> bool:
    return model.tool is None and model.attachment is None and not stands(model)


def stands(model: Model) -> bool:
    """Whether the task leaves the palm where it is."""
    return not (np.ptp(model.palm_position, axis=0).any() or np.ptp(model.palm_quaternion, axis=0).any())


def _since(first: Array, palm: Array) -> list[tuple[Array, Array, Array]]:
    """How the palm has moved from its first pose (7,) to each of those (T, 7) that follow, world.

    Rotation (3, 3), translation (3,), and the rotation's vector (3,), continuous from one to the next.
    """
    gone, turn = [], np.zeros(3)
    for pose in palm:
        rotation = pin.Quaternion(*pose[3:]).matrix() @ pin.Quaternion(*first[3:]).matrix().T
        turn = nearest_exponential(rotation, turn)
        gone.append((rotation, pose[:3] - rotation @ first[:3], turn))
    return gone


def _moved(pose: Array, rotation: Array, translation: Array, turn: Array, back: bool) -> Array:
    """A pose moved along, or back."""
    position, vector = pose[:3], pose[3:]
    if back:
        position, rotation, turn = rotation.T @ (position - translation), rotation.T, -turn
    else:
        position = rotation @ position + translation
    return np.concatenate([position, nearest_exponential(rotation @ pin.exp3(vector), vector + turn)])
