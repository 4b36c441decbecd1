"""Where bodies touch, against coal and sampled surfaces."""

from __future__ import annotations

from typing import Any

import coal
import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

from casadi_hands.verify.figures.closest import closest_to_capsule, level_directions, lowest_points
from casadi_hands.verify.shapes import Capsule, Cylinder, Shape


def _shapes() -> list[Shape]:
    return [
        Capsule(np.array([0.0, -0.01, -0.03]), np.array([0.005, 0.01, 0.03]), 0.012),
        Cylinder(np.array([0.0, -0.01, -0.03]), np.array([0.005, 0.01, 0.03]), 0.012),
    ]


def _solid(shape: Capsule | Cylinder) -> tuple[Any, coal.Transform3s]:
    """The shape in coal, and where it is."""
    axis = shape.end - shape.start
    length = float(np.linalg.norm(axis))
    turn = Rotation.align_vectors([axis / length], [[0.0, 0.0, 1.0]])[0].as_matrix()
    kind = coal.Capsule if isinstance(shape, Capsule) else coal.Cylinder
    return kind(shape.radius, length), coal.Transform3s(turn, (shape.start + shape.end) / 2)


@pytest.mark.parametrize("shape", _shapes(), ids=lambda shape: type(shape).__name__)
def test_closest_points_are_coal_s(shape: Any) -> None:
    rng = np.random.default_rng(3)
    start = rng.normal(size=(40, 3)) * 0.06
    start *= np.maximum(0.06 / np.linalg.norm(start, axis=1, keepdims=True), 1.0)
    end = start + rng.normal(size=(40, 3)) * 0.02
    end *= np.maximum(0.06 / np.linalg.norm(end, axis=1, keepdims=True), 1.0)
    points, normals = closest_to_capsule(shape, start, end, 0.006)
    solid, place = _solid(shape)
    for a, b, point, normal in zip(start, end, points, normals, strict=True):
        other = Capsule(a, b, 0.006)
        link, at = _solid(other)
        result = coal.DistanceResult()
        distance = coal.distance(solid, place, link, at, coal.DistanceRequest(), result)
        assert distance > 0.0
        ours, theirs = np.asarray(result.getNearestPoint1()), np.asarray(result.getNearestPoint2())
        # Where both are nearly parallel the place along them is open, and the distance is not.
        assert point == pytest.approx((ours + theirs) / 2, abs=2e-4)
        assert normal == pytest.approx((theirs - ours) / distance, abs=5e-3)


@pytest.mark.parametrize("shape", _shapes(), ids=lambda shape: type(shape).__name__)
def test_lowest_points_are_the_lowest_of_the_surface(shape: Any) -> None:
    rng = np.random.default_rng(4)
    up = rng.normal(size=(20, 3))
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    found = lowest_points(shape, up, np.zeros((20, 3)), np.zeros(20, bool))
    axis = shape.end - shape.start
    across = null_space(axis[None])
    turns = np.linspace(0, 2 * np.pi, 721)
    ring = shape.radius * (np.outer(np.cos(turns), across[:, 0]) + np.outer(np.sin(turns), across[:, 1]))
    ends = np.vstack([shape.start + ring, shape.end + ring])
    for direction, point in zip(up, found, strict=True):
        heights = ends @ direction
        if isinstance(shape, Capsule):
            heights = np.array([shape.start, shape.end]) @ direction - shape.radius
        assert point @ direction == pytest.approx(heights.min(), abs=1e-6)
        assert shape.distance(point[None])[0] == pytest.approx(0.0, abs=1e-9)
    assert len(level_directions(shape, up[0])) == 0


def test_what_lies_flat_cannot_tip() -> None:
    bar = Capsule(np.array([-0.04, 0.0, 0.0]), np.array([0.04, 0.0, 0.0]), 0.01)
    drum = Cylinder(np.array([-0.04, 0.0, 0.0]), np.array([0.04, 0.0, 0.0]), 0.01)
    up, along = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    planned = np.array([[0.01, 0.002, -0.01]])
    for shape in (bar, drum):
        assert np.abs(level_directions(shape, up)) == pytest.approx(np.array([[0.0, 1.0, 0.0]]))
        # On a line it touches where the plan has it.
        assert lowest_points(shape, up[None], planned, np.array([False])) == pytest.approx(
            np.array([[0.01, 0.0, -0.01]])
        )
        # Tilted a little from a plan in which it lies, it is where the plan has it still.
        lifted = np.array([[np.sin(0.01), 0.0, np.cos(0.01)]])
        assert lowest_points(shape, lifted, planned, np.array([True]))[0, 0] == pytest.approx(0.01, abs=2e-4)
        assert lowest_points(shape, lifted, planned, np.array([False]))[0, 0] < -0.03
    assert len(level_directions(bar, along)) == 0
    flat = level_directions(drum, along)
    assert flat @ flat.T == pytest.approx(np.eye(2))
    assert flat @ along == pytest.approx(np.zeros(2))
