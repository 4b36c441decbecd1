"""Scalar functions kept differentiable where the textbook form is not."""

from __future__ import annotations

import casadi as ca
from casadi import SX

_GRAINS = 2**36


def norm(vector: SX, rounding: float = 1e-9) -> SX:
    """Euclidean length, rounded off at zero.

    Args:
        vector: (n,) any units.
        rounding: the value at zero, in the vector's units.
    """
    return ca.sqrt(ca.sumsqr(vector) + rounding**2)


def clamp(value: SX, lower: float, upper: float) -> SX:
    """``value`` kept within [lower, upper]; its derivative jumps at both ends."""
    return ca.fmin(ca.fmax(value, lower), upper)


def constant(value: SX) -> SX:
    """``value``, to ten digits, as what derivatives take for a constant: that of a floor is zero."""
    return ca.floor(value * _GRAINS + 0.5) / _GRAINS


def penalty_spline(x: SX, epsilon: float) -> SX:
    """The spline g of section 2.2.2: 0 below -epsilon, x² + epsilon²/3 above, cubic and C² between.

    Args:
        x: a violation, positive when the limit is passed.
        epsilon: half the width of the transition, in the units of x.
    """
    between = x**3 / (6 * epsilon) + x**2 / 2 + epsilon * x / 2 + epsilon**2 / 6
    above = x**2 + epsilon**2 / 3
    return ca.if_else(x <= -epsilon, 0, ca.if_else(x <= epsilon, between, above))


def soft_exponential(x: SX, ceiling: float = 10.0) -> SX:
    """``exp(x)``, continued above ``ceiling`` by its second-order Taylor polynomial so that it cannot overflow."""
    excess = ca.fmax(x - ceiling, 0)
    return ca.exp(ca.fmin(x, ceiling)) * (1 + excess + excess**2 / 2)
