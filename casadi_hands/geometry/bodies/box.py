"""A box: its core is a box, too, smaller by the radius of its rounded edges."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Self

import casadi as ca
import numpy as np
from casadi import SX
from scipy.spatial.transform import Rotation

from casadi_hands.geometry.bodies.body import TILT, Array, Body, Solid, Surface, edge_metadata, farthest
from casadi_hands.geometry.core import Core
from casadi_hands.geometry.smooth import norm

_KINK = 1e-3  # rounding of corners, a share of the half sides, and lengths
_CORNERS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


@dataclass(frozen=True)
class Block(Core):
    """A solid box about a centre (3,), with the vectors from there to the middles of three faces, columns of (3, 3)."""

    center: SX
    sides: SX

    @property
    def arms(self) -> list[SX]:
        """Its vectors (3,) to the middles of faces."""
        return list(ca.horzsplit(self.sides))

    def _shares(self, point: SX) -> list[SX]:
        """How far a point is along each arm, one at its end."""
        return [ca.dot(point - self.center, arm) / (ca.sumsqr(arm) + 1e-12) for arm in self.arms]

    def offset(self, point: SX) -> SX:
        """See `Core`; it does not vanish inside, where it leads to the nearest face."""
        made = SX.zeros(3, 1)
        for share, arm in zip(self._shares(point), self.arms, strict=True):
            made += (share - (norm(share + 1, _KINK) - norm(share - 1, _KINK)) / 2) * arm
        return made

    def depth(self, point: SX) -> SX:
        """See `Core`."""
        outside = SX(-np.inf)
        for share, arm in zip(self._shares(point), self.arms, strict=True):
            outside = ca.fmax(outside, (ca.fabs(share) - 1) * norm(arm))
        return ca.fmax(-outside, 0)

    def marks(self, up: SX) -> list[SX]:
        """See `Core`: the corners, and what is lowest."""
        corners = [
            self.center + sum((s * a for s, a in zip(signs, self.arms, strict=True)), SX(0)) for signs in _CORNERS
        ]
        return [*corners, *self.lowest(up)]

    def lowest(self, up: SX) -> list[SX]:
        """See `Core`: a corner; the middle of an edge or a face that is level."""
        heights = [ca.dot(up, arm) for arm in self.arms]
        return [self.center - sum((h / norm(h, _KINK) * a for h, a in zip(heights, self.arms, strict=True)), SX(0))]


def _vector(turn: Array) -> Array:
    """Rotation vector (3,) of a rotation (3, 3), rad."""
    return np.asarray(Rotation.from_matrix(turn).as_rotvec())


def _edge(data: Mapping[str, Any]) -> float:
    """A fortieth of half the shortest side."""
    return float(min(data["size"])) / 80


@dataclass(frozen=True, eq=False)
class Box(Body):
    """A box with rounded edges."""

    kind: ClassVar[str] = "box"
    width: ClassVar[int] = 13
    face_bounds: ClassVar[int] = 4
    center: Array = field(metadata={"about": "Middle, m, object frame.", "is": "middle"})
    size: Array = field(
        metadata={"about": "Lengths of the sides along x, y and z before it is turned, m.", "is": "sizes"}
    )
    rotation: Array = field(
        metadata={
            "about": "How it is turned about its middle: a turn in the object frame, as those of goals are given.",
            "is": "rotation",
        }
    )
    edge_radius: float = field(metadata=edge_metadata(_edge, "a fortieth of half the shortest side"))

    def impossible(self) -> str:
        """See `Body`."""
        if self.edge_radius >= min(self.size) / 2:
            return "an edge_radius smaller than half the shortest side"
        return ""

    @property
    def ball(self) -> float:
        """See `Body`."""
        return self.edge_radius

    @property
    def turn(self) -> Array:
        """Its axes (3, 3) by columns."""
        return np.asarray(Rotation.from_rotvec(self.rotation).as_matrix())

    @property
    def _half(self) -> Array:
        return np.asarray(self.size) / 2

    @property
    def parameters(self) -> Array:
        """See `Body`: the centre, the vectors to the middles of three faces, the edge radius."""
        return np.concatenate([self.center, (self.turn * self._half).T.ravel(), [self.edge_radius]])

    @classmethod
    def surface(cls, parameters: SX) -> Surface:
        """See `Body`."""
        edge = parameters[12]
        arms = [parameters[3 + 3 * k : 6 + 3 * k] for k in range(3)]
        inner = [arm - edge * arm / norm(arm) for arm in arms]
        return Surface(Block(parameters[:3], ca.horzcat(*inner)), edge)

    @property
    def helper(self) -> Array:
        """See `Body`: towards a corner of a cube, across no face."""
        return np.asarray(self.turn.sum(axis=1) / np.sqrt(3))

    def _local(self, point: Array) -> tuple[Array, Array]:
        """Signs (3,) of a point's coordinates in the box's frame, and how far (3,) it is beyond the core's faces."""
        local = self.turn.T @ (point - self.center)
        return np.where(local < 0, -1.0, 1.0), np.abs(local) - self._half + self.edge_radius

    def core_point(self, point: Array) -> Array:
        """See `Body`."""
        signs, beyond = self._local(point)
        return np.asarray(point - self.turn @ (signs * np.maximum(beyond, 0)))

    def has_normal(self, point: Array) -> bool:
        """See `Body`."""
        _, beyond = self._local(point)
        first, second = np.sort(beyond)[:-3:-1]
        middle = self._half[np.argmax(beyond)] - self.edge_radius  # as far from the face on the other side
        return bool(first > 0 or min(first - second, first + middle) > 1e-6 * min(self.size))

    def outward(self, point: Array) -> Array:
        """See `Body`; within the core, out of its nearest face."""
        signs, beyond = self._local(point)
        away = np.maximum(beyond, 0) if beyond.max() > 0 else np.eye(3)[np.argmax(beyond)]
        return np.asarray(self.turn @ (signs * away) / np.linalg.norm(away))

    def signed_distance(self, point: Array) -> float:
        """See `Body`."""
        _, beyond = self._local(point)
        return float(np.linalg.norm(np.maximum(beyond, 0)) + min(beyond.max(), 0) - self.edge_radius)

    def on_surface(self, point: Array) -> Array:
        """See `Body`."""
        return np.asarray(point - self.signed_distance(point) * self.outward(point))

    def face(self, point: Array) -> tuple[Array, Array]:
        """See `Body`; beyond the rounded edge, what rounds the core's corners has to be far."""
        _, beyond = self._local(point)
        sides = np.delete(np.arange(3), np.argmax(beyond)).repeat(2)
        normals = np.tile([1.0, -1.0], 2)[:, None] * self.turn.T[sides]
        rounded = (_KINK * self._half) ** 2 / (4 * TILT * self.edge_radius)
        return normals, (self._half - self.edge_radius - rounded)[sides] + normals @ self.center

    def support(self, direction: Array) -> Array:
        """See `Body`."""
        return farthest(self._corners, direction, max(self.size))

    @property
    def _corners(self) -> Array:
        """Corners (8, 3) of the core."""
        return np.asarray(self.center + (_CORNERS * (self._half - self.edge_radius)) @ self.turn.T)

    @property
    def volume(self) -> float:
        """See `Body`; the rounding of the edges is left out."""
        return float(np.prod(self.size))

    @property
    def centroid(self) -> Array:
        """See `Body`."""
        return np.asarray(self.center, float)

    @property
    def unit_inertia(self) -> Array:
        """See `Body`."""
        square = np.square(self.size)
        return np.asarray(self.turn @ np.diag(square.sum() - square) @ self.turn.T / 12)

    def placed(self, rotation: Array, position: Array) -> Self:
        """See `Body`."""
        return replace(self, center=rotation @ self.center + position, rotation=_vector(rotation @ self.turn))

    def edges(self) -> list[tuple[Array, Array]]:
        """See `Body`: its edges, and the diagonals of its faces."""
        corners = self._corners
        near = [(i, j) for i, j in itertools.combinations(range(8), 2) if np.sum(_CORNERS[i] != _CORNERS[j]) <= 2]
        return [(corners[i], corners[j]) for i, j in near]

    def as_mapping(self) -> dict[str, Any]:
        """See `Body`; how it is turned as a quaternion [w, x, y, z]."""
        given = super().as_mapping()
        turn = Rotation.from_rotvec(given.pop("rotation")).as_quat(canonical=True, scalar_first=True)
        return {**given, "orientation": turn}

    def solids(self) -> tuple[Solid, ...]:
        """See `Body`."""
        return (Solid("box", self.centroid, self.centroid, size=np.asarray(self.size), turn=self.turn),)
