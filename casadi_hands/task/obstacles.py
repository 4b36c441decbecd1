"""How deep an object or palm stands in what it must not enter."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from casadi_hands.task.object import ManipulatedObject
from casadi_hands.task.palm import Palm
from casadi_hands.task.rotation import rotation_matrix


def depth_below(body: ManipulatedObject, position: np.ndarray, vector: np.ndarray, height: float) -> float:
    """Depth of the object below the level ground at ``height``, m; negative above.

    Args:
        body: the object.
        position: (3,) of its frame, m, world.
        vector: (3,) rotation vector of its frame, rad.
        height: of the ground, m.
    """
    rotation = rotation_matrix(vector)
    return height - float((position + rotation @ body.lowest_point(rotation))[2])


def palm_depth_below(palm: Palm, position: np.ndarray, rotation: np.ndarray, height: float) -> float:
    """Depth of the palm's disc below the level ground at ``height``, m; negative above.

    Args:
        palm: the palm.
        position: (3,) of its frame, m, world.
        rotation: (3, 3) world <- palm.
        height: of the ground, m.
    """
    facing = rotation[:, 2]
    rim = palm.radius * np.hypot(facing[0], facing[1])
    back = max(0.0, palm.thickness * facing[2])
    return height - float(position[2] - rim - back)


def depth_in_palm(
    body: ManipulatedObject,
    position: np.ndarray,
    vector: np.ndarray,
    palm: Palm,
    pose: tuple[np.ndarray, np.ndarray] | None = None,
) -> float:
    """Depth of the object in the palm's disc, m; negative when clear.

    Args:
        body: the object.
        position: (3,) of its frame, m, world.
        vector: (3,) rotation vector of its frame, rad.
        palm: the palm.
        pose: position (3,), m, and rotation (3, 3) world <- palm; by default where it starts.
    """
    center, rotation = (np.array(palm.position), palm.rotation) if pose is None else pose
    to_palm = rotation.T

    def distance(point: np.ndarray) -> float:
        """Signed distance of the disc and a point (3,) in the palm frame, m."""
        beyond = np.array([np.hypot(point[0], point[1]) - palm.radius, max(point[2], -palm.thickness - point[2])])
        return float(np.linalg.norm(np.maximum(beyond, 0)) + min(beyond.max(), 0))

    rotation = rotation_matrix(vector)
    depths = []
    for shape in body.shapes:
        for edge in shape.body.edges():
            start, end = (to_palm @ (position + rotation @ p - center) for p in edge)
            depths.append(shape.body.ball - _least(distance, start, end))
    return float(max(depths))


def _least(function: Callable[[np.ndarray], float], start: np.ndarray, end: np.ndarray) -> float:
    """Least value of a convex function on the segment from start to end, (3,) each, by ternary search.

    The distance to a convex body is convex, so this finds its minimum.
    """
    low, high = 0.0, 1.0
    while high - low > 1e-9:
        left, right = low + (high - low) / 3, high - (high - low) / 3
        ahead = function(start + left * (end - start)) < function(start + right * (end - start))
        low, high = (low, right) if ahead else (left, high)
    return function(start + (low + high) / 2 * (end - start))
