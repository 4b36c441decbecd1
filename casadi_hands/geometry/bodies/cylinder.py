"""A cylinder: its core is a cylinder, too, smaller by the radius of its rounded edges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Self

import casadi as ca
import numpy as np
from casadi import SX

from casadi_hands.geometry.bodies.body import TILT, Array, Body, Solid, Surface, edge_metadata, farthest
from casadi_hands.geometry.core import Core
from casadi_hands.geometry.smooth import norm

_KINK = 1e-3  # rounding of corners, a share of the length along the axis and lengths across it
_SPOKES = 12  # lines that stand for the side and the faces where a disc is near
_FACE_SIDES = 8  # of the polygon within a face where contacts stay off its rim


@dataclass(frozen=True)
class Drum(Core):
    """A solid cylinder about the segment between the middles of its faces, (3,) each, of some radius."""

    start: SX
    end: SX
    radius: SX

    def _parts(self, point: SX) -> tuple[SX, SX, SX, SX]:
        """Share of the axis that a point is at, the axis (3,), the vector across it (3,), and its length."""
        along = self.end - self.start
        share = ca.dot(point - self.start, along) / (ca.sumsqr(along) + 1e-12)
        across = point - self.start - share * along
        return share, along, across, norm(across, _KINK)

    def offset(self, point: SX) -> SX:
        """See `Core`; it does not vanish inside, where it leads to the nearest face."""
        share, along, across, far = self._parts(point)
        rounded = (norm(share, _KINK) - norm(share - 1, _KINK) + 1) / 2
        beyond = far - self.radius
        return (share - rounded) * along + (beyond + norm(beyond, _KINK)) / 2 / far * across

    def depth(self, point: SX) -> SX:
        """See `Core`."""
        share, along, _, far = self._parts(point)
        outside = ca.fmax(ca.fmax(-share, share - 1) * norm(along), far - self.radius)
        return ca.fmax(-outside, 0)

    def marks(self, up: SX) -> list[SX]:
        """See `Core`: of both faces and between them the middle and the lowest point."""
        middle, low = (self.start + self.end) / 2, self._low(up)
        return [p + by for p in (self.start, middle, self.end) for by in (low, SX.zeros(3, 1))]

    def lowest(self, up: SX) -> list[SX]:
        """See `Core`: the lowest of each rim."""
        return [self.start + self._low(up), self.end + self._low(up)]

    def _low(self, up: SX) -> SX:
        """From the middle of a face to where its rim is lowest (3,); to its middle where all of it is."""
        along = self.end - self.start
        across = up - ca.dot(up, along) / (ca.sumsqr(along) + 1e-12) * along
        return -self.radius * across / norm(across, _KINK)


def _edge(data: Mapping[str, Any]) -> float:
    """A twentieth of what is smaller of the radius and half the length."""
    half = float(np.linalg.norm(np.subtract(data["end"], data["start"]))) / 2
    return min(float(data["radius"]), half) / 20


@dataclass(frozen=True, eq=False)
class Cylinder(Body):
    """A cylinder with rounded edges."""

    kind: ClassVar[str] = "cylinder"
    width: ClassVar[int] = 8
    face_bounds: ClassVar[int] = _FACE_SIDES
    start: Array = field(metadata={"about": "Middle of one face, m, object frame.", "is": "point"})
    end: Array = field(metadata={"about": "Middle of the other face, m, object frame.", "is": "point"})
    radius: float = field(metadata={"about": "Radius, m.", "is": "positive"})
    edge_radius: float = field(
        metadata=edge_metadata(_edge, "a twentieth of the radius or of half the length, whichever is smaller")
    )

    def impossible(self) -> str:
        """See `Body`."""
        if self._length == 0:
            return "two faces apart from each other"
        if self.edge_radius >= min(self.radius, self._length / 2):
            return "an edge_radius smaller than the radius and half the length"
        return ""

    @property
    def ball(self) -> float:
        """See `Body`."""
        return self.edge_radius

    @property
    def parameters(self) -> Array:
        """See `Body`: start, end, radius, edge radius."""
        return np.array([*self.start, *self.end, self.radius, self.edge_radius])

    @classmethod
    def surface(cls, parameters: SX) -> Surface:
        """See `Body`."""
        start, end, edge = parameters[:3], parameters[3:6], parameters[7]
        inward = edge * (end - start) / norm(end - start)
        return Surface(Drum(start + inward, end - inward, parameters[6] - edge), edge)

    @property
    def _length(self) -> float:
        return float(np.linalg.norm(np.subtract(self.end, self.start)))

    @property
    def helper(self) -> Array:
        """See `Body`: the axis."""
        return np.asarray(np.subtract(self.end, self.start) / self._length)

    def _outside(self, point: Array) -> tuple[float, float, Array]:
        """How far a point is beyond the core's nearer face, and beyond its side; and the direction across the axis."""
        axis, middle = self.helper, self.centroid
        height = float((point - middle) @ axis)
        across = point - middle - height * axis
        far = float(np.linalg.norm(across))
        beyond = abs(height) - self._length / 2 + self.edge_radius, far - self.radius + self.edge_radius
        return *beyond, across / far if far > 0 else np.zeros(3)

    def core_point(self, point: Array) -> Array:
        """See `Body`."""
        above, beyond, across = self._outside(point)
        sign = np.sign((point - self.centroid) @ self.helper)
        return np.asarray(point - max(above, 0) * sign * self.helper - max(beyond, 0) * across)

    def has_normal(self, point: Array) -> bool:
        """See `Body`."""
        above, beyond, _ = self._outside(point)
        # From there both faces are as near, or the side all around.
        middle = self._length / 2 - self.edge_radius if above > beyond else self.radius - self.edge_radius
        off = min(abs(above - beyond), max(above, beyond) + middle)
        return max(above, beyond) > 0 or off > 1e-6 * self.radius

    def outward(self, point: Array) -> Array:
        """See `Body`; within the core, out of its nearest face."""
        above, beyond, across = self._outside(point)
        if max(above, beyond) > 0:
            return super().outward(point)
        sign = np.sign((point - self.centroid) @ self.helper)
        return np.asarray(sign * self.helper if above > beyond else across)

    def signed_distance(self, point: Array) -> float:
        """See `Body`."""
        above, beyond, _ = self._outside(point)
        return super().signed_distance(point) + min(max(above, beyond), 0.0)

    def on_surface(self, point: Array) -> Array:
        """See `Body`."""
        return np.asarray(point - self.signed_distance(point) * self.outward(point))

    def face(self, point: Array) -> tuple[Array, Array]:
        """See `Body`; beyond the rounded edge, what rounds the core's rim has to be far."""
        above, beyond, _ = self._outside(point)
        rounded = _KINK**2 / (4 * TILT * self.edge_radius)
        if beyond >= above:
            reach = self._length / 2 - self.edge_radius - rounded * self._length**2
            normals = np.array([self.helper, -self.helper])
        else:
            reach = (self.radius - self.edge_radius - rounded) * np.cos(np.pi / _FACE_SIDES)
            normals = self._across(_FACE_SIDES)
        return normals, reach + normals @ self.centroid

    def support(self, direction: Array) -> Array:
        """See `Body`: of a rim that is level its middle."""
        inward, axis = self.edge_radius * self.helper, self.helper
        ends = np.array([self.start + inward, self.end - inward])
        across = direction - (direction @ axis) * axis
        far = float(np.linalg.norm(across))
        rim = (self.radius - self.edge_radius) * across / far if far > 1e-9 else np.zeros(3)
        return farthest(ends, direction, self._length) + rim

    @property
    def volume(self) -> float:
        """See `Body`; the rounding of the edges is left out."""
        return float(np.pi * self.radius**2 * self._length)

    @property
    def centroid(self) -> Array:
        """See `Body`."""
        return np.asarray((np.asarray(self.start) + self.end) / 2)

    @property
    def unit_inertia(self) -> Array:
        """See `Body`."""
        along, across = self.radius**2 / 2, self.radius**2 / 4 + self._length**2 / 12
        return np.asarray(across * np.eye(3) + (along - across) * np.outer(self.helper, self.helper))

    def placed(self, rotation: Array, position: Array) -> Self:
        """See `Body`."""
        return replace(self, start=rotation @ self.start + position, end=rotation @ self.end + position)

    def edges(self) -> list[tuple[Array, Array]]:
        """See `Body`: lines of the side, and across the faces."""
        inward = self.edge_radius * self.helper
        rims = (self.radius - self.edge_radius) * self._across(_SPOKES)
        start, end = self.start + inward, self.end - inward
        across = [(face + rim, face - rim) for face in (start, end) for rim in rims[: _SPOKES // 2]]
        return [(start + rim, end + rim) for rim in rims] + across

    def _across(self, count: int) -> Array:
        """Directions (count, 3) across the axis, evenly all around it."""
        axis = self.helper
        first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        first /= np.linalg.norm(first)
        angles = np.linspace(0, 2 * np.pi, count, endpoint=False)[:, None]
        return np.asarray(np.cos(angles) * first + np.sin(angles) * np.cross(axis, first))

    def solids(self) -> tuple[Solid, ...]:
        """See `Body`."""
        return (Solid("cylinder", self.start, self.end, self.radius),)
