"""Solid shapes as files state them, measured in closed form, by coal and for Drake.

To add a shape, add a class and, where an object may be made of it, how task files state it to `forms`. What a shape
does not say raises ``NotImplementedError``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
from scipy.spatial.transform import Rotation

_QUARTER = 1.01 * np.pi / 2
"""Of a sphere's radius: its mesh's edges before they are halved, and a little more, so that they are."""


class Shape(ABC):
    """A solid in its body's frame, m.

    Attributes:
        radius: with which its surface bends most, edges aside; infinite where all is flat.
    """

    radius: float

    def distance(self, point: np.ndarray) -> np.ndarray:
        """Return the (...,) signed distances of (..., 3) points to the surface, m; negative inside."""
        raise NotImplementedError(f"the distance of a point from a {type(self).__name__.lower()}")

    def normal(self, point: np.ndarray) -> np.ndarray:
        """Return the (..., 3) unit outward normals at the surface points nearest to (..., 3) points."""
        raise NotImplementedError(f"the normal of a {type(self).__name__.lower()}")

    def agrees(self, other: Shape) -> bool:
        """Whether another is the same solid, to a millionth of its size."""
        raise NotImplementedError(f"what a {type(self).__name__.lower()} is the same as")

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner (3,) of the bounding box, m."""
        raise NotImplementedError(f"the bounding box of a {type(self).__name__.lower()}")

    @property
    def depth(self) -> float:
        """How far its deepest point is below the surface, m."""
        raise NotImplementedError(f"the depth of a {type(self).__name__.lower()}")

    @property
    @abstractmethod
    def pose(self) -> tuple[np.ndarray, np.ndarray]:
        """Rotation (3, 3) and position (3,) of the frame in which coal and Drake know the shape, in the body's."""

    @abstractmethod
    def coal(self) -> coal.CollisionGeometry:
        """Return coal's shape."""

    def edge(self, off: float) -> float:
        """Return how long edges of triangles may be that leave the surface by so much at most, m."""
        raise NotImplementedError(f"the triangles of a {type(self).__name__.lower()}")

    @abstractmethod
    def drake(self, geometry: Any, edge: float = 0.0) -> Any:
        """Return Drake's shape.

        Args:
            geometry: Drake's module.
            edge: of its mesh's triangles, m. Drake's meshes have their corners on the surface, so they lie inside;
                grown for such edges, they lie about it.
        """


@dataclass(frozen=True, eq=False)
class _Round(Shape):
    """A solid of revolution about an axis from ``start`` to ``end`` (3,), with a ``radius``, all m, body frame."""

    start: np.ndarray
    end: np.ndarray
    radius: float

    @property
    def length(self) -> float:
        """Of the axis, m."""
        return float(np.linalg.norm(self.end - self.start))

    def agrees(self, other: Shape) -> bool:
        """See `Shape`: the axis either way around."""
        if not isinstance(other, _Round) or type(other) is not type(self):
            return False
        near = 1e-6 * max(self.radius, self.length)
        straight = np.linalg.norm(self.start - other.start) + np.linalg.norm(self.end - other.end)
        turned = np.linalg.norm(self.start - other.end) + np.linalg.norm(self.end - other.start)
        return bool(min(straight, turned) < near and abs(self.radius - other.radius) < near)

    @property
    def pose(self) -> tuple[np.ndarray, np.ndarray]:
        """See `Shape`: its z is the axis, its origin in the middle."""
        length, middle = self.length, 0.5 * (self.start + self.end)
        if length == 0.0:
            return np.eye(3), middle
        return Rotation.align_vectors([(self.end - self.start) / length], [[0.0, 0.0, 1.0]])[0].as_matrix(), middle


class Capsule(_Round):
    """All points within ``radius`` of the segment ``start``-``end``; a sphere is a capsule of no length."""

    def axis_point(self, point: np.ndarray) -> np.ndarray:
        """Return the (..., 3) points of the capsule's segment nearest to (..., 3) points, body frame."""
        direction = self.end - self.start
        square = float(direction @ direction)
        if square == 0.0:
            return np.broadcast_to(self.start, np.shape(point))
        along = np.clip((point - self.start) @ direction / square, 0.0, 1.0)
        nearest: np.ndarray = self.start + np.asarray(along)[..., None] * direction
        return nearest

    def distance(self, point: np.ndarray) -> np.ndarray:
        """See `Shape`."""
        distance: np.ndarray = np.linalg.norm(point - self.axis_point(point), axis=-1) - self.radius
        return distance

    def normal(self, point: np.ndarray) -> np.ndarray:
        """See `Shape`; zero on the axis."""
        outward = point - self.axis_point(point)
        unit: np.ndarray = outward / np.maximum(np.linalg.norm(outward, axis=-1, keepdims=True), 1e-300)
        return unit

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """See `Shape`."""
        return np.minimum(self.start, self.end) - self.radius, np.maximum(self.start, self.end) + self.radius

    def coal(self) -> coal.CollisionGeometry:
        """See `Shape`."""
        length = self.length
        return coal.Capsule(self.radius, length) if length else coal.Sphere(self.radius)

    @property
    def depth(self) -> float:
        """See `Shape`."""
        return self.radius

    def edge(self, off: float) -> float:
        """See `Shape`; a sphere's triangles are halved a number of times."""
        if self.length:
            return _chord(self.radius, off)
        halvings = max(round(np.log2(0.5 * self.radius / off) / 2), 2)
        return float(_QUARTER * self.radius / 2**halvings)

    def drake(self, geometry: Any, edge: float = 0.0) -> Any:
        """See `Shape`."""
        if self.length:
            return geometry.Capsule(_grown(self.radius, edge), self.length)
        return geometry.Sphere(self.radius * (1 + 0.5 * (edge / (_QUARTER * self.radius)) ** 2))


class Cylinder(_Round):
    """A solid cylinder with sharp edges; ``start`` and ``end`` are the centres of its flat faces."""

    def _beyond(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return how far (..., 2) points (..., 3) are beyond side and face, and the normals (..., 3) of both there."""
        middle, along = 0.5 * (self.start + self.end), (self.end - self.start) / self.length
        height = np.asarray((point - middle) @ along)
        out = point - middle - height[..., None] * along
        away = np.linalg.norm(out, axis=-1)
        side = out / np.maximum(away, 1e-300)[..., None]
        face = np.where(height >= 0, 1.0, -1.0)[..., None] * along
        return np.stack([away - self.radius, np.abs(height) - 0.5 * self.length], axis=-1), side, face

    def distance(self, point: np.ndarray) -> np.ndarray:
        """See `Shape`."""
        beyond, _, _ = self._beyond(point)
        outside, inside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1), np.minimum(beyond.max(axis=-1), 0.0)
        return np.asarray(outside + inside)

    def normal(self, point: np.ndarray) -> np.ndarray:
        """See `Shape`; beyond an edge, away from it; zero on the axis where the side is nearest."""
        beyond, side, face = self._beyond(point)
        nearer = beyond == beyond.max(axis=-1, keepdims=True)
        share = np.where(np.any(beyond > 0.0, axis=-1, keepdims=True), np.maximum(beyond, 0.0), nearer)
        share = share / np.linalg.norm(share, axis=-1, keepdims=True)
        normal: np.ndarray = share[..., :1] * side + share[..., 1:] * face
        return normal

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """See `Shape`."""
        along = (self.end - self.start) / self.length
        rim = self.radius * np.sqrt(np.maximum(1.0 - along**2, 0.0))
        return np.minimum(self.start, self.end) - rim, np.maximum(self.start, self.end) + rim

    def coal(self) -> coal.CollisionGeometry:
        """See `Shape`."""
        return coal.Cylinder(self.radius, self.length)

    @property
    def depth(self) -> float:
        """See `Shape`."""
        return min(self.radius, 0.5 * self.length)

    def edge(self, off: float) -> float:
        """See `Shape`."""
        return _chord(self.radius, off)

    def drake(self, geometry: Any, edge: float = 0.0) -> Any:
        """See `Shape`."""
        return geometry.Cylinder(_grown(self.radius, edge), self.length)


@dataclass(frozen=True, eq=False)
class HalfSpace(Shape):
    """All that is below z = ``height``, m."""

    height: float
    radius = float("inf")

    def distance(self, point: np.ndarray) -> np.ndarray:
        """See `Shape`."""
        return np.asarray(point[..., 2] - self.height)

    def normal(self, point: np.ndarray) -> np.ndarray:
        """See `Shape`."""
        return np.broadcast_to([0.0, 0.0, 1.0], np.shape(point))

    @property
    def pose(self) -> tuple[np.ndarray, np.ndarray]:
        """See `Shape`."""
        return np.eye(3), np.array([0.0, 0.0, self.height])

    def coal(self) -> coal.CollisionGeometry:
        """See `Shape`."""
        return coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)

    def drake(self, geometry: Any, edge: float = 0.0) -> Any:
        """See `Shape`."""
        return geometry.HalfSpace()


def _chord(radius: float, off: float) -> float:
    """Return how long a chord of a circle may be whose middle is off it by so much; there are eight at least."""
    return float(min(np.sqrt(8 * radius * off), np.pi / 4 * radius))


def _grown(radius: float, edge: float) -> float:
    """Return the radius with which a polygon of such edges lies about a circle, as far outside as inside."""
    return radius + edge**2 / (12 * radius)
