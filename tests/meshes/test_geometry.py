"""Polygons, winding numbers, hulls and distances against trimesh, SciPy and closed forms."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from casadi_hands.errors import MeshError
from casadi_hands.meshes.error import outside_distance, surface_distance, union_error
from casadi_hands.meshes.hull import hull, reduced
from casadi_hands.meshes.mesh import Mesh
from casadi_hands.meshes.polygons import quads_cut, triangulated
from casadi_hands.meshes.topology import edges_of
from casadi_hands.meshes.winding import overlapped, surface_points, winding_numbers
from tests.meshes.solids import angle, ball, box, inverted, joined


def area(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = points[triangles].transpose(1, 0, 2)
    return np.cross(b - a, c - a) / 2


@pytest.mark.parametrize("turn", range(8))
def test_concave_polygons_are_cut_into_triangles_that_do_not_overlap(turn: int) -> None:
    corner = np.arange(8) * np.pi / 4
    star = np.where(np.arange(8) % 2, 1.0, 0.3)[:, None] * np.column_stack([np.cos(corner), np.sin(corner), 0 * corner])
    hook = np.array([[0, 0, 0], [4, 0, 0], [4, 1, 0], [1, 1, 0], [1, 2, 0], [3, 3, 0], [0, 3, 0], [-1, 1, 0.0]])
    for polygon in (np.roll(star, turn, axis=0), np.roll(hook, turn, axis=0)):
        areas = area(polygon, triangulated(polygon))[:, 2]
        assert len(areas) == len(polygon) - 2
        # The sum is that of the polygon by the shoelace formula, and no triangle is turned over.
        x, y = polygon[:, 0], polygon[:, 1]
        assert areas.sum() == pytest.approx(0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
        assert areas.min() >= -1e-12


def test_a_quad_with_a_notch_is_cut_through_it() -> None:
    points = np.array([[0, 0, 0], [1, 0.4, 0], [0, 1, 0], [0.3, 0.45, 0.0]])
    for turn in range(4):
        cut = quads_cut(points, (np.arange(4)[None] + turn) % 4)
        assert (area(points, cut)[:, 2] > 0).all()


def test_winding_numbers_tell_inside_from_outside() -> None:
    points = np.random.default_rng(0).uniform(-0.03, 0.03, (500, 3))
    inside = (np.abs(points) < 0.02).all(axis=1)
    np.testing.assert_allclose(winding_numbers(box(), points), inside, atol=1e-9)
    twice = joined(box(), box((0.02, 0.02, 0.02)))
    np.testing.assert_allclose(
        winding_numbers(twice, points), inside + 1.0 * (np.abs(points) < 0.01).all(axis=1), atol=1e-9
    )


def test_the_share_of_a_surface_within_its_solid() -> None:
    assert overlapped(angle()) == 0
    assert overlapped(joined(box(), inverted(box((0.01, 0.01, 0.01))))) == 0
    # A quarter of each cube's area, less the two faces that meet, lies within the other.
    crossing = joined(box(), box(center=(0.02, 0.0001, 0.0001)))
    assert overlapped(crossing) == pytest.approx(6 / 24 + 2 * 2 / 24, abs=0.1)


def test_points_of_a_surface_are_spread_by_area() -> None:
    points, normals = surface_points(box((0.1, 0.02, 0.02)), 2000)
    ends = np.abs(normals[:, 0]) > 0.5
    assert ends.mean() == pytest.approx(2 * 0.02**2 / (2 * 0.02**2 + 4 * 0.1 * 0.02), abs=0.01)
    np.testing.assert_allclose(np.abs(points[ends, 0]), 0.05, atol=1e-12)


def test_a_hull_is_qhulls_closed_and_outward() -> None:
    points = np.random.default_rng(3).normal(size=(200, 3))
    found, oracle = hull(points), ConvexHull(points)
    assert found.volume == pytest.approx(oracle.volume, rel=1e-12)
    assert len(found.vertices) == len(oracle.vertices)
    assert not edges_of(found.faces).balance.any()


def test_a_reduced_hull_leaves_out_no_more_than_it_says() -> None:
    points = ball(0.02, 40).vertices
    for most in (8, 32, 96):
        small, told = reduced(points, 0.0, most)
        assert len(small.vertices) == most
        assert float(outside_distance(small, points).max()) <= told * (1 + 1e-9)
        assert float(outside_distance(hull(points), small.vertices).max()) <= 1e-9
    errors = [reduced(points, 0.0, most)[1] for most in (8, 32, 96)]
    assert errors == sorted(errors, reverse=True)
    assert len(reduced(box().vertices, 1e-6)[0].vertices) == 8


def test_points_in_a_plane_have_no_hull() -> None:
    with pytest.raises(MeshError, match="in a plane"):
        hull(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]]))


def test_distances_from_a_surface_are_those_of_every_triangle() -> None:
    mesh, points = angle(), np.random.default_rng(1).uniform(-0.03, 0.07, (200, 3))
    every = [
        trimesh.triangles.closest_point(np.repeat(corners[None], len(points), 0), points) for corners in mesh.corners
    ]
    oracle = np.linalg.norm(np.array(every) - points, axis=2).min(axis=0)
    np.testing.assert_allclose(surface_distance(mesh, points), oracle, atol=1e-7)


def test_distances_from_a_box_are_the_closed_form() -> None:
    points = np.random.default_rng(2).uniform(-0.05, 0.05, (300, 3))
    beyond = np.abs(points) - 0.02
    closed = np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)
    np.testing.assert_allclose(outside_distance(box(), points), closed, atol=1e-7)


def test_the_error_of_a_union_is_told_both_ways() -> None:
    size, thick = 0.04, 0.01
    whole = angle(size, thick)
    arms = [
        box((size, thick, size), (size / 2, thick / 2, size / 2)),
        box((thick, size, size), (thick / 2, size / 2, size / 2)),
    ]
    assert union_error(whole, arms) == pytest.approx((0, 0), abs=1e-6)
    # One arm alone: the farthest of the other is its end.
    assert union_error(whole, arms[:1])[0] == pytest.approx(size - thick, abs=1e-6)
    # The hull fills the corner: its slanted face is farthest from the L at its middle, where both arms are as near.
    missing, added = union_error(whole, [hull(whole.vertices)])
    assert missing == pytest.approx(0, abs=1e-6)
    assert added == pytest.approx((size - thick) / 2, rel=0.05)


def test_a_cavity_that_is_filled_counts() -> None:
    hollow = joined(box(), inverted(box((0.02, 0.02, 0.02))))
    assert union_error(hollow, [box()])[1] == pytest.approx(0.01, abs=1e-9)


def test_a_mesh_of_no_faces_has_no_volume() -> None:
    assert Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)).volume == 0
