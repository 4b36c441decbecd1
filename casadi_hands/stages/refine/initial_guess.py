"""Where the refine stage starts: velocities and forces that nearly obey the motion it is given."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from casadi_hands.problem.attachment import directions
from casadi_hands.problem.model import Model
from casadi_hands.statics.grasp import grasp_map

Array = NDArray[np.float64]


def rates_and_wrenches(model: Model, position: Array, vector: Array) -> tuple[Array, Array]:
    """Velocities and the wrenches that they need, of a motion that is at rest at both ends.

    With forces linear between samples, positions are cubic and twice differentiable: the spline through them.

    Args:
        model: the task.
        position: (S, 3) world.
        vector: (S, 3) rotation vectors from the reference.

    Returns:
        (S, 6) velocity in the world and spin in the object's frame; (S, 6) force in m·g and torque in m·g·length that
        contacts must make, object frame.
    """
    times, reference = model.schedule.samples, pin.Quaternion(*model.reference).matrix()
    path, turn = (CubicSpline(times, values, bc_type="clamped") for values in (position, vector))
    to_object = _to_object(model, vector)
    spins = np.array([reference.T @ pin.Jexp3(v) @ w for v, w in zip(vector, turn(times, 1), strict=True)])
    spun = CubicSpline(times, spins)(times, 1)
    inertial, inertia = model.units.inertial, model.inertia
    force = np.einsum("sij,sj->si", to_object, inertial * path(times, 2) - model.gravity)
    torque = inertial * (np.cross(spins, spins @ inertia.T) + spun @ inertia.T)
    if model.exerted:
        force -= np.einsum("sij,sj->si", to_object, model.scenarios[0].force)
        torque -= np.einsum("sij,sj->si", to_object, model.scenarios[0].torque)
    return np.hstack([path(times, 1), spins]), np.hstack([force, torque])


def along_joint(model: Model, position: Array, vector: Array) -> tuple[dict[str, Array], Array]:
    """A motion of an attached object on its joint, at rest at both ends, and what contacts must do along it.

    Args:
        model: the task.
        position: (S, 3) world, near the joint.
        vector: (S, 3) rotation vectors from the reference.

    Returns:
        ``pose`` and ``rate`` (S, 6), ``coordinate``, ``coordinate_speed`` and ``drag`` (S, 1); and (S, 1) torque in
        m·g·length, of a slider force in m·g.
    """
    joint = model.attachment
    assert joint is not None
    coordinate = joint.coordinates(position, vector)
    path = CubicSpline(model.schedule.samples, coordinate, bc_type="clamped")
    speed = path(model.schedule.samples, 1)
    speed[[0, -1]] = 0.0
    pose, rate = joint.poses(coordinate), joint.rates(coordinate, speed)
    moved = model.unborne(rates_and_wrenches(model, pose[:, :3], pose[:, 3:])[1].T).T
    schedule = model.schedule
    drag = -directions(joint, schedule.samples[schedule.goal_samples], schedule.samples)
    resisted = joint.resistance(coordinate, speed) + joint.friction * drag
    values = {"pose": pose, "rate": rate, "coordinate": coordinate[:, None], "coordinate_speed": speed[:, None]}
    return {**values, "drag": drag[:, None]}, np.asarray(moved - resisted[:, None])


def disturbance_wrenches(model: Model, vector: Array) -> Array:
    """The task's perturbing force and torque (S, 6) in the frame of an object with rotation vectors (S, 3)."""
    assert model.disturbance is not None
    both = model.disturbance.force, model.disturbance.torque
    return np.hstack([np.einsum("sij,sj->si", _to_object(model, vector), each) for each in both])


def _to_object(model: Model, vector: Array) -> Array:
    """(S, 3, 3) from world axes to an object's with rotation vectors (S, 3) from the reference."""
    reference = pin.Quaternion(*model.reference).matrix()
    return np.array([(pin.exp3(v) @ reference).T for v in vector])


def balanced(
    points: Array, forces: Array, active: NDArray[np.bool_], wrenches: Array, twist: Array | None = None
) -> Array:
    """Forces (S, C, 3) nearest to given ones whose active ones make the wrenches (S, 6), as far as contacts can.

    Of an attached object, which moves along a ``twist`` (6,), what they do along it, (S, 1).
    """
    result = np.zeros_like(forces)
    for k, flags in enumerate(active):
        if flags.any():
            grasp, given = grasp_map(points[k, flags]), forces[k, flags].reshape(-1)
            grasp = grasp if twist is None else twist[None] @ grasp
            # Wrenches that the contacts can hardly make would take forces out of all proportion.
            correction = np.linalg.pinv(grasp, rcond=1e-2) @ (wrenches[k] - grasp @ given)
            result[k, flags] = (given + correction).reshape(-1, 3)
    return result
