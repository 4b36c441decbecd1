"""A ball in numbers and in symbols."""

from __future__ import annotations

import coal
import numpy as np
import pytest

from casadi_hands.geometry.bodies.sphere import Sphere
from tests.geometry.bodies import checks

BALL = Sphere(np.array([0.1, -0.2, 0.3]), 0.4)


def test_distances_are_coals(rng: np.random.Generator) -> None:
    checks.check_numbers(BALL, (coal.Sphere(0.4), coal.Transform3s(np.eye(3), BALL.center)), rng)


def test_symbols_are_the_numbers(rng: np.random.Generator) -> None:
    checks.check_symbols(BALL, rng, off=1e-12, turned=1e-9)


def test_derivatives(rng: np.random.Generator) -> None:
    checks.check_finite(BALL, [BALL.center, BALL.center + 0.4 * np.eye(3)[0]])
    checks.check_derivatives(BALL, rng)


def test_support_and_box(rng: np.random.Generator) -> None:
    directions = rng.normal(size=(20000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    checks.check_support(BALL, BALL.center + 0.4 * directions, rng)
    np.testing.assert_allclose(BALL.bounding_box, BALL.center + np.array([[-0.4] * 3, [0.4] * 3]))


def test_placed_and_packed(rng: np.random.Generator) -> None:
    checks.check_placed(BALL, rng)
    checks.check_lowest(BALL, rng)
    checks.check_edges(BALL, rng)


def test_solid_agrees_with_quadrature() -> None:
    volume, along, across = checks.revolved(lambda z: 0.4**2 - z**2, 0.4)
    assert BALL.volume == pytest.approx(volume, rel=1e-12)
    assert along == pytest.approx(across, rel=1e-12)
    np.testing.assert_allclose(BALL.unit_inertia, along * np.eye(3), rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(BALL.centroid, BALL.center)


def test_its_centre_has_no_normal() -> None:
    assert not BALL.has_normal(BALL.center)
    np.testing.assert_array_equal(BALL.outward(BALL.center), np.zeros(3))
    assert BALL.signed_distance(BALL.center) == -0.4


def test_it_is_drawn_as_a_sphere() -> None:
    (solid,) = BALL.solids()
    assert solid.kind == "sphere"
    np.testing.assert_array_equal(solid.start, BALL.center)
    assert solid.radius == 0.4
    assert BALL.impossible() == ""
