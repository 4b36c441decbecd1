"""Projection on capsules against coal's distances and closed forms."""

import casadi as ca
import coal
import numpy as np
import pytest

from casadi_hands.geometry import closest_on_segment, nearest_on_axis, project_to_capsule


def project(point, start, end, radius) -> tuple[np.ndarray, np.ndarray, float]:
    projection, normal, distance = project_to_capsule(*(ca.DM(v) for v in (point, start, end, radius)))
    return np.asarray(projection).ravel(), np.asarray(normal).ravel(), float(distance)


def distance_by_coal(point: np.ndarray, start: np.ndarray, end: np.ndarray, radius: float) -> float:
    """Signed distance of a point outside a capsule; coal's capsules lie along z about their middle."""
    along = end - start
    length = np.linalg.norm(along)
    z = along / length
    x = np.linalg.svd(z[None])[2][1]
    frame = coal.Transform3s(np.column_stack([x, np.cross(z, x), z]), (start + end) / 2)
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    at = coal.Transform3s(np.eye(3), point)
    return coal.distance(coal.Capsule(radius, length), frame, coal.Sphere(1e-9), at, request, result)


@pytest.mark.parametrize("case", range(20))
def test_projection_outside_agrees_with_coal(case: int, rng: np.random.Generator) -> None:
    start, end = rng.normal(size=(2, 3))
    point = 3 * rng.normal(size=3)
    projection, normal, distance = project(point, start, end, 0.3)
    if distance > 0.05:
        assert distance == pytest.approx(distance_by_coal(point, start, end, 0.3), abs=3e-5)
    np.testing.assert_allclose(point - distance * normal, projection, atol=1e-12)
    assert np.linalg.norm(normal) == pytest.approx(1, abs=1e-12)
    # The projection is on the surface: projecting it again stays, at no distance.
    again, same, none = project(projection, start, end, 0.3)
    np.testing.assert_allclose(again, projection, atol=3e-5)
    np.testing.assert_allclose(same, normal, atol=3e-3)
    assert none == pytest.approx(0, abs=3e-5)


def test_inside_cap_and_cylinder_in_closed_form() -> None:
    start, end = np.zeros(3), np.array([0, 0, 2.0])
    projection, normal, distance = project([0.1, 0, 1.5], start, end, 0.5)
    np.testing.assert_allclose(projection, [0.5, 0, 1.5], atol=3e-5)
    np.testing.assert_allclose(normal, [1, 0, 0], atol=3e-5)
    assert distance == pytest.approx(-0.4, abs=3e-5)
    projection, normal, distance = project([0, 0.3, 2.4], start, end, 0.5)
    np.testing.assert_allclose(projection, [0, 0.3, 2.4], atol=3e-5)
    np.testing.assert_allclose(normal, [0, 0.6, 0.8], atol=3e-5)
    assert distance == pytest.approx(0, abs=3e-5)


def test_sphere_is_a_capsule_of_no_length() -> None:
    center = np.array([1.0, -2, 0.5])
    projection, _, distance = project(center + np.array([0, 0, 3]), center, center, 0.7)
    np.testing.assert_allclose(projection, center + np.array([0, 0, 0.7]), atol=1e-12)
    assert distance == pytest.approx(2.3, abs=1e-12)


@pytest.mark.parametrize("point", [[0, 0, 0], [0, 0, 0.5], [0, 0, 1], [0, 0, 2], [0.3, 0, 1], [0.3, 0, 0]])
@pytest.mark.parametrize("end", [[0, 0, 1], [0, 0, 0]])
def test_derivatives_are_finite_on_the_axis_and_where_cap_meets_cylinder(point, end) -> None:
    x = ca.SX.sym("x", 3)
    projection, normal, distance = project_to_capsule(x, ca.SX.zeros(3), ca.SX(end), ca.SX(0.3))
    out = ca.vertcat(projection, normal, distance)
    jacobian = ca.jacobian(out, x)
    for value in ca.Function("f", [x], [out, jacobian, ca.jacobian(ca.vec(jacobian), x)])(point):
        assert np.isfinite(np.asarray(value)).all()


def test_closest_point_of_a_segment() -> None:
    start, end = np.array([1.0, 0, 0]), np.array([1.0, 4, 0])
    for point, expected in (([5, 1, 0], [1, 1, 0]), ([0, -3, 1], [1, 0, 0]), ([0, 9, 1], [1, 4, 0])):
        got = closest_on_segment(ca.DM(point), ca.DM(start), ca.DM(end))
        np.testing.assert_allclose(np.asarray(got).ravel(), expected, atol=3e-5)
        nearest, way = nearest_on_axis(np.array(point, float), np.r_[start, end, 0.5])
        np.testing.assert_allclose(nearest, expected, atol=1e-12)
        np.testing.assert_allclose(way, np.subtract(point, expected), atol=1e-12)


def test_nearest_point_of_an_axis_of_no_length_is_the_centre() -> None:
    center, point = np.array([1.0, -2, 0.5]), np.array([1.0, 1, 0.5])
    nearest, way = nearest_on_axis(point, np.r_[center, center, 0.5])
    np.testing.assert_array_equal(nearest, center)
    np.testing.assert_array_equal(way, [0, 3, 0])


def test_normal_bends_smoothly_where_cap_meets_cylinder() -> None:
    # A normal that turns a corner there makes an optimiser jam, for contacts like to sit at that circle.
    x = ca.SX.sym("x", 3)
    _, normal, _ = project_to_capsule(x, ca.SX.zeros(3), ca.SX([0, 0, 1]), ca.SX(0.3))
    slope = ca.Function("f", [x], [ca.jacobian(normal, x)])
    across = [np.asarray(slope([0.3, 0, 1 + h])) for h in (-1e-5, 1e-5)]
    np.testing.assert_allclose(across[0], across[1], atol=0.05)
    # Away from it the normal is that of the cylinder, and of the cap: it turns by 1 / radius.
    far = [np.asarray(slope([0.3, 0, 1 + h]))[2, 2] for h in (-0.05, 0.05)]
    np.testing.assert_allclose(far, [0, 1 / 0.3 * 0.3**3 / np.hypot(0.3, 0.05) ** 3], atol=0.02)
