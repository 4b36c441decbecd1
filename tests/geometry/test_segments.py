"""Distances of segments against coal's capsules, and derivatives where the textbook form has none."""

import casadi as ca
import coal
import numpy as np
import pytest

from casadi_hands.geometry import segment_distance

ROUNDING = 1e-4  # value at zero that the function states


def distance(*ends) -> float:
    return float(segment_distance(*(ca.DM(np.asarray(end, float)) for end in ends)))


def distance_by_coal(start, end, other_start, other_end) -> float:
    """Between thin capsules along the segments, their radii taken off."""
    thin, shapes = 1e-6, []
    for a, b in ((start, end), (other_start, other_end)):
        a, b = np.asarray(a, float), np.asarray(b, float)
        length = np.linalg.norm(b - a)
        z = (b - a) / length
        x = np.linalg.svd(z[None])[2][1]
        frame = coal.Transform3s(np.column_stack([x, np.cross(z, x), z]), (a + b) / 2)
        shapes += [coal.Capsule(thin, length), frame]
    return coal.distance(*shapes, coal.DistanceRequest(), coal.DistanceResult()) + 2 * thin


@pytest.mark.parametrize("near_parallel", [False, True])
def test_random_segments_agree_with_coal(near_parallel: bool) -> None:
    rng, checked = np.random.default_rng(5), 0
    for _ in range(400):
        start, end, other_start, other_end = rng.normal(size=(4, 3))
        if near_parallel:
            other_end = other_start + rng.uniform(0.2, 1.5) * (end - start) + 0.01 * rng.normal(size=3)
        truth = distance_by_coal(start, end, other_start, other_end)
        if truth < 0.3:  # closer than two axes come: links and object have radii
            continue
        lengths = np.linalg.norm(end - start) + np.linalg.norm(other_end - other_start)
        assert -1e-6 < distance(start, end, other_start, other_end) - truth < 1e-4 * lengths
        checked += 1
    assert checked > 200


@pytest.mark.parametrize(
    ("ends", "expected"),
    [
        (([0, 0, 0], [1, 0, 0], [0, 0.5, 0], [1, 0.5, 0]), 0.5),  # parallel, side by side
        (([0, 0, 0], [1, 0, 0], [0.2, 0.5, 0], [0.9, 0.5, 0]), 0.5),  # parallel, one within the other's span
        (([0, 0, 0], [1, 0, 0], [1, 0.5, 0], [0, 0.5, 0]), 0.5),  # antiparallel
        (([0, 0, 0], [1, 0, 0], [1.3, 0.4, 0], [3, 0.4, 0]), 0.5),  # parallel, past each other
        (([0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]), 1.0),  # in line
        (([0, 0, 0], [1, 0, 0], [0.5, 1, -1], [0.5, 1, 1]), 1.0),  # skew, both closest points inside
        (([0, 0, 0], [1, 0, 0], [1.6, 0.8, 0], [1.6, 0.8, 0]), 1.0),  # segment and point
        (([0, 0, 0], [0, 0, 0], [0, 3, 4], [0, 3, 4]), 5.0),  # two points
    ],
)
def test_closed_forms(ends, expected: float) -> None:
    assert distance(*ends) == pytest.approx(expected, abs=1e-4)
    assert distance(*ends[2:], *ends[:2]) == pytest.approx(expected, abs=1e-4)


def test_crossing_segments_are_at_no_distance_but_the_rounding() -> None:
    assert distance([-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]) == pytest.approx(ROUNDING, rel=1e-6)
    # Lying in each other: closest points are free; touching end to end: pulled to the middles a little.
    assert distance([0, 0, 0], [1, 0, 0], [0, 0, 0], [1, 0, 0]) == pytest.approx(ROUNDING, rel=1e-3)
    assert distance([0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 1, 0]) < 4 * ROUNDING


NASTY = {
    "parallel": ([0, 0, 0], [1, 0, 0], [0, 0.5, 0], [1, 0.5, 0]),
    "crossing": ([-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]),
    "same": ([0, 0, 0], [1, 0, 0], [0, 0, 0], [1, 0, 0]),
    "points": ([0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]),
    "end on end": ([0, 0, 0], [1, 0, 0], [1, 0, 0], [2, 0, 0]),
}


@pytest.mark.parametrize("case", NASTY)
def test_derivatives_are_finite(case: str) -> None:
    x = ca.SX.sym("x", 12)
    value = segment_distance(x[:3], x[3:6], x[6:9], x[9:])
    hessian, gradient = ca.hessian(value, x)
    at = np.ravel(NASTY[case]).astype(float)
    for found in ca.Function("f", [x], [gradient, hessian])(at):
        assert np.isfinite(np.asarray(found)).all()


def test_gradient_of_skew_segments_agrees_with_differences() -> None:
    x = ca.SX.sym("x", 12)
    value = segment_distance(x[:3], x[3:6], x[6:9], x[9:])
    function = ca.Function("f", [x], [value, ca.gradient(value, x)])
    at, h = np.random.default_rng(8).normal(size=12), 1e-6
    differences = [(float(function(at + h * e)[0]) - float(function(at - h * e)[0])) / (2 * h) for e in np.eye(12)]
    np.testing.assert_allclose(np.asarray(function(at)[1]).ravel(), differences, atol=1e-7)
