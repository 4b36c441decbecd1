"""Boxes: coal measures the core; symbols against numbers; inertia by coal; a box in a task file."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import coal
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.geometry.bodies import KINDS
from casadi_hands.geometry.bodies.box import Box
from tests.geometry.bodies import checks

CRATE = Box(np.array([0.1, -0.2, 0.3]), np.array([0.8, 1.4, 2.0]), np.array([0.3, -0.5, 0.9]), 0.05)


def core() -> checks.Placed:
    return coal.Box(*(CRATE.size - 2 * CRATE.edge_radius)), coal.Transform3s(CRATE.turn, CRATE.center)


def test_distances_of_points_are_those_of_coal(rng: np.random.Generator) -> None:
    for point in checks.around(CRATE, rng, 300):
        tiny = coal.Sphere(1e-9), coal.Transform3s(np.eye(3), point)
        local = np.abs(CRATE.turn.T @ (point - CRATE.center)) - CRATE.size / 2
        if (local + CRATE.edge_radius).max() > 1e-6:
            found = checks.coal_distance(core(), tiny) - CRATE.edge_radius
            assert CRATE.signed_distance(point) == pytest.approx(found, abs=1e-6)
        else:  # within, the nearest face counts
            assert CRATE.signed_distance(point) == pytest.approx(local.max())
        on = CRATE.on_surface(point)
        assert CRATE.signed_distance(on) == pytest.approx(0, abs=1e-12)
        assert np.linalg.norm(on - point) == pytest.approx(abs(CRATE.signed_distance(point)))


def test_symbols(rng: np.random.Generator) -> None:
    function = checks.surface_function(CRATE)
    for point in checks.around(CRATE, rng, 300):
        distance, normal, *_ = (np.asarray(value).ravel() for value in function(point, CRATE.parameters))
        assert distance[0] == pytest.approx(CRATE.signed_distance(point), abs=2e-3)
        if distance[0] > 0:
            np.testing.assert_allclose(normal, CRATE.outward(point), atol=0.03)
    checks.check_derivatives(CRATE, rng)
    corners = [corner for edge in CRATE.edges() for corner in edge]
    checks.check_finite(CRATE, [CRATE.center, CRATE.center + 0.1 * CRATE.turn[:, 0], *corners])


def test_placed_and_packed(rng: np.random.Generator) -> None:
    checks.check_placed(CRATE, rng)


def test_its_lowest_point(rng: np.random.Generator) -> None:
    checks.check_lowest(CRATE, rng)


def test_level_faces_are_lowest_in_their_middles() -> None:
    level = Box(np.zeros(3), np.ones(3), np.zeros(3), 0.05)
    (lowest,) = Box.surface(ca.SX(level.parameters)).core.lowest(ca.SX([0, 0, 1]))
    np.testing.assert_allclose(np.asarray(ca.evalf(lowest)).ravel(), [0, 0, -0.45], atol=1e-3)


def test_farthest_points_are_those_of_its_corners(rng: np.random.Generator) -> None:
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    inner = CRATE.center + (signs * (CRATE.size / 2 - CRATE.edge_radius)) @ CRATE.turn.T
    for direction in rng.normal(size=(50, 3)):
        assert (CRATE.support(direction) @ direction).max() == pytest.approx((inner @ direction).max())
    assert len(CRATE.support(CRATE.turn[:, 1])) == 4
    checks.check_edges(CRATE, rng)


def test_where_two_faces_are_as_near_there_is_no_normal() -> None:
    flat = Box(np.zeros(3), np.array([1.0, 1.0, 0.2]), np.zeros(3), 0.01)
    assert not flat.has_normal(np.array([0.2, 0, 0]))
    assert not flat.has_normal(np.array([0.43, 0, 0.03]))
    for point in ([0.2, 0, 1e-3], [0.45, 0, 0], [0.9, 0, 0]):
        assert flat.has_normal(np.array(point))


def test_mass_properties_are_those_of_coal() -> None:
    checks.check_solid(CRATE, (coal.Box(*CRATE.size), coal.Transform3s(CRATE.turn, CRATE.center)))


def test_the_distance_of_a_link_is_that_of_coal(rng: np.random.Generator) -> None:
    checks.check_links(CRATE, core(), rng)


def test_a_task_file_gives_a_box() -> None:
    box = "box: {center: [0, 0, 0.01], size: [0.04, 0.06, 0.06], rotation: {axis: [1, 0, 0], degrees: 180}}"
    refused = {
        box.replace("0.04,", "0.0,"): "greater than 0|above 0",
        box.replace("rotation", "edge_radius: 0.03, rotation"): "an edge_radius smaller than half the shortest side",
    }
    shape = checks.shape_in_task(box, refused)
    assert type(shape.body) is KINDS["box"] is Box
    assert shape.edge_radius == pytest.approx(0.0005)
    np.testing.assert_allclose(shape.center, 0)  # of mass
    np.testing.assert_allclose(shape.body.turn, Rotation.from_rotvec([np.pi, 0, 0]).as_matrix(), atol=1e-15)


def test_off_the_edges_of_a_face_normals_are_those_of_the_sharp_box(rng: np.random.Generator) -> None:
    checks.check_faces(CRATE, replace(CRATE, edge_radius=1e-6), rng, 0.5)
    normals, offsets = CRATE.face(CRATE.center + 0.4 * CRATE.turn[:, 0])
    np.testing.assert_allclose(normals, CRATE.turn.T[[1, 1, 2, 2]] * [[1], [-1], [1], [-1]], atol=1e-12)
    np.testing.assert_allclose(offsets - normals @ CRATE.center, [0.65, 0.65, 0.95, 0.95], atol=0.02)
