"""Rotations: exponential coordinates and unit quaternions ``[w, x, y, z]``, smooth everywhere they are used."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

_AXIS_KNOWN = 1e-4  # rad
_ORDER = 14  # the series below are exact to 1e-12 for turns up to 1.8 pi


def exponential(vector: SX) -> SX:
    """Unit quaternion (4,) of a rotation vector (3,) in rad, from power series in its squared length.

    No square root and no branch, so exact derivatives at zero; for turns up to about 320°.
    """
    x = ca.sumsqr(vector) / 4
    cosine, sinc = 0 * x, 0 * x
    for k in reversed(range(_ORDER)):
        cosine = cosine * x + (-1) ** k / math.factorial(2 * k)
        sinc = sinc * x + (-1) ** k / math.factorial(2 * k + 1)
    return ca.vertcat(cosine, sinc * vector / 2)


def multiply(a: SX, b: SX) -> SX:
    """Product (4,) of two quaternions: rotate by ``b``, then by ``a``."""
    return ca.vertcat(a[0] * b[0] - ca.dot(a[1:], b[1:]), a[0] * b[1:] + b[0] * a[1:] + ca.cross(a[1:], b[1:]))


def conjugate(q: SX) -> SX:
    """The inverse (4,) of a unit quaternion."""
    return ca.vertcat(q[0], -q[1:])


def rotation_matrix(q: SX) -> SX:
    """Rotation matrix (3, 3) of a unit quaternion (4,)."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return ca.vertcat(
        ca.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        ca.horzcat(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        ca.horzcat(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def angle_squared(q: SX, target: SX) -> SX:
    """4·|vec(q* target)|²: the squared angle in rad² between two orientations to second order, smooth at zero."""
    return 4 * ca.sumsqr(multiply(conjugate(q), target)[1:])


def angular_motion(before: SX, now: SX, after: SX, step: SX) -> tuple[SX, SX]:
    """Angular velocity (3,) in rad/s and acceleration (3,) in rad/s², in the body's frame, from three quaternions.

    2·Im(q* q̇) and 2·Im(q* q̈) with central differences over ``step`` seconds; no logarithm.
    """
    rate, second = (after - before) / (2 * step), (after - 2 * now + before) / step**2
    inverse = conjugate(now)
    return 2 * multiply(inverse, rate)[1:], 2 * multiply(inverse, second)[1:]


def nearest_exponential(rotation: NDArray[np.float64], expected: NDArray[np.float64]) -> NDArray[np.float64]:
    """The rotation vector (3,) of a rotation matrix (3, 3) that is nearest to ``expected`` (3,), in rad.

    A rotation has many vectors, whole turns apart; this picks the one that continues a motion.
    """
    import pinocchio as pin

    vector = pin.log3(np.asarray(rotation, float))
    # The axis of a turn this small is its rounding: whole turns go about the expected axis.
    angle, length = float(np.linalg.norm(vector)), float(np.linalg.norm(expected))
    axis = vector / angle if angle > _AXIS_KNOWN else np.asarray(expected, float) / max(length, 1e-9)
    candidates = [vector + 2 * math.pi * k * axis for k in (-2, -1, 0, 1, 2)]
    return min(candidates, key=lambda candidate: float(np.linalg.norm(candidate - expected)))


def continuous(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same orientations (S, 4) with signs chosen so that neighbours are near."""
    signs = np.cumprod(np.where((quaternions[1:] * quaternions[:-1]).sum(axis=1) < 0, -1.0, 1.0))
    return np.vstack([quaternions[:1], quaternions[1:] * signs[:, None]])
