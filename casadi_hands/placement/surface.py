"""Points spread over the surface of an object, whatever its shapes are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from casadi_hands.geometry.bodies import Body

Array = NDArray[np.float64]
_SHELL = 0.1  # of half a body's largest extent: what is drawn within is projected onto its surface
_DRAWN = 60  # points tried for each that is wanted; a shell is a small part of its box
_MORE = 4  # times as many points as are wanted, of which those are kept that are spread best
RADIAL = 32  # directions, and their opposites, in which points are looked for whose normals pass the origin
_CENTRAL = 1e-3  # lengths from the origin, that they are nearest to
_SAME = 0.02  # lengths between points below which one is enough
_OFF = 1e-6  # lengths that a point may be off the surface
STEP = 0.05  # radii of a fingertip over which a normal's turn tells the curvature
EDGE = 0.5  # radii of a fingertip: surfaces that bend more are edges, where they bend less elsewhere


@dataclass(frozen=True)
class Spots:
    """Points of a surface, object frame.

    Attributes:
        points: (N, 3).
        normals: (N, 3), unit, outward.
        bodies: (N,) index of the body that each lies on.
    """

    points: Array
    normals: Array
    bodies: NDArray[np.int64]

    def __len__(self) -> int:
        """Number of points."""
        return len(self.points)

    def __getitem__(self, chosen: NDArray[np.generic] | Sequence[int]) -> Spots:
        """Some of them, by index or mask."""
        return Spots(self.points[chosen], self.normals[chosen], self.bodies[chosen])

    @classmethod
    def joined(cls, parts: Sequence[Spots]) -> Spots:
        """One after the other."""
        return cls(
            np.concatenate([p.points for p in parts]),
            np.concatenate([p.normals for p in parts]),
            np.concatenate([p.bodies for p in parts]),
        )


def spots(bodies: Sequence[Body], radius: float, count: int, rng: np.random.Generator) -> Spots:
    """Points on the outside of a union of bodies, evenly spread, where a fingertip fits.

    Points of a box about each body that lie near its surface are moved onto it, so that areas count alike; edges, and
    places where a fingertip would be in another body, are left out.

    Args:
        bodies: whose union the object is.
        radius: of the fingertip.
        count: of points, over all bodies.
        rng: which draws them.
    """
    found = [_on_body(bodies, index, rng, radius, count) for index in range(len(bodies))]
    return Spots.joined([thinned(Spots.joined(found), count), radial(bodies, radius)])


def radial(bodies: Sequence[Body], radius: float, count: int = RADIAL) -> Spots:
    """Points whose normals pass the object's origin, so that what presses there turns nothing; pairs face each other.

    Of each body they are what is nearest to points about the origin: all of a ball, a ring of a capsule, middles of
    faces.
    """
    ways = spread_directions(count)
    found = [_fitting(bodies, index, _CENTRAL * np.vstack([ways, -ways]), radius) for index in range(len(bodies))]
    return Spots.joined([_distinct(each) for each in found])


def spread_directions(count: int) -> Array:
    """(count, 3) unit vectors spread over half a sphere, the first ones about its equator."""
    around = np.pi * np.arange(count // 2) / (count // 2)
    level = np.column_stack([np.cos(around), np.sin(around), np.zeros_like(around)])
    rest = np.arange(count - count // 2)
    height, turn = (rest + 0.5) / len(rest), rest * np.pi * (3 - np.sqrt(5))
    across = np.sqrt(1 - height**2)
    return np.vstack([level, np.column_stack([across * np.cos(turn), across * np.sin(turn), height])])


def _distinct(on: Spots) -> Spots:
    """Those that are not where one before is."""
    kept = [k for k in range(len(on)) if not (np.linalg.norm(on.points[:k] - on.points[k], axis=1) < _SAME).any()]
    return on[np.array(kept, int)]


def spot(bodies: Sequence[Body], index: int, point: Array) -> Spots:
    """One given point (3,) of a body's surface."""
    return Spots(point[None], bodies[index].outward(point)[None], np.array([index]))


def _on_body(bodies: Sequence[Body], index: int, rng: np.random.Generator, radius: float, count: int) -> Spots:
    body = bodies[index]
    lower, upper = body.bounding_box
    shell = _SHELL * float((upper - lower).max()) / 2
    near: list[Array] = []
    for point in rng.uniform(lower - shell, upper + shell, (_DRAWN * count, 3)):
        if abs(body.signed_distance(point)) <= shell:
            near.append(point)
        if len(near) == _MORE * count:
            break
    return _off_edges(body, thinned(_fitting(bodies, index, np.reshape(near, (-1, 3)), radius), count), radius)


def _fitting(bodies: Sequence[Body], index: int, near: Array, radius: float) -> Spots:
    """The points of a body nearest to some (N, 3), where a fingertip is in no other body."""
    body, points, normals = bodies[index], [], []
    others = [other for other in bodies if other is not body]
    for point in near:
        if not body.has_normal(point):
            continue
        on, normal = body.on_surface(point), body.outward(point)
        if abs(body.signed_distance(on)) > _OFF or abs(np.linalg.norm(normal) - 1) > _OFF:
            continue
        if all(other.signed_distance(on + radius * normal) >= radius for other in others):
            points.append(on)
            normals.append(normal)
    return Spots(np.reshape(points, (-1, 3)), np.reshape(normals, (-1, 3)), np.full(len(points), index))


def _off_edges(body: Body, on: Spots, radius: float) -> Spots:
    """Those that are not on edges."""
    if not len(on):
        return on
    radii = np.minimum(
        [bending_radius(body, p, n, STEP * radius) for p, n in zip(on.points, on.normals, strict=True)], radius
    )
    return on[radii >= EDGE * radii.max()]


def bending_radius(body: Body, point: Array, normal: Array, step: float) -> float:
    """The smallest radius of curvature about a point (3,) of a surface, as the normal (3,) tells that steps away."""
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    turns = []
    for way in (first, np.cross(normal, first)):
        for sign in (-1, 1):
            turns.append(float(np.linalg.norm(body.outward(body.on_surface(point + sign * step * way)) - normal)))
    return step / max(*turns, 1e-9)


def thinned(on: Spots, count: int) -> Spots:
    """At most ``count`` of them: each is, of what is left, the farthest from those before it."""
    return on[farthest_first(on.points, count)]


def farthest_first(points: Array, count: int) -> NDArray[np.int64]:
    """Indices of at most ``count`` points (N, D), the first one first, then each the farthest from those before it."""
    if not len(points):
        return np.zeros(0, int)
    chosen, distance = [0], np.linalg.norm(points - points[0], axis=1)
    while len(chosen) < min(count, len(points)) and distance.max() > 1e-9:
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)
