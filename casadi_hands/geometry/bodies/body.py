"""What a body is: a convex core swept by a ball, in numbers and in symbols.

To add a shape, add a module with one class to this folder: it is found by itself, and so is its place in task files.
A class that leaves something out cannot be made: Python's ``TypeError`` names what is missing.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar, Literal

import numpy as np
from casadi import SX
from numpy.typing import NDArray

from casadi_hands.geometry.core import Core

Array = NDArray[np.float64]
TILT = 3e-3
"""Angle, rad, between a body's normal and that of a sharp face, within which these agree."""


@dataclass(frozen=True)
class Solid:
    """A primitive that URDF, MJCF and the page know.

    Attributes:
        kind: ``sphere``, ``cylinder``, ``capsule``, ``box`` or ``convex``.
        start: (3,) one end of its axis, body frame; the centre of a sphere or box.
        end: (3,) the other end.
        radius: of it; of a box or what is convex 0.
        size: (3,) of a box, its sides.
        turn: (3, 3) of a box, its axes by columns.
        vertices: (V, 3) of what is convex, body frame.
        triangles: (T, 3) of their numbers, counterclockwise seen from outside.
    """

    kind: Literal["sphere", "cylinder", "capsule", "box", "convex"]
    start: Array
    end: Array
    radius: float = 0.0
    size: Array = field(default_factory=lambda: np.zeros(3))
    turn: Array = field(default_factory=lambda: np.eye(3))
    vertices: Array = field(default_factory=lambda: np.zeros((0, 3)))
    triangles: NDArray[np.int_] = field(default_factory=lambda: np.zeros((0, 3), int))


@dataclass(frozen=True)
class Surface:
    """A body in symbols: a core and the radius of the ball that sweeps it."""

    core: Core
    radius: SX

    def mapped(self, placed: Callable[[SX], SX]) -> Surface:
        """The body in another frame, of a rigid motion that takes each point (3,) there."""
        return Surface(self.core.mapped(placed), self.radius)

    def distance_and_normal(self, point: SX, rounding: float = 1e-9) -> tuple[SX, SX]:
        """Signed distance of a point (3,), negative inside, and the outward unit normal (3,) nearest to it."""
        distance, normal = self.core.distance_and_normal(point, rounding)
        return distance - self.radius, normal

    def project(self, point: SX) -> tuple[SX, SX]:
        """The nearest point (3,) of the surface and the outward unit normal there (3,)."""
        distance, normal = self.core.distance_and_normal(point, 1e-9)
        return point + (self.radius - distance) * normal, normal


@dataclass(frozen=True, eq=False)
class Body(ABC):
    """A body in numbers: lengths in any unit, in its object's frame.

    Attributes:
        kind: its name in task files.
        width: number of parameters it packs into.
        face_bounds: the most half-spaces that keep a point off the edges of a face; 0 of a body that has none.
    """

    kind: ClassVar[str]
    width: ClassVar[int]
    face_bounds: ClassVar[int] = 0

    @property
    @abstractmethod
    def ball(self) -> float:
        """Radius of the ball that sweeps the core."""

    @property
    @abstractmethod
    def parameters(self) -> Array:
        """(width,) all that it is, as a kernel's parameters."""

    def measured(self, change: Callable[[Array], Array]) -> Body:
        """The body whose lengths are what a function, which takes arrays of them, makes of its own."""
        made = {}
        for each in fields(self):
            value = getattr(self, each.name)
            if each.metadata["is"] != "rotation":
                value = change(np.asarray(value, float))
            made[each.name] = float(value) if each.metadata["is"] == "positive" else value
        return replace(self, **made)

    @classmethod
    @abstractmethod
    def surface(cls, parameters: SX) -> Surface:
        """The body of some parameters (width,) in symbols."""

    @abstractmethod
    def core_point(self, point: Array) -> Array:
        """The point (3,) of the core nearest to a point (3,); nothing is rounded."""

    def core_offset(self, point: Array) -> Array:
        """The vector (3,) to a point from the core's nearest one; nothing is rounded."""
        return point - self.core_point(point)

    @abstractmethod
    def support(self, direction: Array) -> Array:
        """(K, 3) points of the core farthest in a direction (3,): corners of where all are equally far."""

    @property
    @abstractmethod
    def volume(self) -> float:
        """Of the solid."""

    @property
    @abstractmethod
    def centroid(self) -> Array:
        """Centre (3,) of the solid."""

    @property
    @abstractmethod
    def unit_inertia(self) -> Array:
        """Inertia (3, 3) of the solid with a mass of one about its centroid."""

    @abstractmethod
    def placed(self, rotation: Array, position: Array) -> Body:
        """The same body turned by a rotation (3, 3), then shifted by (3,)."""

    @abstractmethod
    def edges(self) -> list[tuple[Array, Array]]:
        """Segments of the core, end to end (3,) each, among which its point nearest to a disc is."""

    @abstractmethod
    def solids(self) -> tuple[Solid, ...]:
        """What draws it."""

    @property
    @abstractmethod
    def helper(self) -> Array:
        """A direction (3,) across which tangents are well defined over most of the surface."""

    def impossible(self) -> str:
        """What is allowed instead, where no body is as these fields say; else empty."""
        return ""

    def face(self, point: Array) -> tuple[Array, Array]:
        """Where a contact that is on a point's face stays off its edges: outward normals (M, 3) and offsets (M,).

        There normal · p is at most the offset; in the body's units and its object's frame; M is at most `face_bounds`.
        On rounded edges the surface has other normals than that of the files, which is sharp.

        Args:
            point: (3,) on the surface.
        """
        return np.zeros((0, 3)), np.zeros(0)

    def as_mapping(self) -> dict[str, Any]:
        """Its fields by their names in task files."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def has_normal(self, point: Array) -> bool:
        """Whether one side of the surface is nearest to a point (3,), so that it has a normal there."""
        return float(np.linalg.norm(self.core_offset(point))) >= 1e-6 * self.ball

    def outward(self, point: Array) -> Array:
        """Unit normal (3,), outward, at the surface nearest to a point (3,); zero on the core."""
        away = self.core_offset(point)
        return np.asarray(away / max(float(np.linalg.norm(away)), 1e-9))

    def signed_distance(self, point: Array) -> float:
        """Distance of a point (3,) from the surface, negative inside."""
        return float(np.linalg.norm(self.core_offset(point))) - self.ball

    def on_surface(self, point: Array) -> Array:
        """A point (3,) moved along its normal onto the surface."""
        return np.asarray(self.core_point(point) + self.ball * self.outward(point))

    @property
    def bounding_box(self) -> tuple[Array, Array]:
        """Lower and upper corner, (3,) and (3,)."""
        most = [np.array([self.support(sign * e)[0] @ e for e in np.eye(3)]) + sign * self.ball for sign in (-1, 1)]
        return most[0], most[1]


def edge_metadata(default: Callable[[Mapping[str, Any]], float], text: str, edges: str = "the edges") -> dict[str, Any]:
    """Of the field with the radius of a body's rounded edges.

    Args:
        default: of other fields, as a task file gives them, the radius where none is given, m.
        text: what that is, in words.
        edges: which have the radius.
    """
    about = f"Radius of {edges}, m, as the motion sees them; files have them sharp."
    return {"about": about, "is": "positive", "default": default, "default_text": text}


def farthest(points: Array, direction: Array, size: float) -> Array:
    """Those of points (N, 3) that are farthest in a direction (3,), to the rounding of lengths of a size."""
    heights = points @ direction
    return np.asarray(points[heights >= heights.max() - 1e-9 * size])


def surfaces(kinds: tuple[type[Body], ...], parameters: SX) -> list[Surface]:
    """Bodies in symbols, of their parameters in one column."""
    ends = np.cumsum([0, *[kind.width for kind in kinds]]).tolist()
    return [kind.surface(parameters[a:b]) for kind, a, b in zip(kinds, ends, ends[1:], strict=False)]


def width_of(kinds: tuple[type[Body], ...]) -> int:
    """Number of parameters of several bodies."""
    return sum(kind.width for kind in kinds)


def packed(bodies: Sequence[Body]) -> Array:
    """Parameters of several bodies in one row."""
    return np.concatenate([body.parameters for body in bodies])
