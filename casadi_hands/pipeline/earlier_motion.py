"""An earlier result's motion at the samples, and in the units, of another task."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from casadi_hands.geometry.contact_points import rounded_normals
from casadi_hands.motion import linear, nearest_exponential, zero_order_hold
from casadi_hands.motion.quaternion import quaternion
from casadi_hands.nlp import Solution
from casadi_hands.problem.hand import Hand
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.motion import Motion
from casadi_hands.problem.si import finger_from_si, motion_from_si

Array = NDArray[np.float64]
NOT_SOLVED = Solution({}, {}, 0.0, {}, {}, "taken from an earlier result", 0, 0.0)


def earlier_motion(hand: Hand, motion: Motion, old: Model, model: Model) -> WholeHand:
    """The earlier motion as it was, at the samples and in the units of the new task; still of the old reference."""
    when, length = old.schedule.real(stretched(old, model)), model.units.length
    motion = motion_from_si(motion, length, old.units.force)
    between = linear(motion.time, when)
    turns = np.array([matrix(q) for q in motion.object_orientation])
    forces = np.einsum("sji,scj->sci", turns, in_columns(motion, model, motion.contact_force))
    active = in_columns(motion, model, motion.contact_active)[zero_order_hold(motion.time, when)]
    contacts = [model.contact_names.index(finger.name) for finger in hand.fingers]
    joints, at = resting_spline(motion.time, motion.joint_angles)(when), model.schedule.keyframe_samples
    fingers, angles = [], []
    for i in np.argsort(contacts):
        own = [motion.joint_names.index(f"finger{i}_joint{j}") for j in range(len(hand.fingers[i].links))]
        angles.append(joints[:, own])
        fingers.append(finger_from_si(hand.fingers[i], joints[at][:, own], length))
    path = [
        resting_spline(motion.time, motion.object_position)(when),
        resting_spline(motion.time, continuous_vectors(turns @ matrix(old.reference).T, old.goal_vectors[0]))(when),
    ]
    return WholeHand(
        fingers=tuple(fingers),
        contacts=tuple(sorted(contacts)),
        angles=tuple(angles),
        palm_position=resting_spline(motion.time, motion.base_position)(when),
        palm_quaternion=np.array([quaternion(r) for r in turns_at(motion.time, motion.base_orientation, when)]),
        position=path[0],
        vector=path[1],
        point=np.tensordot(between, in_columns(motion, model, motion.contact_point_object), axes=1),
        force=np.tensordot(between, forces, axes=1) * active[:, :, None],
        active=active,
        solution=NOT_SOLVED,
        torsion=_torsion(motion, turns, old, model, between),
    )


def _torsion(motion: Motion, turns: Array, old: Model, model: Model, between: Array) -> Array | None:
    """Moments over the radius of torsional friction (S, C), m·g, at the new samples; None of hard points."""
    if not model.torsion or motion.contact_moment is None:
        return None
    moments = np.einsum("sji,scj->sci", turns, in_columns(motion, model, motion.contact_moment))
    points = in_columns(motion, model, motion.contact_point_object)
    normals = np.stack([rounded_normals(points[:, c], body) for c, body in enumerate(model.touched)], axis=1)
    radius = model.torsion * model.units.length * old.units.force
    return np.asarray(between @ np.einsum("sci,sci->sc", moments, normals) / radius)


def in_columns(motion: Motion, model: Model, values: NDArray[Any]) -> NDArray[Any]:
    """Values (S, C, …) of a motion's contacts in the order of the model's; zero for one that never acts."""
    names = (*model.contact_names, *(["ground"] if model.ground is not None else []))
    result = np.zeros((len(values), len(names), *values.shape[2:]), values.dtype)
    for c, name in enumerate(names):
        if name in motion.contact_names:
            result[:, c] = values[:, motion.contact_names.index(name)]
    return result


def continuous_vectors(rotations: Array, first: Array) -> Array:
    """Rotation vectors (S, 3) of rotations (S, 3, 3), continuous from one to the next, and the first near (3,)."""
    vectors = [first]
    for rotation in rotations:
        vectors.append(nearest_exponential(rotation, vectors[-1]))
    return np.array(vectors[1:])


def turns_at(time: Array, quaternions: Array, when: Array) -> Array:
    """Rotations (S, 3, 3) at other times, of something that starts and ends at rest."""
    turns = np.array([matrix(q) for q in quaternions])
    vectors = resting_spline(time, continuous_vectors(turns @ turns[0].T, np.zeros(3)))(when)
    return np.array([pin.exp3(v) @ turns[0] for v in vectors])


def matrix(orientation: Array) -> Array:
    """Rotation matrix (3, 3) of a unit quaternion."""
    return np.asarray(pin.Quaternion(*orientation).matrix())


def stretched(old: Model, new: Model) -> Array:
    """The earlier motion's time at each of the new samples: linear from goal to goal, and to the end."""
    ends = []
    for schedule in (old.schedule, new.schedule):
        ends.append([*schedule.keyframes[list(schedule.goals)], schedule.keyframes[-1]])
    rests = ends[1][-1] > ends[1][-2] + 1e-9  # else the last goal is the end
    knots = len(ends[1]) if rests else -1
    return np.asarray(np.interp(new.schedule.samples, ends[1][:knots], ends[0][:knots]))


def resting_spline(time: Array, values: Array) -> CubicSpline:
    """Through samples of something that starts and ends at rest."""
    return CubicSpline(time, values, bc_type="clamped")
