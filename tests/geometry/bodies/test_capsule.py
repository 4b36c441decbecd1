"""A capsule in numbers and in symbols."""

from __future__ import annotations

import casadi as ca
import coal
import numpy as np
import pytest

from casadi_hands.geometry.bodies.capsule import Capsule, Segment
from casadi_hands.geometry.bodies.sphere import Sphere
from tests.geometry.bodies import checks

ROD = Capsule(np.array([0.1, 0.2, -0.4]), np.array([0.3, 0, 0.8]), 0.25)
BALL = Capsule(np.array([0.1, -0.2, 0.3]), np.array([0.1, -0.2, 0.3]), 0.4)
UPRIGHT = Capsule(np.zeros(3), np.array([0, 0, 2.0]), 0.5)


def test_distances_are_coals(rng: np.random.Generator) -> None:
    length = np.linalg.norm(ROD.end - ROD.start)
    checks.check_numbers(ROD, checks.along_z(coal.Capsule(0.25, length), ROD.start, ROD.end), rng)
    checks.check_numbers(BALL, checks.along_z(coal.Sphere(0.4), BALL.start, BALL.end), rng)


def test_cap_and_cylinder_inside_and_outside_in_closed_form() -> None:
    for point, nearest, normal, distance in (
        ([0.1, 0, 1.5], [0.5, 0, 1.5], [1, 0, 0], -0.4),
        ([0, 0.3, 2.4], [0, 0.3, 2.4], [0, 0.6, 0.8], 0),
        ([0, 0, -2], [0, 0, -0.5], [0, 0, -1], 1.5),
    ):
        np.testing.assert_allclose(UPRIGHT.on_surface(np.array(point, float)), nearest, atol=1e-12)
        np.testing.assert_allclose(UPRIGHT.outward(np.array(point, float)), normal, atol=1e-12)
        assert UPRIGHT.signed_distance(np.array(point, float)) == pytest.approx(distance, abs=1e-12)


def test_symbols_are_the_numbers_but_at_kinks(rng: np.random.Generator) -> None:
    checks.check_symbols(ROD, rng, off=1e-5, turned=3e-3)
    checks.check_symbols(BALL, rng, off=1e-9, turned=1e-9)


def test_derivatives(rng: np.random.Generator) -> None:
    along = ROD.end - ROD.start
    across = np.cross(along, [1.0, 0, 0])
    side = ROD.radius * across / np.linalg.norm(across)
    nasty = [
        ROD.start,
        ROD.end,
        ROD.centroid,
        ROD.start + side,
        ROD.end + side,
        ROD.end + 0.25 * along,
        ROD.end + side / 2,
    ]
    checks.check_finite(ROD, nasty)
    checks.check_derivatives(ROD, rng)
    checks.check_finite(BALL, [BALL.start, BALL.start + 0.4 * np.eye(3)[0]])


def test_the_gradient_of_the_distance_is_the_normal(rng: np.random.Generator) -> None:
    point, parameters = ca.SX.sym("point", 3), ca.SX.sym("parameters", 7)
    distance, normal = Capsule.surface(parameters).distance_and_normal(point)
    function = ca.Function("f", [point, parameters], [ca.gradient(distance, point), normal])
    for at in checks.around(ROD, rng, 100):
        if np.linalg.norm(ROD.core_offset(at)) > 0.02:
            gradient, outward = (np.asarray(value).ravel() for value in function(at, ROD.parameters))
            np.testing.assert_allclose(gradient, outward, atol=3e-3)


def test_the_normal_bends_smoothly_where_cap_meets_cylinder() -> None:
    # A normal that turns a corner there makes an optimiser jam, for contacts like to sit at that circle.
    x = ca.SX.sym("x", 3)
    _, normal = Capsule.surface(ca.SX([0, 0, 0, 0, 0, 1, 0.3])).project(x)
    slope = ca.Function("f", [x], [ca.jacobian(normal, x)])
    across = [np.asarray(slope([0.3, 0, 1 + h])) for h in (-1e-5, 1e-5)]
    np.testing.assert_allclose(across[0], across[1], atol=0.05)
    # Away from it the normal is that of the cylinder, and of the cap: it turns by 1 / radius.
    far = [np.asarray(slope([0.3, 0, 1 + h]))[2, 2] for h in (-0.05, 0.05)]
    np.testing.assert_allclose(far, [0, 1 / 0.3 * 0.3**3 / np.hypot(0.3, 0.05) ** 3], atol=0.02)


def test_nearest_point_of_its_segment() -> None:
    start, end = np.array([1.0, 0, 0]), np.array([1.0, 4, 0])
    for point, expected in (([5, 1, 0], [1, 1, 0]), ([0, -3, 1], [1, 0, 0]), ([0, 9, 1], [1, 4, 0])):
        rounded = Segment(ca.SX(start), ca.SX(end)).nearest(ca.SX(point))
        np.testing.assert_allclose(np.asarray(ca.evalf(rounded)).ravel(), expected, atol=3e-5)
        exact = Capsule(start, end, 0.5)
        np.testing.assert_allclose(exact.core_point(np.array(point, float)), expected, atol=1e-12)
        np.testing.assert_allclose(exact.core_offset(np.array(point, float)), np.subtract(point, expected), atol=1e-12)


def test_support_and_box(rng: np.random.Generator) -> None:
    directions = rng.normal(size=(20000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    checks.check_support(ROD, np.vstack([end + 0.25 * directions for end in (ROD.start, ROD.end)]), rng)
    # Across the axis both ends are equally far.
    assert len(UPRIGHT.support(np.array([1.0, 0, 0]))) == 2
    np.testing.assert_array_equal(UPRIGHT.support(np.array([0.1, 0, 1.0])), [UPRIGHT.end])


def test_placed_and_packed(rng: np.random.Generator) -> None:
    checks.check_placed(ROD, rng)
    checks.check_lowest(ROD, rng)
    checks.check_edges(ROD, rng)


def test_solid_agrees_with_quadrature() -> None:
    half = float(np.linalg.norm(ROD.end - ROD.start)) / 2
    volume, along, across = checks.revolved(
        lambda z: ROD.radius**2 - np.maximum(abs(z) - half, 0) ** 2, half + ROD.radius, (-half, half)
    )
    assert ROD.volume == pytest.approx(volume, rel=1e-12)
    axis = (ROD.end - ROD.start) / (2 * half)
    assert axis @ ROD.unit_inertia @ axis == pytest.approx(along, rel=1e-12)
    assert np.linalg.eigvalsh(ROD.unit_inertia) == pytest.approx(sorted([along, across, across]), rel=1e-12)
    np.testing.assert_allclose(ROD.centroid, (ROD.start + ROD.end) / 2)


def test_without_length_it_is_a_sphere() -> None:
    sphere = Sphere(BALL.start, 0.4)
    assert BALL.volume == pytest.approx(sphere.volume)
    np.testing.assert_allclose(BALL.unit_inertia, sphere.unit_inertia)
    np.testing.assert_allclose(BALL.bounding_box, sphere.bounding_box)
    assert BALL.solids()[0].kind == sphere.solids()[0].kind == "sphere"
    (solid,) = ROD.solids()
    assert (solid.kind, solid.radius) == ("capsule", 0.25)


def test_its_axis_has_no_normal() -> None:
    assert not UPRIGHT.has_normal(np.array([0, 0, 1.0]))
    np.testing.assert_array_equal(UPRIGHT.outward(np.array([0, 0, 1.0])), np.zeros(3))
    assert UPRIGHT.has_normal(np.array([0.01, 0, 1.0]))
