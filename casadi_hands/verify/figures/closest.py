"""Where object and fingers, or object and ground, are closest to each other, for many placements at once."""

from __future__ import annotations

import numpy as np

from casadi_hands.verify.flat import Flat
from casadi_hands.verify.shapes import Capsule, Cylinder, Shape

LEVEL = 1e-3
"""rad: a line or a face that is tilted less lies on the ground."""

_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
_ROUNDS = 45
"""Of golden sections: each shortens the bracket to 0.62 of it, all together to 4e-10."""


def closest_to_capsule(
    shape: Shape, start: np.ndarray, end: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the points midway between a convex shape and capsules nearest to it, and the shape's normals there.

    Args:
        shape: in its own frame.
        start: (N, 3) m, of the capsules' axes, the shape's frame.
        end: (N, 3) m, likewise.
        radius: of the capsules, m.

    Returns:
        (N, 3) m and (N, 3), the shape's frame.
    """
    low, high = np.zeros(len(start)), np.ones(len(start))
    along = end - start

    def distance(share: np.ndarray) -> np.ndarray:
        return shape.distance(start + share[:, None] * along)

    first, second = np.full(len(start), 1.0 - _GOLDEN), np.full(len(start), _GOLDEN)
    near, far = distance(first), distance(second)
    for _ in range(_ROUNDS):
        left = near < far
        low, high = np.where(left, low, first), np.where(left, second, high)
        # One of the two stays where it is: only the other is measured.
        fresh = np.where(left, high - _GOLDEN * (high - low), low + _GOLDEN * (high - low))
        measured = distance(fresh)
        first, second = np.where(left, fresh, second), np.where(left, first, fresh)
        near, far = np.where(left, measured, far), np.where(left, near, measured)
    axis = start + (0.5 * (low + high))[:, None] * along
    normal = shape.normal(axis)
    gap = shape.distance(axis) + radius
    return axis - 0.5 * gap[:, None] * normal, normal


def lowest_points(shape: Shape, up: np.ndarray, planned: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Return the points (N, 3) of a shape that are lowest, m, its frame.

    Where a whole line or face is lowest, or is so in the plan, it is where the plan has it.

    Args:
        shape: in its own frame.
        up: (N, 3) unit, upward directions, its frame.
        planned: (N, 3) m.
        level: (N,) whether it stands on a line or a face in the plan.

    Raises:
        NotImplementedError: the shape is another.
    """
    if isinstance(shape, Flat):
        found = [_lowest_of(shape, *each) for each in zip(up, planned, strict=True)]
        return np.where(level[:, None], planned, found)
    start, axis = _axis(shape)
    length = float(np.linalg.norm(axis))
    unit = axis / max(length, 1e-300)
    tilt = up @ unit
    share = np.clip((planned - start) @ unit / max(length, 1e-300), 0.0, 1.0)
    upright = level & (np.abs(tilt) > 0.5)  # stands on its face, the axis up; else it lies, the axis level
    share = np.where(level & ~upright | (np.abs(tilt) < LEVEL), share, (tilt < 0.0).astype(float))
    points: np.ndarray = start + share[:, None] * axis
    if isinstance(shape, Capsule):
        return points - shape.radius * up
    across = up - tilt[:, None] * unit
    size = np.linalg.norm(across, axis=1, keepdims=True)
    rim = points - shape.radius * across / np.maximum(size, 1e-300)
    return np.where(upright[:, None] | (size < LEVEL), planned, rim)


def _lowest_of(shape: Flat, up: np.ndarray, planned: np.ndarray) -> np.ndarray:
    """Return the lowest point (3,) of a shape with corners."""
    corners = _level_corners(shape, up)
    if len(corners) == 1:
        return np.asarray(corners[0])
    if len(corners) == 2:
        along = corners[1] - corners[0]
        return np.asarray(corners[0] + np.clip((planned - corners[0]) @ along / (along @ along), 0.0, 1.0) * along)
    return planned


def _level_corners(shape: Flat, up: np.ndarray) -> np.ndarray:
    """Return the corners (n, 3) of a shape that are on the ground with its lowest."""
    heights = shape.corners @ up
    return np.asarray(shape.corners[heights <= heights.min() + LEVEL * shape.size])


def level_directions(shape: Shape, up: np.ndarray) -> np.ndarray:
    """Return the directions (n, 3), shape's frame, about which it cannot tip where it stands on a line or a face.

    Args:
        shape: in its own frame.
        up: (3,) unit, its frame.

    Raises:
        NotImplementedError: the shape is another.
    """
    if isinstance(shape, Flat):
        corners = _level_corners(shape, up)
        arms = corners - corners[0]
        rank = np.linalg.matrix_rank(arms, tol=LEVEL * shape.size)
        if rank > 1:
            both: np.ndarray = np.linalg.svd(up[None])[2][1:]
            return both
        longest = arms[np.argmax(np.linalg.norm(arms, axis=1))]
        line = np.cross(longest, up)[None] / max(float(np.linalg.norm(longest)), 1e-300)
        return line if rank else np.zeros((0, 3))
    axis = _axis(shape)[1]
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        return np.zeros((0, 3))
    unit = axis / length
    if abs(float(up @ unit)) < LEVEL:
        return np.cross(unit, up)[None]
    if isinstance(shape, Cylinder) and float(np.linalg.norm(np.cross(unit, up))) < LEVEL:
        across: np.ndarray = np.linalg.svd(up[None])[2][1:]
        return across
    return np.zeros((0, 3))


def _axis(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return where a shape's axis starts and where it leads (3,), m."""
    if not isinstance(shape, Capsule | Cylinder):
        raise NotImplementedError(f"the axis of a {type(shape).__name__.lower()}")
    return shape.start, shape.end - shape.start
