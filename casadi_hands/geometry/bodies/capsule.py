"""A capsule: its core is a segment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import casadi as ca
import numpy as np
from casadi import SX

from casadi_hands.geometry.bodies.body import Array, Body, Solid, Surface, farthest
from casadi_hands.geometry.core import Core
from casadi_hands.geometry.smooth import norm

# The normal turns a corner where cap and cylinder meet, and contacts like to sit there: an optimiser jams on it. The
# rounding, a share of the segment's length, moves the surface by less than 1e-5 of that length.
_KINK = 1e-3


@dataclass(frozen=True)
class Segment(Core):
    """A segment between two ends (3,); they may coincide."""

    start: SX
    end: SX

    def nearest(self, point: SX) -> SX:
        """The point (3,) of the segment nearest to ``point``, smooth at the ends."""
        along = self.end - self.start
        fraction = ca.dot(point - self.start, along) / (ca.sumsqr(along) + 1e-12)
        rounded = (norm(fraction, _KINK) - norm(fraction - 1, _KINK) + 1) / 2
        return self.start + rounded * along

    def offset(self, point: SX) -> SX:
        """See `Core`."""
        return point - self.nearest(point)

    def mapped(self, placed: Callable[[SX], SX]) -> Segment:
        """See `Core`."""
        return Segment(placed(self.start), placed(self.end))

    def marks(self, up: SX) -> list[SX]:
        """See `Core`: both ends and the middle."""
        return [self.start, (self.start + self.end) / 2, self.end]

    def lowest(self, up: SX) -> list[SX]:
        """See `Core`: both ends."""
        return [self.start, self.end]


@dataclass(frozen=True, eq=False)
class Capsule(Body):
    """A cylinder with half a sphere at each end."""

    kind: ClassVar[str] = "capsule"
    width: ClassVar[int] = 7
    start: Array = field(metadata={"about": "One end of the axis, m, object frame.", "is": "point"})
    end: Array = field(metadata={"about": "The other end, m, object frame; equal ends make a sphere.", "is": "point"})
    radius: float = field(metadata={"about": "Radius, m.", "is": "positive"})

    @property
    def ball(self) -> float:
        """See `Body`."""
        return self.radius

    @property
    def parameters(self) -> Array:
        """See `Body`: start, end, radius."""
        return np.array([*self.start, *self.end, self.radius])

    @classmethod
    def surface(cls, parameters: SX) -> Surface:
        """See `Body`."""
        return Surface(Segment(parameters[:3], parameters[3:6]), parameters[6])

    def core_point(self, point: Array) -> Array:
        """See `Body`."""
        start, reach = self._along(point)
        return start + reach

    def core_offset(self, point: Array) -> Array:
        """See `Body`."""
        start, reach = self._along(point)
        return point - start - reach

    def _along(self, point: Array) -> tuple[Array, Array]:
        """The first end, and how far from there the nearest point of the axis is, (3,) each."""
        start, along = np.asarray(self.start), np.asarray(self.end) - self.start
        squared = float(along @ along)
        share = np.clip((point - start) @ along / squared, 0, 1) if squared else 0.0
        return start, np.asarray(share * along)

    def support(self, direction: Array) -> Array:
        """See `Body`: one end, or both where the axis is across the direction."""
        return farthest(np.array([self.start, self.end]), direction, self._size)

    @property
    def _length(self) -> float:
        return float(np.linalg.norm(np.subtract(self.end, self.start)))

    @property
    def _size(self) -> float:
        return self._length / 2 + self.radius

    @property
    def volume(self) -> float:
        """See `Body`."""
        return float(np.pi * self.radius**2 * (self._length + 4 / 3 * self.radius))

    @property
    def centroid(self) -> Array:
        """See `Body`."""
        return np.asarray((np.asarray(self.start) + self.end) / 2)

    @property
    def unit_inertia(self) -> Array:
        """See `Body`."""
        radius, length = self.radius, self._length
        cylinder = length / (length + 4 / 3 * radius)
        caps = 1 - cylinder
        along = cylinder * radius**2 / 2 + caps * 2 / 5 * radius**2
        # Each half sphere has its centre of mass 3/8 r beyond the end of the axis.
        across = cylinder * (radius**2 / 4 + length**2 / 12)
        across += caps * (2 / 5 * radius**2 + length**2 / 4 + 3 / 8 * radius * length)
        if length == 0:
            return np.asarray(across * np.eye(3))
        axis = np.subtract(self.end, self.start) / length
        return np.asarray(across * np.eye(3) + (along - across) * np.outer(axis, axis))

    def placed(self, rotation: Array, position: Array) -> Self:
        """See `Body`."""
        return replace(self, start=rotation @ self.start + position, end=rotation @ self.end + position)

    def edges(self) -> list[tuple[Array, Array]]:
        """See `Body`."""
        return [(self.start, self.end)]

    def solids(self) -> tuple[Solid, ...]:
        """See `Body`."""
        if self._length == 0:
            return (Solid("sphere", self.start, self.start, self.radius),)
        return (Solid("capsule", self.start, self.end, self.radius),)

    @property
    def helper(self) -> Array:
        """See `Body`: the axis."""
        length = self._length
        return np.asarray(np.subtract(self.end, self.start) / length) if length > 1e-9 else np.eye(3)[0]
