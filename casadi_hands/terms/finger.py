"""Terms of one finger: where it reaches, what it can push, how it is built."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
from casadi import SX

from casadi_hands.declared import Term, Weight
from casadi_hands.geometry import norm, penalty_spline

# Of the Jacobian's singular values, lengths per rad: the lever below which a joint does not push.
NULL_SPACE_DAMPING = 0.02
_TORQUE_DAMPING = 1e-3  # λ of eq. A.5
_ROUNDING = 1e-3  # half the width of the spline's transition, lengths or rad

TIP_TARGET = Term(
    "tip_target",
    "Fingertip at its contact",
    "eq. 2.18",
    "length",
    weights={"synthesis": Weight((50.0, 10.0, 50.0))},
)
LENGTH = Term("length", "Length of links", "eq. 2.21", "length", weights={"synthesis": Weight(0.1, "once")})
BEND = Term("bend", "Bends of links", "", "rad", weights={"synthesis": Weight(0.02, "once")})
MINIMUM_LENGTH = Term(
    "minimum_length",
    "Links outside the allowed lengths",
    "eq. 2.22",
    "length",
    "sum",
    {"synthesis": Weight(1.0, "once")},
)
NULL_SPACE = Term(
    "null_space",
    "Forces that no joint actuates",
    "eq. 2.23",
    "m·g",
    "sum",
    {"synthesis": Weight(1.0), "whole_hand": Weight(1.0)},
)
TORQUE = Term(
    "torque",
    "Joint torques",
    "eq. 2.24",
    "m·g·length",
    weights={"synthesis": Weight(0.05), "whole_hand": Weight(0.05)},
)
FINGER_BASE = Term(
    "finger_base", "Fingers off the palm", "eq. 2.25", "length", "sum", {"synthesis": Weight(1.0, "once")}
)
FINGERTIP_ACCELERATION = Term(
    "fingertip_acceleration",
    "Acceleration of free fingertips",
    "eq. 2.26",
    "length/s²",
    weights={"synthesis": Weight(0.001)},
)
JOINT_LIMITS = Term("joint_limits", "Joints beyond their limits", "eq. 2.27", "rad", "sum", {"synthesis": Weight(1.0)})
# The whole-hand stage's.
JOINT_LIMITS_SQUARED = replace(JOINT_LIMITS, form="square", weights={"whole_hand": Weight(1.0)})
FINGER_ACCELERATION = Term(
    "finger_acceleration",
    "Acceleration of every fingertip",
    "eq. 2.26",
    "length/s²",
    weights={"whole_hand": Weight(0.001)},
)
BASE_ACCELERATION = Term(
    "base_acceleration",
    "Acceleration of a palm that may move",
    "",
    "length/s² and rad/s²",
    weights={"whole_hand": Weight(0.01)},
)
# The refinement's.
STRUCTURAL_FORCE = Term(
    "passive_force", "Force borne by the structure", "eq. 2.23", "m·g", weights={"refine": Weight(3.0, "knot")}
)
JOINT_ACCELERATION = Term(
    "joint_acceleration", "Joints' acceleration", "", "rad/s²", weights={"refine": Weight(1e-3, "knot")}
)
JOINT_JERK = Term(
    "joint_jerk", "Change of joints' acceleration", "", "rad/s³", weights={"refine": Weight(3e-3, "knot")}
)
# A large weight, or fingers grow long and turn elsewhere for next to nothing.
STAY_DESIGN = Term(
    "stay_design",
    "Morphology other than the synthesis found",
    "",
    "length and rad",
    weights={"refine": Weight(5.0, "knot")},
)
MOTOR_ACCELERATION = Term(
    "motor_acceleration",
    "Acceleration of motors that share joints",
    "",
    "rad/s²",
    weights={"refine": Weight(1e-3, "knot")},
)
# No weight but in restorations.
PROXIMITY = Term(
    "anchor", "Proximal term of a restoration", "", "length, rad and 0.1 m·g", weights={"refine": Weight(0.0, "knot")}
)


def null_space_force(jacobian: SX, force: SX, damping: float = NULL_SPACE_DAMPING) -> SX:
    """The part (3,) of a force that no joint torque can supply (eq. 2.23, A.1), damped instead of by SVD.

    Args:
        jacobian: (3, n) of the contact point, lengths/rad.
        force: (3,) in the same frame, m·g.
        damping: λ, lengths/rad; also counts a finger stretched until its joints have no lever.
    """
    n = jacobian.shape[1]
    normal_matrix = ca.mtimes(jacobian.T, jacobian) + damping**2 * SX.eye(n)
    return force - ca.mtimes(jacobian, solve_positive(normal_matrix, ca.mtimes(jacobian.T, force)))


def structural_force(jacobian: SX, force: SX, least: float) -> SX:
    """The part (3,) of a force for which no joint has a lever: a sharper cut than damping.

    Of a force in a singular direction of the Jacobian with the lever σ, λ⁴/(σ⁴ + λ⁴) counts as not actuated.

    Args:
        jacobian: (3, n) of the contact point, lengths/rad.
        force: (3,) in the same frame, m·g.
        least: λ, lengths/rad.
    """
    squared = ca.mtimes(jacobian.T, jacobian)
    normal_matrix = ca.mtimes(squared, squared) + least**4 * SX.eye(jacobian.shape[1])
    torques = ca.mtimes(squared, ca.mtimes(jacobian.T, force))
    return force - ca.mtimes(jacobian, solve_positive(normal_matrix, torques))


def null_space(jacobian: SX, force: SX) -> SX:
    """Size of ``null_space_force`` in m·g, rounded off at zero; a plain value."""
    return ca.sqrt(ca.sumsqr(null_space_force(jacobian, force)) + 1e-4)


def joint_torques(jacobian: SX, force: SX) -> SX:
    """α (n,) of eq. A.5, written without dividing by the squared levers.

    With D the squared column norms of the Jacobian, α = D (JᵀJ + λ²D² + 1e-8)⁻¹ Jᵀ f.
    """
    squared = ca.sum1(jacobian**2).T
    matrix = ca.mtimes(jacobian.T, jacobian) + ca.diag(_TORQUE_DAMPING**2 * squared**2 + 1e-8)
    return squared * solve_positive(matrix, ca.mtimes(jacobian.T, force))


def solve_positive(matrix: SX, right: SX) -> SX:
    """Solve a small symmetric positive definite system by LDLᵀ written out, without pivots or branches."""
    n = matrix.shape[0]
    lower, diagonal = SX.eye(n), SX.zeros(n, 1)
    for j in range(n):
        diagonal[j] = matrix[j, j] - sum((lower[j, k] ** 2 * diagonal[k] for k in range(j)), SX(0))
        for i in range(j + 1, n):
            inner = sum((lower[i, k] * lower[j, k] * diagonal[k] for k in range(j)), SX(0))
            lower[i, j] = (matrix[i, j] - inner) / diagonal[j]
    y = SX.zeros(n, 1)
    for i in range(n):
        y[i] = right[i] - sum((lower[i, k] * y[k] for k in range(i)), SX(0))
    x = y / diagonal
    for i in reversed(range(n)):
        x[i] = x[i] - sum((lower[k, i] * x[k] for k in range(i + 1, n)), SX(0))
    return x


def beyond_limits(value: SX, lower: SX, upper: SX) -> SX:
    """g(value - upper) + g(lower - value), elementwise (eq. 2.22, 2.27); plain values."""
    return penalty_spline(value - upper, _ROUNDING) + penalty_spline(lower - value, _ROUNDING)


def off_palm(base: SX, palm_radius: SX) -> SX:
    """How far a base (2,) on the palm's plane is beyond its rim, as g (eq. 2.25); a plain value."""
    return penalty_spline(norm(base, 1e-6) - palm_radius, _ROUNDING)


def tip_acceleration(before: SX, now: SX, after: SX, step: SX) -> SX:
    """Second difference (3,) of the fingertip's position, lengths/s² (eq. 2.26)."""
    return (after - 2 * now + before) / step**2
