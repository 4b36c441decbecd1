"""Cylinders: coal measures the core, swept by hand; symbols against numbers; inertia by coal; a can in a task file."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import coal
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.geometry.bodies import KINDS
from casadi_hands.geometry.bodies.cylinder import Cylinder
from tests.geometry.bodies import checks

CAN = Cylinder(np.array([0.1, -0.2, -0.7]), np.array([0.3, 0.4, 0.6]), 0.5, 0.05)


def core() -> checks.Placed:
    """The core, for coal."""
    length = float(np.linalg.norm(CAN.end - CAN.start)) - 2 * CAN.edge_radius
    return checks.along_z(coal.Cylinder(CAN.radius - CAN.edge_radius, length), CAN.start, CAN.end)


def test_distances_of_points_are_those_of_coal(rng: np.random.Generator) -> None:
    tiny = 1e-7
    for point in rng.uniform(-1.3, 1.3, (200, 3)):
        found = checks.coal_distance(core(), (coal.Sphere(tiny), coal.Transform3s(np.eye(3), point))) + tiny
        if found > 1e-3:
            assert CAN.signed_distance(point) == pytest.approx(found - CAN.edge_radius, abs=2e-5)
        else:  # coal's depths are rough; within, the nearer of face and side counts
            height = abs((point - CAN.centroid) @ CAN.helper)
            side = np.linalg.norm(np.cross(point - CAN.centroid, CAN.helper)) - CAN.radius
            face = height - np.linalg.norm(CAN.end - CAN.start) / 2
            if max(side, face) < -CAN.edge_radius:
                assert CAN.signed_distance(point) == pytest.approx(max(side, face))


def test_symbols_measure_what_numbers_do(rng: np.random.Generator) -> None:
    point = ca.SX.sym("point", 3)
    distance, normal = Cylinder.surface(ca.SX(CAN.parameters)).distance_and_normal(point, 1e-6)
    measured = ca.Function("measured", [point], [distance, normal])
    slope = ca.Function("slope", [point], [ca.gradient(distance, point), ca.hessian(distance, point)[0]])
    for at in rng.uniform(-1.3, 1.3, (200, 3)):
        found, outward = (np.asarray(value).ravel() for value in measured(at))
        assert found[0] == pytest.approx(CAN.signed_distance(at), abs=2e-3)
        if found[0] > 0.02:
            assert outward @ CAN.outward(at) > 0.999
            np.testing.assert_allclose(np.asarray(slope(at)[0]).ravel(), outward, atol=0.02)
        assert np.isfinite(np.asarray(slope(at)[1])).all()


def test_a_point_is_moved_onto_the_surface_along_its_normal(rng: np.random.Generator) -> None:
    for point in rng.uniform(-1, 1, (100, 3)):
        on = CAN.on_surface(point)
        assert CAN.signed_distance(on) == pytest.approx(0, abs=1e-12)
        assert np.linalg.norm(on - point) == pytest.approx(abs(CAN.signed_distance(point)))


def test_where_two_sides_are_as_near_there_is_no_normal() -> None:
    """On the axis of a long one, half way between the faces of a flat one, and where face and side are as near."""
    flat = Cylinder(np.array([0, 0, -0.1]), np.array([0, 0, 0.1]), 0.5, 0.01)
    assert not CAN.has_normal(CAN.centroid + 0.1 * CAN.helper)
    assert not flat.has_normal(np.array([0.2, 0, 0]))
    assert not flat.has_normal(np.array([0.43, 0, 0.03]))
    for body, point in ((CAN, CAN.start), (flat, [0.2, 0, 1e-3]), (flat, [0.45, 0, 0]), (flat, [0.9, 0, 0])):
        assert body.has_normal(np.array(point))
        assert np.linalg.norm(body.outward(np.array(point))) == pytest.approx(1)


def test_its_farthest_points_are_those_of_many_on_its_surface(rng: np.random.Generator) -> None:
    turn = Rotation.align_vectors([CAN.helper], [[0, 0, 1]])[0]
    angle = np.linspace(0, 2 * np.pi, 721)[:, None]
    rim = turn.apply(np.hstack([np.cos(angle), np.sin(angle), 0 * angle])) * (CAN.radius - CAN.edge_radius)
    faces = np.array([CAN.start + CAN.edge_radius * CAN.helper, CAN.end - CAN.edge_radius * CAN.helper])
    points = np.vstack([face + rim for face in faces])
    for direction in rng.normal(size=(50, 3)):
        assert (CAN.support(direction) @ direction).max() == pytest.approx((points @ direction).max(), abs=1e-4)
    lower, upper = CAN.bounding_box
    np.testing.assert_allclose(lower, points.min(axis=0) - CAN.edge_radius, atol=1e-4)
    np.testing.assert_allclose(upper, points.max(axis=0) + CAN.edge_radius, atol=1e-4)


def test_derivatives(rng: np.random.Generator) -> None:
    checks.check_derivatives(CAN, rng)
    ends = [end for edge in CAN.edges() for end in edge]
    checks.check_finite(CAN, [CAN.centroid, CAN.start, CAN.start + CAN.edge_radius * CAN.helper, *ends[:4]])


def test_placed_and_packed(rng: np.random.Generator) -> None:
    checks.check_placed(CAN, rng)
    checks.check_lowest(CAN, rng)
    checks.check_edges(CAN, rng)


def test_mass_properties_are_those_of_coal() -> None:
    length = float(np.linalg.norm(CAN.end - CAN.start))
    checks.check_solid(CAN, checks.along_z(coal.Cylinder(CAN.radius, length), CAN.start, CAN.end))


def test_the_distance_of_a_link_is_that_of_coal(rng: np.random.Generator) -> None:
    checks.check_links(CAN, core(), rng)


def test_a_task_file_gives_a_can() -> None:
    can = "cylinder: {start: [0, 0, -0.02], end: [0, 0, 0.02], radius: 0.03}"
    refused = {
        can.replace("0.02]", "-0.02]").replace("--", "-"): "two faces apart from each other",
        can.replace("radius: 0.03", "radius: 0.03, edge_radius: 0.02"): "an edge_radius smaller than",
    }
    shape = checks.shape_in_task(can, refused)
    assert type(shape.body) is KINDS["cylinder"] is Cylinder
    assert shape.edge_radius == pytest.approx(0.001)


def test_off_the_rims_of_side_and_faces_normals_are_those_of_the_sharp_cylinder(rng: np.random.Generator) -> None:
    checks.check_faces(CAN, replace(CAN, edge_radius=1e-6), rng, 0.5)
    axis = (CAN.end - CAN.start) / np.linalg.norm(CAN.end - CAN.start)
    normals, _ = CAN.face(CAN.on_surface(CAN.centroid + 0.6 * np.cross(axis, [1, 0, 0])))
    np.testing.assert_allclose(normals, [axis, -axis], atol=1e-12)
