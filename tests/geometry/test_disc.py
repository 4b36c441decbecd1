"""Distance from the palm's body against a brute-force search over its surface."""

import casadi as ca
import numpy as np
import pytest

from casadi_hands.geometry import point_disc_distance

RADIUS = 1.2


def distance(point) -> float:
    return float(point_disc_distance(ca.DM(point), ca.DM(RADIUS)))


def surface() -> np.ndarray:
    """A dense cloud on the face and on the rim's cylinder beneath it."""
    angle = np.linspace(0, 2 * np.pi, 361)
    face = [[r * np.cos(a), r * np.sin(a), 0] for r in np.linspace(0, RADIUS, 61) for a in angle]
    rim = [[RADIUS * np.cos(a), RADIUS * np.sin(a), z] for z in np.linspace(0, -3, 61) for a in angle]
    return np.array(face + rim)


@pytest.mark.parametrize(
    "point",
    [[0.3, 0.2, 0.5], [2, 1, 0.4], [2, 0, -0.7], [0.5, 0.5, -0.2], [1.0, 0.3, -0.9], [0, 0, 0.1], [1.19, 0, -2]],
)
def test_signed_distance_is_that_of_the_nearest_surface_point(point) -> None:
    nearest = np.linalg.norm(surface() - point, axis=1).min()
    inside = point[2] < 0 and np.hypot(*point[:2]) < RADIUS
    assert distance(point) == pytest.approx(-nearest if inside else nearest, abs=5e-3)


@pytest.mark.parametrize("point", [[0, 0, 0], [RADIUS, 0, 0], [0, 0, -1], [0, 0, 1], [RADIUS, 0, -1]])
def test_derivatives_are_finite_at_edges(point) -> None:
    x = ca.SX.sym("x", 3)
    hessian, gradient = ca.hessian(point_disc_distance(x, ca.SX(RADIUS)), x)
    for found in ca.Function("f", [x], [gradient, hessian])(point):
        assert np.isfinite(np.asarray(found)).all()
