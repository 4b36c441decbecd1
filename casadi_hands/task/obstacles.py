"""How deep an object or palm stands in what it must not enter."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from casadi_hands.task.object import ManipulatedObject
from casadi_hands.task.palm import Palm
from casadi_hands.task.rotation import rotation_matrix

_RIM = 16  # points of a rim that stand for it


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
        return distance_from_disc(points, palm.radius, palm.thickness)

    edges = np.concatenate([shape.edges for shape in body.shapes])
    balls = np.concatenate([np.full(len(shape.edges), shape.body.ball) for shape in body.shapes])
    starts, ends = ((position + end @ rotation.T - center) @ to_palm.T for end in edges.swapaxes(0, 1))
    depth = float(np.max(balls - _least(distance, starts, ends)))
    # Of a face that is wider than the palm no edge need be in it.
    points = (center + _points_of_disc(palm.radius, palm.thickness) @ rotation_palm.T - position) @ rotation
    reach = float(np.linalg.norm(points[0] - points[-1]))
    for shape in body.shapes:
        if reach - shape.body.signed_distance(points[0]) > depth:
            depth = max(depth, -min(shape.body.signed_distance(point) for point in points))
    return depth


def distance_from_disc(points: np.ndarray, radius: float, thickness: float) -> np.ndarray:
    """Signed distances (E,) of points (E, 3) from a disc with its face at z = 0 and its back below; any unit."""
    across, above = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    beyond = np.stack([across - radius, np.maximum(above, -thickness - above)])
    return np.asarray(np.linalg.norm(np.maximum(beyond, 0), axis=0) + np.minimum(beyond.max(axis=0), 0))


def _points_of_disc(radius: float, thickness: float) -> np.ndarray:
    """Points (P, 3) of such a disc: its middle, then the rims of face and back."""
    angles = 2 * np.pi * np.arange(_RIM) / _RIM
    rim = radius * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    back = np.array([0, 0, -thickness])
    return np.vstack([back / 2, rim, rim + back])


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
