"""Terms of the object as a rigid body."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
from casadi import SX

from casadi_hands.declared import Term, Weight
from casadi_hands.motion import angle_squared

LINEAR_MOMENTUM = Term("linear_momentum", "Newton's law", "eq. 2.6", "m·g", weights={"floating": Weight(10.0)})
ANGULAR_MOMENTUM = Term("angular_momentum", "Euler's law", "eq. 2.5", "m·g·length", weights={"floating": Weight(10.0)})
TASK = Term("task", "Goals", "eq. 2.9", "length² and rad²", "sum", {"floating": Weight(50.0, "goal")})
TOOL = replace(TASK, about="A drawing's path", equation="fig. 3.4", unit="length", form="square")
OBJECT_ACCELERATION = Term(
    "object_acceleration",
    "Object's acceleration, a moving palm's taken off",
    "eq. 2.14",
    "length/s²",
    weights={"floating": Weight(0.1)},
)
OBJECT_ANGULAR_ACCELERATION = Term(
    "object_angular_acceleration",
    "Object's rate of spin",
    "eq. 2.15",
    "m·g·length/s",
    weights={"floating": Weight(1.0)},
)
PATH = Term(
    "path",
    "Keyframes off the straight line between goals",
    "",
    "length and rad",
    weights={"floating": Weight(3.0)},
)
# The refinement's.
KNOT_ACCELERATION = Term(
    "object_acceleration",
    "Object's acceleration",
    "eq. 2.14",
    "length/s² and rad/s²",
    weights={"refine": Weight(1e-2, "knot")},
)
OBJECT_JERK = Term(
    "object_jerk",
    "Change of the object's acceleration",
    "",
    "length/s³ and rad/s³",
    weights={"refine": Weight(1e-3, "knot")},
)
FORCE_CHANGE = Term(
    "force_change",
    "Change of the contact forces",
    "",
    "m·g",
    weights={"refine": Weight(0.5, "knot")},
)
STAY_PATH = Term(
    "stay_path",
    "Object off the motion it begins with",
    "",
    "length and rad",
    weights={"refine": Weight(1.0, "knot")},
)
GOAL = Term("goal", "Goals", "eq. 2.9", "length and rad", weights={"refine": Weight(300.0, "knot")})
DISTURBED_FORCE = Term(
    "force_regularisation", "Forces under a disturbance", "eq. 2.7", "m·g", weights={"refine": Weight(1e-3, "knot")}
)


def linear_momentum(forces: SX, invariant: SX, gravity: SX, external: SX, acceleration: SX, inertial: SX) -> SX:
    """Unbalanced force (3,) in m·g, world frame (eq. 2.6, with gravity and its square restored).

    Args:
        forces: (3, C) contact forces on the object, world frame, m·g.
        invariant: (C,) contact invariants c.
        gravity: (3,) weight, m·g.
        external: (3,) other force on the object, m·g.
        acceleration: (3,) of the object, lengths/s².
        inertial: length unit over g, s².
    """
    return ca.mtimes(forces, invariant) + gravity + external - inertial * acceleration


def gyroscopic(inertia: SX, velocity: SX, acceleration: SX) -> SX:
    """ω×Iω + Iω̇ (3,), all in the object's frame."""
    return ca.cross(velocity, ca.mtimes(inertia, velocity)) + ca.mtimes(inertia, acceleration)


def angular_momentum(points: SX, forces: SX, invariant: SX, external: SX, inertial_torque: SX) -> SX:
    """Unbalanced torque (3,) in m·g·length, object frame (eq. 2.5).

    Args:
        points: (3, C) contacts, object frame, lengths.
        forces: (3, C) contact forces, object frame, m·g.
        invariant: (C,) contact invariants c.
        external: (3,) other torque, object frame, m·g·length.
        inertial_torque: (3,) ω×Iω + Iω̇ in m·g·length.
    """
    torque = sum((invariant[i] * ca.cross(points[:, i], forces[:, i]) for i in range(points.shape[1])), SX.zeros(3, 1))
    return torque + external - inertial_torque


def task_pose(position: SX, quaternion: SX, goal_position: SX, goal_quaternion: SX) -> SX:
    """Squared position error in lengths² plus squared angle in rad² (eq. 2.9); a plain value, not a residual."""
    return ca.sumsqr(position - goal_position) + angle_squared(quaternion, goal_quaternion)


def task_point(position: SX, rotation: SX, tool: SX, goal: SX) -> SX:
    """Distance (3,) of the object's tool point from where a drawing wants it (eq. 2.9's variant, fig. 3.4)."""
    return position + ca.mtimes(rotation, tool) - goal
