"""Polygons cut into triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def triangulated(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Cut a polygon, which may be concave and somewhat out of plane, into triangles by clipping ears.

    Args:
        points: (N, 3) its corners in order, three or more.

    Returns:
        (N - 2, 3) numbers of corners, turning as the polygon does.
    """
    flat = _flattened(points)
    left = list(range(len(points)))
    triangles = []
    while len(left) > 3:
        k = _ear(flat[left])
        triangles.append((left[k - 1], left[k], left[(k + 1) % len(left)]))
        del left[k]
    return np.array([*triangles, tuple(left)], dtype=np.int64)


def quads_cut(vertices: NDArray[np.float64], quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cut quadrangles (Q, 4) along the diagonal that lies within each; (2 Q, 3)."""
    if not len(quads):
        return np.zeros((0, 3), dtype=np.int64)
    a, b, c, d = (vertices[quads[:, k]] for k in range(4))
    first = np.einsum("qi,qi->q", np.cross(b - a, c - a), np.cross(c - a, d - a)) >= 0
    cut = np.where(first[:, None], quads[:, [0, 1, 2, 0, 2, 3]], quads[:, [0, 1, 3, 1, 2, 3]])
    return cut.reshape(-1, 3)


def _flattened(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners (N, 2) in the polygon's mean plane, counterclockwise; its normal by Newell's sum."""
    ahead = np.roll(points, -1, axis=0)
    normal = np.cross(points - points[0], ahead - points[0]).sum(axis=0)
    length = float(np.linalg.norm(normal))
    normal = normal / length if length > 0 else np.array([0.0, 0.0, 1.0])
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    across /= np.linalg.norm(across)
    flat: NDArray[np.float64] = (points - points[0]) @ np.column_stack([across, np.cross(normal, across)])
    return flat


def _ear(corners: NDArray[np.float64]) -> int:
    """A corner of a polygon (N, 2) whose triangle holds no other; the most convex one where there is none."""
    before, after = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
    areas = _cross(corners - before, after - corners)
    for k in np.flatnonzero(areas > 0):
        a, b, c = before[k], corners[k], after[k]
        within = (
            (_cross(b - a, corners - a) >= 0) & (_cross(c - b, corners - b) >= 0) & (_cross(a - c, corners - c) >= 0)
        )
        within[[k - 1, k, (k + 1) % len(corners)]] = False
        if not within.any():
            return int(k)
    return int(np.argmax(areas))


def _cross(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    product: NDArray[np.float64] = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    return product
