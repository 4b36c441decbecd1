"""Convex hulls, with as few vertices as a part can do with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from casadi_hands.errors import MeshError
from casadi_hands.geometry.hull import turned_outward
from casadi_hands.meshes.mesh import Mesh

MOST_VERTICES = 32


def hull(points: NDArray[np.float64]) -> Mesh:
    """Convex hull of points (N, 3): its vertices in the order of the points, and triangles that look outward.

    Raises:
        MeshError: the points lie in a plane.
    """
    found = _hull(points)
    kept = np.sort(found.vertices)
    number = np.zeros(len(points), dtype=np.int64)
    number[kept] = np.arange(len(kept))
    faces = turned_outward(number[found.simplices], points[kept], found.equations[:, :3])
    faces = np.array([np.roll(face, -int(face.argmin())) for face in faces])
    return Mesh(points[kept], faces[np.lexsort(faces.T[::-1])])


def reduced(points: NDArray[np.float64], tolerance: float, most: int = MOST_VERTICES) -> tuple[Mesh, float]:
    """A hull of some of the points that leaves none of the others out by more than a tolerance, or has `most` vertices.

    The farthest point outside is added until none is too far; what results lies within the hull of all.

    Args:
        points: (N, 3).
        tolerance: in the points' unit.
        most: vertices.

    Returns:
        The hull, and how far outside of its planes the farthest point is: the most by which it is too small.

    Raises:
        MeshError: the points lie in a plane.
    """
    corners = points[np.sort(_hull(points).vertices)]
    chosen = _first(corners)
    while True:
        beyond = _beyond(corners[chosen], corners)
        farthest = int(beyond.argmax())
        if beyond[farthest] <= tolerance or len(chosen) >= min(most, len(corners)):
            return hull(corners[chosen]), float(max(beyond[farthest], 0.0))
        chosen.append(farthest)


def _beyond(inner: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far points (N, 3) are outside the planes of the hull of others (N,); zero for what spans it."""
    planes = _hull(inner).equations
    most: NDArray[np.float64] = (points @ planes[:, :3].T + planes[:, 3]).max(axis=1)
    return np.where(most < 1e-12 * np.abs(points).max(), 0.0, most)


def _first(corners: NDArray[np.float64]) -> list[int]:
    """Four corners that span a volume: the two ends of the longest axis, then the farthest from line and plane."""
    axis = int(np.ptp(corners, axis=0).argmax())
    one, two = int(corners[:, axis].argmin()), int(corners[:, axis].argmax())
    along = (corners[two] - corners[one]) / np.linalg.norm(corners[two] - corners[one])
    arms = corners - corners[one]
    three = int(np.linalg.norm(arms - np.outer(arms @ along, along), axis=1).argmax())
    four = int(np.abs(arms @ np.cross(along, arms[three])).argmax())
    return [one, two, three, four]


def _hull(points: NDArray[np.float64]) -> ConvexHull:
    try:
        return ConvexHull(points)
    except (ValueError, RuntimeError):  # Qhull's own error is a RuntimeError
        raise MeshError("points that lie in a plane", "a solid with a volume") from None
