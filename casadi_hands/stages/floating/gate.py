"""Whether the active contacts can make the wrench that a motion needs."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import compress

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.geometry.contact_points import inward_normals
from casadi_hands.problem.attachment import MOVING, dry_friction
from casadi_hands.problem.model import Model
from casadi_hands.problem.palm_motion import poses_at
from casadi_hands.statics.grasp import EDGES, friction_edges, grasp_map, torsion_edges
from casadi_hands.statics.programmes import nonnegative_fit

Array = NDArray[np.float64]
_PRELOAD = 1.0  # m·g, normal force of the first guess
_PIVOT_RANK = 5  # of the grasp map of two contacts
_GATE = 0.05  # m·g, unbalanced wrench that the gate lets pass: what the soft stages leave anyway


def least_squares_forces(model: Model, rotation: Array) -> Array:
    """Contact forces (C, 3) in the object's frame that hold its weight: a normal preload, corrected to balance."""
    points = model.patches
    preload = _PRELOAD * inward_normals(points, model.touched)
    grasp = model.unborne(grasp_map(points))
    weight = np.concatenate([-rotation.T @ model.gravity, np.zeros(3)])
    missing = model.unborne(weight) - grasp @ preload.reshape(-1)
    return preload + (np.linalg.pinv(grasp) @ missing).reshape(-1, 3)


def needed_wrenches(model: Model, pose: Array) -> Array:
    """Wrench (N, 6) in m·g and m·g·length, object frame, that contacts must make at each keyframe of a motion.

    Of an attached object what they must make along its joint's coordinate, (N, 1).

    Args:
        model: the task.
        pose: (N, 6) keyframes: position and rotation vector from the reference.
    """
    schedule, inertial = model.schedule, model.units.inertial
    at = schedule.keyframe_samples
    before, now, after = (poses_at(model, pose, offset)[at] for offset in (-1, 0, 1))
    acceleration = (after - 2 * now + before)[:, :3] / schedule.step**2
    reference = pin.Quaternion(*model.reference).matrix()
    wrenches = []
    for k in range(len(pose)):
        turns = [pin.exp3(row[3:]) @ reference for row in (before[k], now[k], after[k])]
        spins = [pin.log3(turns[i].T @ turns[i + 1]) / schedule.step for i in range(2)]
        omega, alpha = (spins[0] + spins[1]) / 2, (spins[1] - spins[0]) / schedule.step
        force = turns[1].T @ (inertial * acceleration[k] - model.gravity)
        torque = inertial * (np.cross(omega, model.inertia @ omega) + model.inertia @ alpha)
        if model.exerted:
            force -= turns[1].T @ model.scenarios[0].force[at[k]]
            torque -= turns[1].T @ model.scenarios[0].torque[at[k]]
        wrenches.append(np.concatenate([force, torque]))
    if model.attachment is None:
        return np.array(wrenches)
    joint = model.attachment
    coordinates = [joint.coordinates(rows[:, :3], rows[:, 3:]) for rows in (before, now, after)]
    speeds = (coordinates[2] - coordinates[0]) / (2 * schedule.step)
    resisted = joint.resistance(coordinates[1], speeds) + dry_friction(joint, speeds, MOVING)
    return np.asarray(model.unborne(np.array(wrenches).T).T - resisted[:, None])


def passes_gate(model: Model, values: Mapping[str, Array], pivots: bool = False) -> bool:
    """Whether at every keyframe the active contacts have the rank of all contacts and can make the needed wrench.

    The needed wrench is the motion's own: inertial forces less gravity, in the object's frame. With ``pivots`` the
    rank of two contacts is enough: the object may hang between them, free about their line, while a finger lifts.
    A motion that broke down, with values that are no numbers, does not pass.
    """
    if not all(np.isfinite(values[name]).all() for name in ("pose", "point", "invariant")):
        return False
    contacts = len(model.touched)
    return all(
        can_hold(model, point.reshape(contacts, 3), invariant > 0.5, needed, pivots)
        for point, invariant, needed in zip(
            values["point"], values["invariant"], needed_wrenches(model, values["pose"]), strict=True
        )
    )


def can_hold(
    model: Model, points: Array, active: NDArray[np.bool_], needed: Array, pivots: bool = False, share: float = 1.0
) -> bool:
    """Whether the active contacts can make a wrench, and have the rank of all contacts.

    Args:
        model: the task.
        points: (C, 3) of all contacts, object frame.
        active: (C,) which of them act.
        needed: wrench, as from ``needed_wrenches``.
        pivots: whether the rank of two contacts is enough.
        share: of the friction that may be used.
    """
    if not active.any():
        return False
    grasp = model.unborne(grasp_map(points[active]))
    all_hold = np.linalg.matrix_rank(model.unborne(grasp_map(points)), 1e-6)
    if np.linalg.matrix_rank(grasp, 1e-6) < (min(all_hold, _PIVOT_RANK) if pivots else all_hold):
        return False
    inward = inward_normals(points[active], list(compress(model.touched, active)))
    edges = friction_edges(inward, share * model.frictions[active])
    wrenches = np.vstack([edges, np.zeros((3, edges.shape[1]))])
    for i, point in enumerate(points[active]):
        span = slice(i * EDGES, (i + 1) * EDGES)
        wrenches[3:, span] = np.cross(point[None, :], edges[:, span].T).T
    fingers = int(active[: model.contacts].sum())
    twists = torsion_edges(points[active][:fingers], inward[:fingers], share * model.torsion)
    return nonnegative_fit(model.unborne(np.hstack([wrenches, twists])), needed)[1] <= _GATE
