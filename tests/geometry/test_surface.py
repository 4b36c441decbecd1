"""A capsule's smooth surface against its geometry in NumPy, and directions across it."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from casadi_hands.geometry.surface import smooth_surface, tangents
from tests.stages.blocks import surface


def test_a_smooth_surface_is_the_capsule_but_at_its_kinks() -> None:
    capsule = np.array([0.1, 0.2, -0.4, 0.3, 0, 0.8, 0.25])
    point, start, end, radius = (ca.SX.sym(n, k) for n, k in (("p", 3), ("s", 3), ("e", 3), ("r", 1)))
    function = ca.Function("f", [point, start, end, radius], [*smooth_surface(point, start, end, radius)])
    for at in np.random.default_rng(0).normal(size=(200, 3)):
        distance, normal = function(at, capsule[:3], capsule[3:6], capsule[6])
        expected, outward = surface(at, capsule)
        assert float(distance) == pytest.approx(expected, abs=1e-5)
        np.testing.assert_allclose(np.asarray(normal).ravel(), outward, atol=3e-3)


def test_a_surface_s_derivatives_are_finite_on_its_kinks_and_its_axis() -> None:
    point = ca.SX.sym("point", 3)
    start, end, radius = ca.SX([0, 0, 0]), ca.SX([0, 0, 0.8]), ca.SX(0.25)
    distance, normal = smooth_surface(point, start, end, radius)
    hessian, gradient = ca.hessian(distance, point)
    function = ca.Function("f", [point], [gradient, hessian, normal])
    for at in ([0.25, 0, 0], [0.2, 0.1, 0.8], [0, 0, 0.4], [0, 0, 0], [0, 0, 1.05]):
        gradient, hessian, normal = (np.asarray(value) for value in function(at))
        assert np.isfinite(hessian).all()
        if np.linalg.norm(at[:2]) > 0:
            # The gradient of a distance is the normal, and has a length of one.
            np.testing.assert_allclose(gradient, normal, atol=3e-3)
            assert np.linalg.norm(gradient) == pytest.approx(1, abs=3e-3)


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
