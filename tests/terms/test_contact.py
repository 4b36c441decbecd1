"""The contact's terms against their printed equations in NumPy."""

import casadi as ca
import numpy as np
import pytest

from casadi_hands.geometry.bodies.capsule import Capsule
from casadi_hands.terms import contact

ROUNDED = 1e-3  # what ‖f‖ is at f = 0


def dm(*arrays) -> list[ca.DM]:
    return [ca.DM(a) for a in arrays]


@pytest.mark.parametrize("slope", [0.0, 0.3, 0.5, 0.8])
def test_friction_cone_is_one_on_the_cone_and_grows_outside(slope: float) -> None:
    normal = np.array([1, 2, 2]) / 3
    across = np.array([0, 1, -1]) / np.sqrt(2)
    force = 2.0 * (normal + slope * across)
    value = float(contact.friction_cone(*dm(force, normal, 0.5, 5.0)))
    assert value == pytest.approx(np.exp(5 * (2 * np.hypot(slope, ROUNDED / 2) - 0.5 * 2)), rel=1e-9)
    assert (value > 1.01) == (slope > 0.5)


def test_friction_cone_punishes_pulling_without_overflow() -> None:
    value = float(contact.friction_cone(*dm([0, 0, -1000], [0, 0, 1], 0.5, 5.0)))
    x = 5 * (ROUNDED + 500)
    assert value == pytest.approx(np.exp(10) * (1 + (x - 10) + (x - 10) ** 2 / 2), rel=1e-9)


def test_friction_cone_has_finite_derivatives_without_force() -> None:
    force = ca.SX.sym("f", 3)
    hessian, gradient = ca.hessian(contact.friction_cone(force, ca.SX([0, 0, 1]), ca.SX(0.5), ca.SX(5)), force)
    for found in ca.Function("f", [force], [gradient, hessian])(np.zeros(3)):
        assert np.isfinite(np.asarray(found)).all()


def test_off_surface(rng: np.random.Generator) -> None:
    force, point, projection = rng.normal(size=(3, 3))
    value = float(contact.off_surface(*dm(force, 0.4, point, projection)))
    assert value == pytest.approx(np.linalg.norm(force) * 0.4 * np.sum((projection - point) ** 2), rel=1e-5)


def test_gap_rate_sees_the_gap_and_slip_the_sliding(rng: np.random.Generator) -> None:
    force, gap, gap_before, point, before = rng.normal(size=(5, 3))
    size = 0.4 * np.linalg.norm(force)
    found = np.asarray(contact.gap_rate(*dm(force, 0.4, gap, gap_before, 0.1))).ravel()
    np.testing.assert_allclose(found, size * (gap - gap_before) / 0.1, rtol=1e-5)
    found = np.asarray(contact.slip(*dm(force, 0.4, point, before, 0.1))).ravel()
    np.testing.assert_allclose(found, size * (point - before) / 0.1, rtol=1e-5)
    # Sliding along the surface leaves the gap as it is: eq. 2.12 is blind to it.
    capsule = Capsule.surface(ca.SX([0, 0, -1, 0, 0, 1, 0.3]))
    high, low = (np.array([0.31, 0, z]) for z in (0.2, -0.2))
    gaps = [ca.evalf(capsule.project(ca.SX(p))[0]) - ca.DM(p) for p in (high, low)]
    assert float(ca.norm_2(contact.gap_rate(*dm(force, 1.0), *gaps, ca.DM(0.1)))) < 1e-5
    assert float(ca.norm_2(contact.slip(*dm(force, 1.0, high, low, 0.1)))) == pytest.approx(
        np.linalg.norm(force) * 4, rel=1e-5
    )


def test_acceleration_is_the_second_difference_over_the_step_as_printed() -> None:
    # For a point on a parabola of acceleration a the second difference is a h².
    a, h = np.array([2.0, -1, 0.5]), 0.1
    points = [a * t**2 / 2 + 3 * t for t in (0.4 - h, 0.4, 0.4 + h)]
    found = np.asarray(contact.acceleration(*dm(*points, h))).ravel()
    np.testing.assert_allclose(found, a * h, atol=1e-12)
