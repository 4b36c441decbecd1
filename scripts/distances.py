"""Measure distances of links from every shape of an object, as the motion sees them, against coal and trimesh.

    python scripts/distances.py --json docs/benchmarks

Links, thin ones, are drawn at random about a shape of size one. Coal measures the sharp shape that the files have; of
polytopes trimesh measures as many points, too. Lengths are in half the shape's largest extent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import casadi as ca
import coal
import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from shared import options_of, write_table
from tables import add_json, write_record

from casadi_hands.geometry.bodies import Body
from casadi_hands.geometry.bodies.box import Box
from casadi_hands.geometry.bodies.capsule import Capsule, Segment
from casadi_hands.geometry.bodies.convex import Convex
from casadi_hands.geometry.bodies.cylinder import Cylinder
from casadi_hands.geometry.bodies.sphere import Sphere
from casadi_hands.geometry.pairs import core_distance

Array = NDArray[np.float64]
HEAD = (
    "shape",
    "poses",
    "apart by less than 0.1",
    "median",
    "95 %",
    "largest too small",
    "largest too large",
    "where (distance)",
)
THIN = 1e-6
NEAR = 0.1
UP = np.array([0.0, 0.0, 1.0])


def shapes() -> Iterator[tuple[str, Body, coal.CollisionGeometry, coal.Transform3s]]:
    """A name, the body, and what coal measures."""
    still = coal.Transform3s.Identity()
    yield "sphere", Sphere(np.zeros(3), 1.0), coal.Sphere(1.0), still
    yield "capsule", Capsule(-0.6 * UP, 0.6 * UP, 0.4), coal.Capsule(0.4, 1.2), still
    yield "cylinder", Cylinder(-UP, UP, 0.6, 0.03), coal.Cylinder(0.6, 2.0), still
    yield "box", Box(np.zeros(3), np.array([1.0, 1.4, 2.0]), np.zeros(3), 0.0125), coal.Box(1.0, 1.4, 2.0), still
    wedge = np.array([[-1, -0.6, -0.5], [1, -0.6, -0.5], [-1, 0.6, -0.5], [1, 0.6, -0.5], [-1, 0, 0.6], [1, 0, 0.3]])
    yield "convex, 6 corners", *_convex(wedge)
    angles = 2 * np.pi * np.arange(24) / 24
    prism = np.array([[0.7 * np.cos(a), 0.7 * np.sin(a), z] for a in angles for z in (-1.0, 1.0)])
    yield "convex, a prism of 24 sides", *_convex(prism)
    round_off = np.random.default_rng(1).normal(size=(48, 3))
    yield "convex, 48 points of a sphere", *_convex(round_off / np.linalg.norm(round_off, axis=1, keepdims=True))


def _convex(points: Array) -> tuple[Body, coal.CollisionGeometry, coal.Transform3s]:
    given = coal.StdVec_Vec3s()
    given.extend(list(points))
    width = float(np.ptp(points, axis=0).min())
    return Convex(points, width / 200), coal.Convex.convexHull(given, True, "Qt"), coal.Transform3s.Identity()


def main() -> None:
    """Measure every shape and print a table."""
    parser = options_of(__doc__)
    parser.add_argument("--count", type=int, default=10_000, help="poses of each shape")
    add_json(parser)
    given = parser.parse_args()
    rows = []
    for name, body, solid, place in shapes():
        function = _distance(body)
        rows.append(_row(f"{name}: links", *_links(given.count, function, solid, place)))
        if isinstance(body, Convex):
            rows.append(_row(f"{name}: points, by trimesh", *_points(given.count, body)))
    write_table(HEAD, rows, None)
    write_record(given.json, "distances", HEAD, rows)


def _distance(body: Body) -> Callable[[Array, Array], float]:
    """Distance of a thin link's ends (3,) from a body's surface, in symbols evaluated."""
    ends, parameters = [ca.SX.sym(name, 3) for name in ("start", "end")], ca.SX.sym("parameters", body.width)
    surface = type(body).surface(parameters)
    found = ca.Function("distance", [*ends, parameters], [core_distance(Segment(*ends), surface.core) - surface.radius])
    return lambda start, end: float(found(start, end, body.parameters))


def _links(
    count: int, function: Callable[[Array, Array], float], solid: coal.CollisionGeometry, place: coal.Transform3s
) -> tuple[Array, Array]:
    """Distances by coal, and what is missed."""
    truths, missed = np.empty(count), np.empty(count)
    for k, (start, end) in enumerate(np.random.default_rng(0).uniform(-2, 2, (count, 2, 3))):
        length = float(np.linalg.norm(end - start))
        turn = Rotation.align_vectors([(end - start) / length], [UP])[0].as_matrix()
        result = coal.DistanceResult()
        at = coal.Transform3s(turn, (start + end) / 2)
        truths[k] = coal.distance(solid, place, coal.Capsule(THIN, length), at, coal.DistanceRequest(), result) + THIN
        missed[k] = function(start, end) - truths[k]
    return truths, missed


def _points(count: int, body: Convex) -> tuple[Array, Array]:
    """Distances of points by trimesh, positive outside, and what is missed."""
    cloud: Any = trimesh.PointCloud  # trimesh has types for a part of itself
    hull = cloud(np.asarray(body.vertices)).convex_hull
    signed_distance: Any = trimesh.proximity.signed_distance
    points = np.random.default_rng(0).uniform(-1.5, 1.5, (count, 3))
    truths = -signed_distance(hull, points)
    return truths, np.array([body.signed_distance(point) for point in points]) - truths


def _row(name: str, truths: Array, missed: Array) -> list[str]:
    """A row of the table: of bodies that are apart by less than a tenth."""
    near = (truths > 0) & (truths < NEAR)
    off, at = missed[near], truths[near]
    worst = int(np.abs(off).argmax())
    figures = (np.median(np.abs(off)), np.quantile(np.abs(off), 0.95), max(-off.min(), 0.0), max(off.max(), 0.0))
    return [name, str(len(truths)), str(near.sum()), *(f"{value:.2g}" for value in figures), f"{at[worst]:.2g}"]


if __name__ == "__main__":
    main()
