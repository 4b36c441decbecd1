"""Terms of the object as a rigid body."""

from __future__ import annotations

import casadi as ca
from casadi import SX

from casadi_hands.motion import angle_squared


def linear_momentum(forces: SX, activity: SX, gravity: SX, external: SX, acceleration: SX, inertial: SX) -> SX:
    """Unbalanced force (3,) in m·g, world frame (eq. 2.6, with gravity and its square restored).

    Args:
        forces: (3, C) contact forces on the object, world frame, m·g.
        activity: (C,) contact invariants c.
        gravity: (3,) weight, m·g.
        external: (3,) other force on the object, m·g.
        acceleration: (3,) of the object, lengths/s².
        inertial: length unit over g, s².
    """
    return ca.mtimes(forces, activity) + gravity + external - inertial * acceleration


def gyroscopic(inertia: SX, velocity: SX, acceleration: SX) -> SX:
    """ω×Iω + Iω̇ (3,), all in the object's frame."""
    return ca.cross(velocity, ca.mtimes(inertia, velocity)) + ca.mtimes(inertia, acceleration)


def angular_momentum(points: SX, forces: SX, activity: SX, external: SX, inertial_torque: SX) -> SX:
    """Unbalanced torque (3,) in m·g·length, object frame (eq. 2.5).

    Args:
        points: (3, C) contacts, object frame, lengths.
        forces: (3, C) contact forces, object frame, m·g.
        activity: (C,) contact invariants c.
        external: (3,) other torque, object frame, m·g·length.
        inertial_torque: (3,) ω×Iω + Iω̇ in m·g·length.
    """
    torque = sum((activity[i] * ca.cross(points[:, i], forces[:, i]) for i in range(points.shape[1])), SX.zeros(3, 1))
    return torque + external - inertial_torque


def task_pose(position: SX, quaternion: SX, goal_position: SX, goal_quaternion: SX) -> SX:
    """Squared position error in lengths² plus squared angle in rad² (eq. 2.9); a plain value, not a residual."""
    return ca.sumsqr(position - goal_position) + angle_squared(quaternion, goal_quaternion)


def task_point(position: SX, rotation: SX, tool: SX, goal: SX) -> SX:
    """Distance (3,) of the object's tool point from where a drawing wants it (eq. 2.9's variant, fig. 3.4)."""
    return position + ca.mtimes(rotation, tool) - goal
