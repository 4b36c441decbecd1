"""Points spread over surfaces: on them, evenly, clear of edges and of other bodies."""

import numpy as np
import pytest

from casadi_hands.geometry.bodies import KINDS
from casadi_hands.placement.surface import bending_radius, farthest_first, radial, spots

SPHERE = KINDS["sphere"](np.zeros(3), 1.0)
CAPSULE = KINDS["capsule"](np.array([0, 0, -0.6]), np.array([0, 0, 0.6]), 0.3)
CYLINDER = KINDS["cylinder"](np.array([0, 0, -1.0]), np.array([0, 0, 1.0]), 0.5, 0.025)


@pytest.mark.parametrize("body", [SPHERE, CAPSULE, CYLINDER], ids=lambda body: body.kind)
def test_points_are_on_the_surface_with_its_normals(body) -> None:
    on = spots([body], 0.1, 100, np.random.default_rng(0))
    assert len(on) >= 100
    for point, normal in zip(on.points, on.normals, strict=True):
        assert body.signed_distance(point) == pytest.approx(0, abs=1e-9)
        assert body.signed_distance(point + 0.05 * normal) == pytest.approx(0.05, abs=1e-9)
        assert np.linalg.norm(normal) == pytest.approx(1)


def test_areas_count_alike() -> None:
    sphere = spots([SPHERE], 0.1, 200, np.random.default_rng(0)).points[:200]
    # Archimedes: a cap's area is in proportion to its height.
    assert (sphere[:, 2] > 0.5).mean() == pytest.approx(0.25, abs=0.05)
    assert (np.abs(sphere[:, 0]) < 0.5).mean() == pytest.approx(0.5, abs=0.06)
    capsule = spots([CAPSULE], 0.1, 200, np.random.default_rng(0)).points[:200]
    side = 2 * np.pi * 0.3 * 1.2 / (2 * np.pi * 0.3 * 1.2 + 4 * np.pi * 0.3**2)
    assert (np.abs(capsule[:, 2]) < 0.6).mean() == pytest.approx(side, abs=0.08)


def test_edges_are_left_out() -> None:
    on = spots([CYLINDER], 0.1, 200, np.random.default_rng(0))
    across, height = np.linalg.norm(on.points[:, :2], axis=1), np.abs(on.points[:, 2])
    side, face = across > 0.5 - 1e-9, height > 1 - 1e-9
    assert (side | face).all()
    assert side.sum() > 50
    assert face.sum() > 20


def test_points_in_another_body_are_left_out() -> None:
    other = KINDS["sphere"](np.array([0, 0, 1.2]), 0.5)
    on = spots([SPHERE, other], 0.1, 200, np.random.default_rng(0))
    tips = on.points + 0.1 * on.normals
    for body in (SPHERE, other):
        assert min(body.signed_distance(tip) for tip in tips) >= 0.1 - 1e-9
    assert set(on.bodies) == {0, 1}


def test_the_same_points_for_the_same_seed() -> None:
    first, again, other = (spots([CAPSULE], 0.1, 50, np.random.default_rng(seed)).points for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_radial_points_push_through_the_origin() -> None:
    on = radial([CYLINDER], 0.1)
    turning = np.linalg.norm(np.cross(on.points, on.normals), axis=1)
    assert turning.max() < 2e-3
    assert len(on) > 10
    for normal in on.normals:  # each has one that faces it
        assert (on.normals @ normal).min() < -0.999


def test_the_smallest_radius_of_curvature() -> None:
    point, normal = np.array([0.3, 0, 0.2]), np.array([1.0, 0, 0])
    assert bending_radius(CAPSULE, point, normal, 1e-3) == pytest.approx(0.3, rel=0.01)
    assert bending_radius(CYLINDER, np.array([0.1, 0, 1.0]), np.array([0, 0, 1.0]), 1e-3) > 100


def test_each_point_is_the_farthest_from_those_before() -> None:
    points = np.array([[0.0], [1.0], [10.0], [4.0], [0.0]])
    assert farthest_first(points, 3).tolist() == [0, 2, 3]
    assert farthest_first(points, 9).tolist() == [0, 2, 3, 1]
