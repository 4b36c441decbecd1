"""Contact points on bodies."""

from __future__ import annotations

import numpy as np
import pytest

from casadi_hands.geometry.bodies.capsule import Capsule
from casadi_hands.geometry.bodies.sphere import Sphere
from casadi_hands.geometry.contact_points import inward_normals, on_bodies, rounded_normals

BODIES = [Sphere(np.array([0, 0, 1.0]), 0.5), Capsule(np.zeros(3), np.array([2.0, 0, 0]), 0.25)]


def test_each_point_is_put_on_its_own_body() -> None:
    points = np.array([[0.3, 0, 1.0], [1.0, 0, 0.3]])
    np.testing.assert_allclose(on_bodies(points, BODIES), [[0.5, 0, 1.0], [1.0, 0, 0.25]])
    np.testing.assert_allclose(inward_normals(points, BODIES), [[-1, 0, 0], [0, 0, -1]])


def test_a_point_without_a_body_is_an_error() -> None:
    with pytest.raises(ValueError, match="zip"):
        on_bodies(np.ones((3, 3)), BODIES)


def test_rounded_normals_are_true_ones_but_where_the_surface_has_a_kink() -> None:
    capsule = Capsule(np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0]), 0.3)
    slant = np.array([0.18, 0.0, 0.24])  # 0.3 long, from the end of the axis
    points = np.array([[0.3, 0.0, 0.2], [0.0, -0.3, -0.7], [0.18, 0.0, 1.24], [0.3, 0.0, 1.0]])
    found = rounded_normals(points, capsule)
    assert np.linalg.norm(found, axis=1) == pytest.approx(np.ones(4), abs=1e-9)
    np.testing.assert_allclose(found[:3], [[1, 0, 0], [0, -1, 0], slant / 0.3], atol=1e-5)
    assert 1e-3 < found[3, 2] < 5e-3  # between the side's normal and the cap's
