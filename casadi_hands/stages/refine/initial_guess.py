"""Where the refine stage starts: velocities and forces that nearly obey the motion it is given."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

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
    return np.hstack([path(times, 1), spins]), np.hstack([force, torque])


def disturbance_wrenches(model: Model, vector: Array) -> Array:
    """The task's perturbing force and torque (S, 6) in the frame of an object with rotation vectors (S, 3)."""
    assert model.disturbance is not None
    both = model.disturbance.force, model.disturbance.torque
    return np.hstack([np.einsum("sij,sj->si", _to_object(model, vector), each) for each in both])


def _to_object(model: Model, vector: Array) -> Array:
    """(S, 3, 3) from world axes to an object's with rotation vectors (S, 3) from the reference."""
    reference = pin.Quaternion(*model.reference).matrix()
    return np.array([(pin.exp3(v) @ reference).T for v in vector])


def balanced(points: Array, forces: Array, active: NDArray[np.bool_], wrenches: Array) -> Array:
    """Forces (S, C, 3) nearest to given ones whose active ones make the wrenches (S, 6), as far as contacts can."""
    result = np.zeros_like(forces)
    for k, flags in enumerate(active):
        if flags.any():
            grasp, given = grasp_map(points[k, flags]), forces[k, flags].reshape(-1)
            # Wrenches that the contacts can hardly make would take forces out of all proportion.
            correction = np.linalg.pinv(grasp, rcond=1e-2) @ (wrenches[k] - grasp @ given)
            result[k, flags] = (given + correction).reshape(-1, 3)
    return result
