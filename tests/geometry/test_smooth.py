"""Smooth scalar functions against their textbook forms and finite differences."""

import casadi as ca
import numpy as np
import pytest

from casadi_hands.geometry import clamp, norm, penalty_spline, soft_exponential

EPSILON = 0.02


def derivatives(function, at: float) -> tuple[float, float, float]:
    """Value, slope and curvature by CasADi."""
    x = ca.SX.sym("x")
    y = function(x)
    slope = ca.gradient(y, x)
    return tuple(map(float, ca.Function("f", [x], [y, slope, ca.gradient(slope, x)])(at)))


@pytest.mark.parametrize(("knot", "expected"), [(-EPSILON, (0, 0, 0)), (EPSILON, (4 / 3 * EPSILON**2, 2 * EPSILON, 2))])
@pytest.mark.parametrize("side", [-1e-12, 1e-12])
def test_spline_is_c2_where_its_pieces_meet(knot: float, expected: tuple[float, ...], side: float) -> None:
    got = derivatives(lambda x: penalty_spline(x, EPSILON), knot + side)
    np.testing.assert_allclose(got, expected, rtol=1e-8, atol=1e-8)


def test_spline_grows_and_is_the_square_far_out() -> None:
    values = np.array([float(penalty_spline(ca.DM(x), EPSILON)) for x in np.linspace(-2, 2, 2001) * EPSILON])
    assert (np.diff(values) >= 0).all()
    assert float(penalty_spline(ca.DM(-0.5), EPSILON)) == 0
    assert float(penalty_spline(ca.DM(3.0), EPSILON)) == pytest.approx(9.0, rel=1e-4)


def test_exponential_is_exact_below_its_ceiling() -> None:
    for x in (-30.0, -1.0, 0.0, 3.0, 10.0):
        assert float(soft_exponential(ca.DM(x))) == pytest.approx(np.exp(x), rel=1e-14)


@pytest.mark.parametrize("x", [10 - 1e-9, 10 + 1e-9])
def test_exponential_is_c2_at_its_ceiling(x: float) -> None:
    np.testing.assert_allclose(derivatives(soft_exponential, x), np.exp(10), rtol=1e-7)


def test_exponential_does_not_overflow() -> None:
    got = derivatives(soft_exponential, 1e6)
    assert np.isfinite(got).all()
    assert got[0] == pytest.approx(np.exp(10) * (1 + (1e6 - 10) + (1e6 - 10) ** 2 / 2), rel=1e-12)


def test_norm_and_its_derivatives_at_zero() -> None:
    x = ca.SX.sym("x", 3)
    hessian, gradient = ca.hessian(norm(x, 1e-3), x)
    at_zero = ca.Function("f", [x], [norm(x, 1e-3), gradient, hessian])(np.zeros(3))
    assert float(at_zero[0]) == pytest.approx(1e-3)
    np.testing.assert_array_equal(np.asarray(at_zero[1]).ravel(), 0)
    np.testing.assert_allclose(at_zero[2], 1e3 * np.eye(3))
    assert float(norm(ca.DM([3, 4, 0]))) == pytest.approx(5, rel=1e-15)


def test_clamp() -> None:
    got = [float(clamp(ca.DM(x), -1, 2)) for x in (-5, -1, 0.3, 2, 7)]
    assert got == [-1, -1, 0.3, 2, 2]
