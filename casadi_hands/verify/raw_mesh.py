"""What an object looks like where it is of a mesh: triangles, and how far fingers are from them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np

_THIN = 1e-7  # m: of what is moved about to measure from


@dataclass(frozen=True, eq=False)
class RawMesh:
    """Triangles in the object's frame.

    Attributes:
        vertices: (V, 3) m.
        faces: (F, 3) numbers of vertices.
    """

    vertices: np.ndarray
    faces: np.ndarray

    @cached_property
    def _tree(self) -> coal.BVHModelOBBRSS:
        tree = coal.BVHModelOBBRSS()
        tree.beginModel(len(self.faces), len(self.vertices))
        vertices, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        vertices.extend([np.array(vertex) for vertex in self.vertices])
        triangles.extend([coal.Triangle(*(int(k) for k in face)) for face in self.faces])
        tree.addSubModel(vertices, triangles)
        tree.endModel()
        return tree

    def distance(self, start: np.ndarray, end: np.ndarray) -> float:
        """Return the distance of the nearest triangle from a segment (3,) to (3,), or from a point, m, object frame."""
        along, middle = end - start, 0.5 * (start + end)
        length = float(np.linalg.norm(along))
        if length < _THIN:
            probe, turn = coal.Sphere(_THIN), np.eye(3)
        else:
            probe, turn = coal.Capsule(_THIN, length), _frame(along / length)
        still, placed = coal.Transform3s.Identity(), coal.Transform3s(turn, middle)
        found = coal.distance(self._tree, still, probe, placed, coal.DistanceRequest(), coal.DistanceResult())
        return max(float(found) + _THIN, 0.0)

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Return which of points (N, 3) are inside, (N,): those about which its triangles wind.

        By the solid angles that triangles span (van Oosterom and Strackee, 1983).
        """
        inside = np.zeros(len(points), bool)
        for k, point in enumerate(points):
            a, b, c = (self.vertices[self.faces[:, i]] - point for i in range(3))
            la, lb, lc = (np.linalg.norm(each, axis=1) for each in (a, b, c))
            triple = np.einsum("fi,fi->f", a, np.cross(b, c))
            ab, bc, ca = (np.einsum("fi,fi->f", x, y) for x, y in ((a, b), (b, c), (c, a)))
            angles = 2 * np.arctan2(triple, la * lb * lc + ab * lc + bc * la + ca * lb)
            inside[k] = abs(float(angles.sum())) > 2 * np.pi
        return inside


def _frame(axis: np.ndarray) -> np.ndarray:
    """Return a rotation (3, 3) whose third column is a unit axis (3,)."""
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(axis, first), axis])
