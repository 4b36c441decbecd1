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
    center, rotation_palm = (np.array(palm.position), palm.rotation) if pose is None else pose
    rotation, to_palm = rotation_matrix(vector), rotation_palm.T

    def distance(points: np.ndarray) -> np.ndarray:
        """Signed distances (E,) of the disc and points (E, 3) in the palm frame, m."""
        across, above = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
        beyond = np.stack([across - palm.radius, np.maximum(above, -palm.thickness - above)])
        return np.asarray(np.linalg.norm(np.maximum(beyond, 0), axis=0) + np.minimum(beyond.max(axis=0), 0))

    edges = np.concatenate([shape.edges for shape in body.shapes])
    balls = np.concatenate([np.full(len(shape.edges), shape.body.ball) for shape in body.shapes])
    starts, ends = ((position + end @ rotation.T - center) @ to_palm.T for end in edges.swapaxes(0, 1))
    return float(np.max(balls - _least(distance, starts, ends)))


def _least(function: Callable[[np.ndarray], np.ndarray], start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Least values (E,) of a convex function on the segments from start to end, (E, 3) each, by ternary search.

    The distance to a convex body is convex, so this finds its minimum.
    """
    low, high = np.zeros((len(start), 1)), np.ones((len(start), 1))
    along = end - start
    while (high - low).max() > 1e-9:
        left, right = low + (high - low) / 3, high - (high - low) / 3
        ahead = (function(start + left * along) < function(start + right * along))[:, None]
        low, high = np.where(ahead, low, left), np.where(ahead, right, high)
    return function(start + (low + high) / 2 * along)
