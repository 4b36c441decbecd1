"""Ways over surfaces against arcs, and directions across them."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.geometry.surface import path_between, tangents


def path(points: np.ndarray, normals: np.ndarray, turns: Rotation) -> np.ndarray:
    """The way from one knot to the next of two points (2, 3) with normals (2, 3)."""
    found = path_between(*([ca.DM(each) for each in pair] for pair in (points, normals, turns.as_matrix())))
    return np.asarray(found).ravel()


def test_a_way_over_a_ball_is_its_arc() -> None:
    # A chord of a circle is stretched to the arc, whichever way it goes.
    rng, radius = np.random.default_rng(0), 0.4
    for angle in (0.05, 0.3, 0.8):
        start, across = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
        end = np.cos(angle) * start + np.sin(angle) * across
        normals = np.array([start, end])
        found = path(radius * normals, normals, Rotation.identity(2))
        assert np.linalg.norm(found) == pytest.approx(radius * angle, rel=1e-2 * angle**5)
        np.testing.assert_allclose(np.cross(found, end - start), 0, atol=1e-12)


def test_a_way_over_what_is_flat_is_the_chord() -> None:
    points, normals = np.array([[0, 0, 0], [0.3, -0.2, 0]]), np.tile([0, 0, 1.0], (2, 1))
    np.testing.assert_allclose(path(points, normals, Rotation.identity(2)), points[1])


def test_a_way_is_seen_turned_halfway() -> None:
    points, normals = np.array([[0, 0, 0], [0.3, -0.2, 0]]), np.tile([0, 0, 1.0], (2, 1))
    for angle in (0.1, 0.4):
        axis = np.array([1.0, 2, 2]) / 3
        turns = Rotation.from_rotvec(np.outer([0.3, 0.3 + angle], axis))
        halfway = Rotation.from_rotvec((0.3 + angle / 2) * axis)
        np.testing.assert_allclose(path(points, normals, turns), halfway.apply(points[1]), atol=0.01 * angle**4)


def test_tangents_are_a_right_handed_frame_with_the_normal() -> None:
    normal, helper = ca.SX.sym("normal", 3), ca.SX.sym("helper", 3)
    function = ca.Function("f", [normal, helper], [*tangents(normal, helper)])
    for n, h in np.random.default_rng(1).normal(size=(20, 2, 3)):
        n /= np.linalg.norm(n)
        first, second = (np.asarray(value).ravel() for value in function(n, h))
        frame = np.column_stack([first, second, n])
        np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-12)
        assert np.linalg.det(frame) == pytest.approx(1, abs=1e-12)
        assert abs(first @ h) < 1e-12
