"""Contact points on bodies."""

from __future__ import annotations

import numpy as np
import pytest

from casadi_hands.geometry.bodies.capsule import Capsule
from casadi_hands.geometry.bodies.sphere import Sphere
from casadi_hands.geometry.contact_points import inward_normals, on_bodies

BODIES = [Sphere(np.array([0, 0, 1.0]), 0.5), Capsule(np.zeros(3), np.array([2.0, 0, 0]), 0.25)]


def test_each_point_is_put_on_its_own_body() -> None:
    points = np.array([[0.3, 0, 1.0], [1.0, 0, 0.3]])
    np.testing.assert_allclose(on_bodies(points, BODIES), [[0.5, 0, 1.0], [1.0, 0, 0.25]])
    np.testing.assert_allclose(inward_normals(points, BODIES), [[-1, 0, 0], [0, 0, -1]])


def test_a_point_without_a_body_is_an_error() -> None:
    with pytest.raises(ValueError, match="zip"):
        on_bodies(np.ones((3, 3)), BODIES)
