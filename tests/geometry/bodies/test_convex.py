"""Polytopes: coal measures the sharp one; symbols against numbers; mass properties by coal; task files."""

from __future__ import annotations

import itertools
import pickle
from dataclasses import replace

import casadi as ca
import coal
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from casadi_hands.geometry.bodies import KINDS
from casadi_hands.geometry.bodies.box import Box
from casadi_hands.geometry.bodies.capsule import Segment
from casadi_hands.geometry.bodies.convex import Convex
from casadi_hands.geometry.hull import ALIKE, hull_of
from casadi_hands.geometry.pairs import core_distance
from tests.geometry.bodies import checks

Array = NDArray[np.float64]
CRATE = Box(np.array([0.1, -0.2, 0.3]), np.array([0.8, 1.4, 2.0]), np.array([0.3, -0.5, 0.9]), 0.01)
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * CRATE.size / 2
SAME = Convex(CRATE.center + CORNERS @ CRATE.turn.T, 0.01)
WEDGE = Convex(np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 1], [2, 0, 1.0], [1, 0.3, 0.4]]), 0.01)
ANGLES = 2 * np.pi * np.arange(24) / 24
PRISM = Convex(np.array([[np.cos(a), np.sin(a), z] for a in ANGLES for z in (-1, 1)]), 0.01)


def test_a_box_is_a_box(rng: np.random.Generator) -> None:
    assert SAME.counts == (6, 8, 12, 8)
    for point in checks.around(CRATE, rng, 300):
        expected, found = CRATE.signed_distance(point), SAME.signed_distance(point)
        local = np.abs(CRATE.turn.T @ (point - CRATE.center)) - CRATE.size / 2
        if np.diff(np.sort(local))[1] > 0.1 and np.sort(local)[1] < -0.1:  # beside a face alone
            assert found == pytest.approx(expected, abs=1e-6)
            np.testing.assert_allclose(SAME.outward(point), CRATE.outward(point), atol=1e-6)
        elif expected > 0:
            assert 0.5 * expected < found < expected + 0.01
    assert SAME.volume == pytest.approx(CRATE.volume)
    np.testing.assert_allclose(SAME.centroid, CRATE.centroid, atol=1e-12)
    np.testing.assert_allclose(SAME.unit_inertia, CRATE.unit_inertia, atol=1e-12)


@pytest.mark.parametrize("body", [SAME, WEDGE, PRISM], ids=["box", "wedge", "prism"])
def test_its_surface_is_next_to_the_sharp_one(body: Convex, rng: np.random.Generator) -> None:
    """Coal measures how far points of the surface are from the polytope: along edges within it, at faces on it."""
    off = []
    for point in checks.around(body, rng, 200):
        on = body.on_surface(point)
        assert body.signed_distance(on) == pytest.approx(0, abs=1e-9)
        off.append(checks.coal_distance(_hull(body), (coal.Sphere(1e-9), coal.Transform3s(np.eye(3), on))))
    assert min(off) > -0.02
    assert max(off) < 5e-3
    assert np.median(np.abs(off)) < 4e-3


def _hull(body: Convex) -> checks.Placed:
    points = coal.StdVec_Vec3s()
    points.extend(list(np.asarray(body.vertices)))
    return coal.Convex.convexHull(points, True, "Qt"), coal.Transform3s.Identity()


@pytest.mark.parametrize("body", [SAME, WEDGE, PRISM], ids=["box", "wedge", "prism"])
def test_symbols(body: Convex, rng: np.random.Generator) -> None:
    function = checks.surface_function(body)
    for point in checks.around(body, rng, 100):
        distance, normal, *_ = (np.asarray(value).ravel() for value in function(point, body.parameters))
        assert distance[0] == pytest.approx(body.signed_distance(point), abs=1e-9)
        if body.has_normal(point):
            np.testing.assert_allclose(normal, body.outward(point), atol=1e-6)
    checks.check_lowest(body, rng)
    checks.check_placed(body, rng)


def test_derivatives_are_finite_anywhere() -> None:
    corners = [corner for edge in WEDGE.edges() for corner in edge]
    checks.check_finite(WEDGE, [WEDGE.centroid, 1e3 * np.ones(3), *corners[:3]])


def test_mass_properties_are_those_of_coal() -> None:
    checks.check_solid(WEDGE, _hull(WEDGE))


@pytest.mark.parametrize("body", [SAME, PRISM, WEDGE], ids=["box", "prism", "wedge"])
def test_the_distance_of_a_link_is_that_of_coal(body: Convex, rng: np.random.Generator) -> None:
    checks.check_links(body, _hull(body), rng, most=8e-3, swept=body.ball)


CONE = np.vstack([[[np.cos(a), np.sin(a), 0] for a in 2 * np.pi * np.arange(64) / 64], [[0, 0, 0.5]]])
SPIKE = np.vstack([CORNERS[CORNERS[:, 2] < 0] * 0.15, [[0, 0, 2]]])
PLATE = CORNERS * [1, 1, 0.02]


@pytest.mark.parametrize("points", [CONE, SPIKE, PLATE], ids=["cone", "spike", "plate"])
def test_distances_are_right_beside_tips_and_thin_edges_too(points: Array, rng: np.random.Generator) -> None:
    """A tip where blunt edges meet, and edges that planes of faces tell least of; far ones need not be found."""
    body, enough = Convex(points, 1e-3), 0.3
    surface = type(body).surface(ca.SX(body.parameters))
    ends = [ca.SX.sym(name, 3) for name in ("start", "end")]
    limits = None, ca.SX(enough)
    cores = [core_distance(Segment(*ends), surface.core, limit) - float(body.edge_radius) for limit in limits]
    function, near = ca.Function("distances", ends, cores), 0
    for start, way in rng.uniform(-1, 1, (400, 2, 3)):
        start = 1.3 * start + [0, 0, 0.5]
        end = start + 0.7 * way
        length = float(np.linalg.norm(end - start))
        truth = checks.coal_distance(checks.along_z(coal.Capsule(1e-6, length), start, end), _hull(body)) + 1e-6
        found, quick = (float(value) for value in function(start, end))
        if truth <= 1e-6:
            assert found < 1e-3
        else:
            assert found == pytest.approx(truth, abs=3e-3)
        if found < enough - body.edge_radius:
            assert quick == found
            near += 1
        else:
            assert quick > enough - 2 * body.edge_radius
    assert near > 30


def test_it_travels() -> None:
    there = pickle.loads(pickle.dumps(PRISM))
    assert type(there) is type(PRISM)
    np.testing.assert_array_equal(there.parameters, PRISM.parameters)


def test_what_has_other_counts_is_of_another_class() -> None:
    other = replace(SAME, vertices=WEDGE.vertices)
    assert type(other) is type(WEDGE) is not type(SAME)
    np.testing.assert_array_equal(other.parameters, WEDGE.parameters)


def test_turned_it_has_the_faces_and_corners_that_it_had(rng: np.random.Generator) -> None:
    # Corners that are off the faces of a box by less than what makes two faces of one, near the origin.
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    counts = set()
    for _ in range(40):
        body = Convex(corners + rng.uniform(-ALIKE / 2, ALIKE / 2, corners.shape), 0.05)
        turn, shift = Rotation.random(random_state=rng).as_matrix(), 10 * rng.normal(size=3)
        placed = body.placed(turn, shift)
        assert type(placed) is type(body)
        assert type(pickle.loads(pickle.dumps(placed))) is type(body)
        assert len(placed.parameters) == placed.width
        counts.add(len(hull_of(placed.vertices).normals) - body.counts[0])
        point = 3 * rng.normal(size=3)
        assert placed.signed_distance(turn @ point + shift) == pytest.approx(body.signed_distance(point), abs=1e-9)
    assert counts != {0}  # found anew, hulls have others


def test_a_task_file_gives_a_polytope() -> None:
    points = [[x, y, z] for x in (-0.02, 0.02) for y in (-0.03, 0.03) for z in (-0.03, 0.03)]
    flat = [[x, y, 0.0] for x, y, _ in points]
    refused = {
        f"convex: {{vertices: {flat}}}": "four points or more that do not lie in one plane",
        f"convex: {{vertices: {points[:3]}}}": "4",
        f"convex: {{vertices: {points}, edge_radius: 0.02}}": "an edge_radius smaller than half its least width",
    }
    shape = checks.shape_in_task(f"convex: {{vertices: {points}}}", refused)
    assert isinstance(shape.body, KINDS["convex"])
    assert shape.body.counts == (6, 8, 12, 8)
    assert shape.edge_radius == pytest.approx(0.0002)


@pytest.mark.parametrize("body", [SAME, Convex(np.vstack([np.zeros(3), np.eye(3)]), 0.01)], ids=["box", "corner"])
def test_off_sharp_edges_normals_are_those_of_the_faces(body: Convex, rng: np.random.Generator) -> None:
    checks.check_faces(body, replace(body, edge_radius=1e-6), rng, 0.5)


def test_a_face_has_the_bounds_of_its_sharp_edges_alone() -> None:
    side, top = np.array([1.0, 0.1, 0.0]), np.array([0.1, 0.2, 1.0])
    normals, offsets = PRISM.face(side)
    np.testing.assert_allclose(sorted(normals[:, 2]), [-1, 1])  # not those to the next sides, over which it may roll
    np.testing.assert_allclose(offsets, 1, atol=0.05)
    normals, offsets = PRISM.face(top)
    assert len(normals) == PRISM.face_bounds
    assert np.all(normals @ top <= offsets)
    assert not np.all(normals @ [0.2, 0.995, 1.0] <= offsets)


def test_next_to_acute_edges_links_are_as_far_as_they_seem(rng: np.random.Generator) -> None:
    """By its faces alone, a link abreast of a blade's edge seems to be at less than half of its distance."""
    blade = Convex(np.array([[x, y, z] for z in (-1, 1) for x, y in ((0, 0), (-2, 0.5), (-2, -0.5))]), 0.01)
    assert blade.counts == (5, 6, 9, 6)
    surface = type(blade).surface(ca.SX(blade.parameters))
    ends = [ca.SX.sym(name, 3) for name in ("start", "end")]
    distance = ca.Function("distance", ends, [core_distance(Segment(*ends), surface.core) - surface.radius])
    shares = []
    for _ in range(200):
        away = rng.uniform(-np.pi / 2, np.pi / 2)  # all around the edge, seen along it
        at = rng.uniform(0.3, 1) * np.array([np.cos(away), np.sin(away), 0])
        start, end = (at + z * np.array([0, 0, 1]) for z in (-0.3, 0.4))
        length = float(np.linalg.norm(end - start))
        truth = checks.coal_distance(checks.along_z(coal.Capsule(1e-6, length), start, end), _hull(blade))
        by_faces = float((blade._hull.normals @ at - blade._hull.reaches).max())
        shares.append((float(distance(start, end)) / truth, by_faces / truth))
    found, plain = np.transpose(shares)
    assert plain.min() < 0.5
    np.testing.assert_allclose(found, 1, atol=5e-3)
