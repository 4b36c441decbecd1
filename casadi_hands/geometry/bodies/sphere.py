"""A ball: its core is a point."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import numpy as np
from casadi import SX

from casadi_hands.geometry.bodies.body import Array, Body, Solid, Surface
from casadi_hands.geometry.core import Core


@dataclass(frozen=True)
class Point(Core):
    """A point (3,)."""

    at: SX

    def offset(self, point: SX) -> SX:
        """See `Core`."""
        return point - self.at

    def mapped(self, placed: Callable[[SX], SX]) -> Point:
        """See `Core`."""
        return Point(placed(self.at))

    def marks(self, up: SX) -> list[SX]:
        """See `Core`."""
        return [self.at]

    def lowest(self, up: SX) -> list[SX]:
        """See `Core`."""
        return [self.at]


@dataclass(frozen=True, eq=False)
class Sphere(Body):
    """A ball."""

    kind: ClassVar[str] = "sphere"
    width: ClassVar[int] = 4
    center: Array = field(metadata={"about": "Centre, m, object frame.", "is": "middle"})
    radius: float = field(metadata={"about": "Radius, m.", "is": "positive"})

    @property
    def ball(self) -> float:
        """See `Body`."""
        return self.radius

    @property
    def parameters(self) -> Array:
        """See `Body`: centre, radius."""
        return np.append(self.center, self.radius)

    @classmethod
    def surface(cls, parameters: SX) -> Surface:
        """See `Body`."""
        return Surface(Point(parameters[:3]), parameters[3])

    def core_point(self, point: Array) -> Array:
        """See `Body`."""
        return np.asarray(self.center)

    def support(self, direction: Array) -> Array:
        """See `Body`."""
        return np.asarray([self.center], float)

    @property
    def volume(self) -> float:
        """See `Body`."""
        return float(np.pi * self.radius**2 * (4 / 3 * self.radius))

    @property
    def centroid(self) -> Array:
        """See `Body`."""
        return np.asarray(self.center)

    @property
    def unit_inertia(self) -> Array:
        """See `Body`."""
        return np.asarray(2 / 5 * self.radius**2 * np.eye(3))

    def placed(self, rotation: Array, position: Array) -> Self:
        """See `Body`."""
        return replace(self, center=rotation @ self.center + position)

    def edges(self) -> list[tuple[Array, Array]]:
        """See `Body`."""
        return [(self.center, self.center)]

    def solids(self) -> tuple[Solid, ...]:
        """See `Body`."""
        return (Solid("sphere", self.center, self.center, self.radius),)

    @property
    def helper(self) -> Array:
        """See `Body`."""
        return np.array([1.0, 0.0, 0.0])
