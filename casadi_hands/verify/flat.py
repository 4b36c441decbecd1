"""Solids with flat faces: boxes, of which servos' cases are, and polytopes."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import coal
import numpy as np
from scipy.spatial import ConvexHull

from casadi_hands.verify.shapes import Shape

_SIGNS = np.array(list(product((-1.0, 1.0), repeat=3)))
_ALIKE = 1e-6  # of its size: what is nearer is one


class Flat(Shape):
    """A solid that is the hull of its corners."""

    radius = float("inf")

    @property
    @abstractmethod
    def corners(self) -> np.ndarray:
        """Corners (V, 3), m, body frame."""

    @property
    def size(self) -> float:
        """Length of the bounding box's diagonal, m."""
        return float(np.linalg.norm(np.ptp(self.corners, axis=0)))

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """See `Shape`."""
        return self.corners.min(axis=0), self.corners.max(axis=0)

    def agrees(self, other: Shape) -> bool:
        """See `Shape`: the same corners, in any order."""
        if not isinstance(other, Flat) or len(other.corners) != len(self.corners):
            return False
        apart = np.linalg.norm(self.corners[:, None] - other.corners, axis=-1)
        return bool(max(apart.min(axis=0).max(), apart.min(axis=1).max()) < _ALIKE * self.size)

    def edge(self, off: float) -> float:
        """See `Shape`: its faces are flat."""
        return self.size


@dataclass(frozen=True, eq=False)
class Box(Flat):
    """A box in its body's frame.

    Attributes:
        sides: (3,) m.
        center: (3,) m.
        turn: (3, 3) the sides' directions by columns.
    """

    sides: np.ndarray
    center: np.ndarray
    turn: np.ndarray

    @property
    def corners(self) -> np.ndarray:
        """See `Flat`."""
        return np.asarray(self.center + (0.5 * _SIGNS * self.sides) @ self.turn.T)

    def _local(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return signs (..., 3) of points' coordinates, and how far they are beyond the faces (..., 3)."""
        local = (point - self.center) @ self.turn
        return np.where(local < 0.0, -1.0, 1.0), np.abs(local) - 0.5 * self.sides

    def distance(self, point: np.ndarray) -> np.ndarray:
        """See `Shape`."""
        _, beyond = self._local(point)
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
        return np.asarray(outside + np.minimum(beyond.max(axis=-1), 0.0))

    def normal(self, point: np.ndarray) -> np.ndarray:
        """See `Shape`; beyond an edge, away from it."""
        signs, beyond = self._local(point)
        nearest = beyond == beyond.max(axis=-1, keepdims=True)
        away = np.maximum(beyond, 0.0)
        far = np.linalg.norm(away, axis=-1, keepdims=True) > 1e-9 * self.size
        away = np.where(far, away, nearest)
        unit = signs * away / np.linalg.norm(away, axis=-1, keepdims=True)
        return np.asarray(unit @ self.turn.T)

    @property
    def depth(self) -> float:
        """See `Shape`."""
        return 0.5 * float(self.sides.min())

    @property
    def pose(self) -> tuple[np.ndarray, np.ndarray]:
        """See `Shape`: its axes and its middle."""
        return self.turn, self.center

    def coal(self) -> coal.CollisionGeometry:
        """See `Shape`."""
        return coal.Box(*map(float, self.sides))

    def drake(self, geometry: Any, edge: float = 0.0) -> Any:
        """See `Shape`."""
        return geometry.Box(*map(float, self.sides))


@dataclass(frozen=True, eq=False)
class Convex(Flat):
    """The hull of some points.

    Attributes:
        points: (P, 3) m, body frame, not all in one plane.
    """

    points: np.ndarray

    @cached_property
    def _hull(self) -> ConvexHull:
        return ConvexHull(self.points)

    @property
    def corners(self) -> np.ndarray:
        """See `Flat`."""
        return np.asarray(self.points[self._hull.vertices])

    def _beyond(self, point: np.ndarray) -> np.ndarray:
        """How far points (..., 3) are beyond the planes (..., T) of its triangles, m."""
        planes = self._hull.equations
        return np.asarray(point @ planes[:, :3].T + planes[:, 3])

    @cached_property
    def _sides(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Corners (T, 3, 3) of its triangles, vectors (T, 3, 3) to the next ones, and across these inwards, unit."""
        start = self.points[self._hull.simplices]
        along = np.roll(start, -1, axis=1) - start
        inward = np.cross(self._hull.equations[:, None, :3], along)
        third = np.einsum("tki,tki->tk", inward, np.roll(start, 1, axis=1) - start)
        return start, along, inward * np.sign(third)[..., None]

    def _nearest(self, point: np.ndarray) -> np.ndarray:
        """Return the points (N, 3) of the surface nearest to points (N, 3) outside."""
        planes, beyond = self._hull.equations[:, :3], self._beyond(point)
        start, along, inward = self._sides
        flat = point[:, None] - beyond[..., None] * planes
        inside = (np.einsum("ntki,tki->ntk", flat[:, :, None] - start, inward) >= 0.0).all(axis=-1)
        share = np.einsum("nti,tki->ntk", point[:, None], along) - np.einsum("tki,tki->tk", start, along)
        share = np.clip(share / np.einsum("tki,tki->tk", along, along), 0.0, 1.0)
        side = start + share[..., None] * along
        nearest = np.linalg.norm(side - point[:, None, None], axis=-1).argmin(axis=-1)
        edge = np.take_along_axis(side, nearest[..., None, None], axis=2)[:, :, 0]
        found = np.where(inside[..., None], flat, edge)
        best = np.linalg.norm(found - point[:, None], axis=-1).argmin(axis=-1)
        return np.asarray(found[np.arange(len(point)), best])

    def distance(self, point: np.ndarray) -> np.ndarray:
        """See `Shape`."""
        flat = np.reshape(point, (-1, 3))
        distance = self._beyond(flat).max(axis=-1)
        outside = distance > 0.0
        distance[outside] = np.linalg.norm(flat[outside] - self._nearest(flat[outside]), axis=-1)
        return np.asarray(distance.reshape(np.shape(point)[:-1]))

    def normal(self, point: np.ndarray) -> np.ndarray:
        """See `Shape`; beyond an edge, away from it."""
        flat = np.reshape(point, (-1, 3))
        beyond = self._beyond(flat)
        normal = self._hull.equations[beyond.argmax(axis=-1), :3].copy()
        outside = beyond.max(axis=-1) > 1e-9 * self.size
        away = flat[outside] - self._nearest(flat[outside])
        normal[outside] = away / np.linalg.norm(away, axis=-1, keepdims=True)
        return np.asarray(normal.reshape(np.shape(point)))

    @property
    def depth(self) -> float:
        """See `Shape`: of the middle of its corners."""
        return -float(self._beyond(self.corners.mean(axis=0)).max())

    @property
    def pose(self) -> tuple[np.ndarray, np.ndarray]:
        """See `Shape`: the body's own frame."""
        return np.eye(3), np.zeros(3)

    def coal(self) -> coal.CollisionGeometry:
        """See `Shape`."""
        points = coal.StdVec_Vec3s()
        points.extend(list(np.asarray(self.points, float)))
        return coal.Convex.convexHull(points, True, "Qt")

    def drake(self, geometry: Any, edge: float = 0.0) -> Any:
        """See `Shape`."""
        return geometry.Convex(np.asarray(self.corners, float).T, "hull")
