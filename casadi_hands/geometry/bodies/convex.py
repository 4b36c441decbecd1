"""A polytope: flat faces about all points, its edges rounded by how softly the nearest face is chosen."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any, ClassVar

import casadi as ca
import numpy as np
from casadi import SX
from scipy.spatial import QhullError

from casadi_hands.geometry.bodies.body import TILT, Array, Body, Solid, Surface, edge_metadata, farthest
from casadi_hands.geometry.facets import SHARPNESS, Facets
from casadi_hands.geometry.hull import ALIKE, Hull, crossed, hull_of, mass_moments, within

_STEPS = 1000  # towards the surface; in a sharp wedge they zigzag
_MOST_BOUNDS = 8  # of a face, those nearest to a point
_SHARP = np.cos(np.radians(30.01))  # of the angle between faces: contacts may roll over blunter edges
_ROUNDS = 30  # of moving faces until the surface goes through their middles


def _edge(data: Mapping[str, Any]) -> float:
    """A hundredth of half the least width."""
    points = np.asarray(data["vertices"], float)
    try:
        hull = hull_of(points)
    except QhullError:
        return 1.0  # refused below
    return float((hull.reaches - (hull.corners @ hull.normals.T).min(axis=0)).min()) / 200


@dataclass(frozen=True, eq=False)
class Convex(Body):
    """The least polytope about some points.

    Attributes:
        counts: of faces, corners of the core, sharp edges, and corners; like ``width``, that is of classes that
            `_of_counts` makes.
    """

    kind: ClassVar[str] = "convex"
    face_bounds: ClassVar[int] = _MOST_BOUNDS
    counts: ClassVar[tuple[int, int, int, int]]
    _hull: ClassVar[Any]  # of each body a `Hull`, or None where there is none, and no field
    _core: ClassVar[Any]  # likewise
    vertices: Array = field(metadata={"about": "Its corners, m, object frame; a list of four or more.", "is": "points"})
    edge_radius: float = field(metadata=edge_metadata(_edge, "a hundredth of half the least width", "square edges"))

    def __new__(cls, vertices: Array, edge_radius: float) -> Convex:
        """A body of as many faces and corners as its points have: a class of its own, since kernels differ by it."""
        hull = core = None
        with contextlib.suppress(QhullError, ValueError):
            hull = hull_of(np.asarray(vertices, float))
            core = within(hull, edge_radius)
        return _of_hulls(vertices, edge_radius, hull, core)

    def __reduce__(self) -> tuple[Any, ...]:
        """How it is sent to another process: classes by counts are made there."""
        return _of_hulls, (self.vertices, self.edge_radius, self._hull, self._core)

    def impossible(self) -> str:
        """See `Body`."""
        if self._hull is None:
            return "four points or more that do not lie in one plane"
        return "" if self._core else "an edge_radius smaller than half its least width"

    @property
    def ball(self) -> float:
        """See `Body`."""
        return self.edge_radius

    @property
    def parameters(self) -> Array:
        """See `Body`: faces' normals and reaches, corners of the core and its own, edges' starts and ends, radius."""
        hull = self._hull
        points = [self._core.corners, hull.corners, *(hull.corners[hull.edges[:, k]] for k in (0, 1))]
        return np.concatenate([hull.normals.ravel(), self._reaches, *map(np.ravel, points), [self.edge_radius]])

    @classmethod
    def surface(cls, parameters: SX) -> Surface:
        """See `Body`."""
        faces, corners, edges, vertices = cls.counts
        places = np.cumsum([0, 3 * faces, faces, 3 * corners, 3 * vertices, 3 * edges, 3 * edges]).tolist()
        normals, reaches, *points = (parameters[a:b] for a, b in itertools.pairwise(places))
        rows = [ca.reshape(each, 3, -1).T for each in (normals, *points)]
        radius = parameters[places[-1]]
        return Surface(Facets(rows[0], reaches, rows[1], radius, *rows[2:]), radius)

    @cached_property
    def _reaches(self) -> Array:
        """Of the faces, (F,), moved so that the surface goes through their middles."""
        hull, reaches = self._hull, self._hull.reaches.copy()
        middles = np.array([self._middle(n, d) for n, d in zip(hull.normals, hull.reaches, strict=True)])
        for _ in range(_ROUNDS):
            reaches += self._chosen(middles, reaches)[0]
        return np.asarray(reaches)

    def _middle(self, normal: Array, reach: float) -> Array:
        """Middle (3,) of a face."""
        hull = self._hull
        triangles = hull.corners[hull.triangles]
        flat = np.abs(triangles @ normal - reach).max(axis=1) <= 2 * ALIKE * np.ptp(hull.corners, axis=0).max()
        areas = np.linalg.norm(crossed(triangles[flat]), axis=1)
        return np.asarray(areas @ triangles[flat].mean(axis=1) / areas.sum())

    def _chosen(self, points: Array, reaches: Array | None = None) -> tuple[Array, Array]:
        """How far points (..., 3) are outside, softly, and mean normals (..., 3) of the faces nearest to them."""
        sharpness = SHARPNESS / self.edge_radius
        beyond = points @ self._hull.normals.T - (self._reaches if reaches is None else reaches)
        most = beyond.max(axis=-1, keepdims=True)
        weights = np.exp(sharpness * (beyond - most))
        total = weights.sum(axis=-1, keepdims=True)
        return (most + np.log(total) / sharpness)[..., 0], weights @ self._hull.normals / total

    @cached_property
    def helper(self) -> Array:
        """See `Body`: of directions all about, the one that is farthest from all faces' normals."""
        k = np.arange(200) + 0.5
        height, around = 1 - k / 100, np.pi * (1 + np.sqrt(5)) * k
        about = np.sqrt(1 - height**2)
        tried = np.column_stack([about * np.cos(around), about * np.sin(around), height])
        return np.asarray(tried[np.argmin(np.abs(tried @ self._hull.normals.T).max(axis=1))])

    def core_point(self, point: Array) -> Array:
        """See `Body`."""
        return np.asarray(point - (self.signed_distance(point) + self.edge_radius) * self.outward(point))

    def has_normal(self, point: Array) -> bool:
        """See `Body`."""
        return bool(np.linalg.norm(self._chosen(point)[1]) > 0.5)

    def outward(self, point: Array) -> Array:
        """See `Body`."""
        mean = self._chosen(point)[1]
        return np.asarray(mean / max(float(np.linalg.norm(mean)), 1e-9))

    def signed_distance(self, point: Array) -> float:
        """See `Body`."""
        beyond, mean = self._chosen(point)
        return float(beyond / max(float(np.linalg.norm(mean)), 1e-6) if beyond > 0 else beyond)

    def on_surface(self, point: Array) -> Array:
        """See `Body`."""
        near = 1e-12 * float(np.ptp(self._hull.corners))
        for _ in range(_STEPS):
            beyond, mean = self._chosen(point)
            if abs(beyond) < near:
                break
            point = point - beyond * mean / max(float(mean @ mean), 1e-3)
        return np.asarray(point)

    def face(self, point: Array) -> tuple[Array, Array]:
        """See `Body`; only of edges that are sharp, the nearest."""
        hull = self._hull
        beyond = hull.normals @ point - hull.reaches
        own = int(np.argmax(beyond))
        cosines = hull.normals @ hull.normals[own]
        sines = np.sqrt(1 - np.minimum(cosines**2, 1))
        near = 2 * ALIKE * np.ptp(hull.corners, axis=0).max()
        on = np.abs(hull.corners @ hull.normals.T - hull.reaches) <= near
        sharp = np.flatnonzero(((on[:, [own]] & on).sum(axis=0) >= 2) & (cosines < _SHARP))
        nearest = sharp[np.argsort(-beyond[sharp] / sines[sharp], kind="stable")[:_MOST_BOUNDS]]
        # So far within the next face's plane its share in the mean normal turns that by no more.
        off = -np.log(TILT) * self.edge_radius / SHARPNESS
        return hull.normals[nearest], hull.reaches[nearest] - off

    def support(self, direction: Array) -> Array:
        """See `Body`."""
        corners = self._core.corners
        return farthest(corners, direction, float(np.ptp(corners, axis=0).max()))

    @cached_property
    def _moments(self) -> tuple[float, Array, Array]:
        return mass_moments(self._hull.corners[self._hull.triangles])

    @property
    def volume(self) -> float:
        """See `Body`; of the faces' polytope, as what follows."""
        return self._moments[0]

    @property
    def centroid(self) -> Array:
        """See `Body`."""
        return self._moments[1]

    @property
    def unit_inertia(self) -> Array:
        """See `Body`."""
        return self._moments[2]

    def placed(self, rotation: Array, position: Array) -> Convex:
        """See `Body`."""
        # Found anew, a hull of turned points might be rounded to more or fewer faces, which kernels differ by.
        hull, core = (each.placed(rotation, position) for each in (self._hull, self._core))
        made = _of_hulls(np.asarray(self.vertices) @ rotation.T + position, self.edge_radius, hull, core)
        vars(made)["_reaches"] = self._reaches + hull.normals @ position
        return made

    def edges(self) -> list[tuple[Array, Array]]:
        """See `Body`."""
        core = self._core
        sides = {tuple(sorted((int(t[k - 1]), int(t[k])))) for t in core.triangles for k in range(3)}
        return [(core.corners[i], core.corners[j]) for i, j in sorted(sides)]

    def solids(self) -> tuple[Solid, ...]:
        """See `Body`."""
        hull = self._hull
        return (Solid("convex", np.zeros(3), np.zeros(3), vertices=hull.corners, triangles=hull.triangles),)


def _of_hulls(vertices: Array, edge_radius: float, hull: Hull | None, core: Hull | None) -> Convex:
    """The body of some points whose hull and core are known; None of those that there are none of."""
    kind = Convex
    if hull and core:
        kind = _of_counts(len(hull.normals), len(core.corners), len(hull.edges), len(hull.corners))
    made = object.__new__(kind)
    # All of it here: Python calls no `__init__` of what is not of the class that was asked for.
    vars(made).update(vertices=vertices, edge_radius=edge_radius, _hull=hull, _core=core)
    return made


@cache
def _of_counts(faces: int, corners: int, edges: int, vertices: int) -> type[Convex]:
    """The class of polytopes of so many faces, sharp edges and corners, whose cores have so many corners."""
    counts, width = (faces, corners, edges, vertices), 4 * faces + 3 * (corners + vertices) + 6 * edges + 1
    own = {"counts": counts, "width": width, "__module__": __name__}
    return type(f"Convex{'x'.join(map(str, counts))}", (Convex,), own)
