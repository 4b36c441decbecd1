"""What holds of any body, against coal, samples and finite differences; and what task files say of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import casadi as ca
import coal
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from casadi_hands.errors import TaskError
from casadi_hands.geometry.bodies import Body
from casadi_hands.geometry.bodies.body import TILT
from casadi_hands.geometry.bodies.capsule import Segment
from casadi_hands.geometry.pairs import core_distance
from casadi_hands.task import parse_task
from tests.stages.synthesis.example import BALL

Array = NDArray[np.float64]
Placed = tuple[Any, coal.Transform3s]


def along_z(shape: Any, start: Array, end: Array) -> Placed:
    """One of coal's shapes, which have their axis along z and their middle at the origin, between two points (3,)."""
    length = np.linalg.norm(end - start)
    turn = Rotation.align_vectors([(end - start) / length], [[0.0, 0.0, 1.0]])[0] if length else Rotation.identity()
    return shape, coal.Transform3s(turn.as_matrix(), (start + end) / 2)


def coal_distance(one: Placed, other: Placed) -> float:
    """Of two bodies' surfaces."""
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance = 1e-9
    return float(coal.distance(*one, *other, request, result))


def around(body: Body, rng: np.random.Generator, count: int) -> Array:
    """Points (count, 3) in a body and about it."""
    lower, upper = body.bounding_box
    margin = (upper - lower).max() / 2
    points: Array = rng.uniform(lower - margin, upper + margin, (count, 3))
    return points


def check_numbers(body: Body, placed: Placed, rng: np.random.Generator) -> None:
    """Distance, nearest point, normal: coal's distance; on the surface; across it."""
    size = float(np.subtract(*body.bounding_box[::-1]).max())
    for point in around(body, rng, 200):
        distance, normal, nearest = body.signed_distance(point), body.outward(point), body.on_surface(point)
        tiny = coal.Sphere(1e-9), coal.Transform3s(np.eye(3), point)
        if distance > 1e-3 * size:
            np.testing.assert_allclose(distance, coal_distance(placed, tiny), atol=1e-6 * size)
        else:
            assert coal_distance(placed, tiny) <= 1.1e-3 * size
        np.testing.assert_allclose(np.linalg.norm(normal), 1, rtol=1e-12)
        np.testing.assert_allclose(point - distance * normal, nearest, atol=1e-12 * size)
        np.testing.assert_allclose(body.signed_distance(nearest), 0, atol=1e-12 * size)
        np.testing.assert_allclose(body.core_point(point) + body.core_offset(point), point, atol=1e-12 * size)
        h = 1e-6 * size
        slope = [body.signed_distance(point + h * e) - body.signed_distance(point - h * e) for e in np.eye(3)]
        np.testing.assert_allclose(np.array(slope) / (2 * h), normal, atol=1e-4)
        assert body.has_normal(point)


def surface_function(body: Body) -> ca.Function:
    """Point (3,) and parameters -> distance and normal of one way, and projection and normal of the other."""
    point, parameters = ca.SX.sym("point", 3), ca.SX.sym("parameters", body.width)
    surface = type(body).surface(parameters)
    return ca.Function("f", [point, parameters], [*surface.distance_and_normal(point), *surface.project(point)])


def check_symbols(body: Body, rng: np.random.Generator, off: float, turned: float) -> None:
    """The body in symbols is that in numbers, up to the rounding of its kinks.

    Args:
        body: any, of a size of about one.
        rng: where points are.
        off: by how much distances may differ.
        turned: by how much normals may.
    """
    function = surface_function(body)
    for point in around(body, rng, 200):
        if np.linalg.norm(body.core_offset(point)) < 0.02:
            continue  # of next to nothing there is no direction
        distance, normal, projection, same = (np.asarray(value).ravel() for value in function(point, body.parameters))
        np.testing.assert_allclose(distance, body.signed_distance(point), atol=off)
        np.testing.assert_allclose(normal, body.outward(point), atol=turned)
        np.testing.assert_allclose([*same, *(point - distance * same)], [*normal, *projection], atol=1e-9)
        np.testing.assert_allclose(projection, body.on_surface(point), atol=turned * max(1.0, abs(float(distance[0]))))


def check_derivatives(body: Body, rng: np.random.Generator) -> None:
    """Derivatives to point and parameters are those of finite differences."""
    value, slopes, _ = _derived(body)
    h, checked = 1e-6, 0
    for at in around(body, rng, 20):
        if np.linalg.norm(body.core_offset(at)) < 0.1:
            continue
        where = np.r_[at, body.parameters]
        steps = h * np.eye(len(where))
        differences = [np.asarray(value(where + step) - value(where - step)).ravel() / (2 * h) for step in steps]
        np.testing.assert_allclose(np.asarray(slopes(where)), np.transpose(differences), atol=1e-6)
        checked += 1
    assert checked > 5


def check_finite(body: Body, points: Sequence[Array]) -> None:
    """First and second derivatives to point and parameters are finite at points (3,), nasty ones say."""
    functions = _derived(body)
    for at in points:
        for function in functions:
            assert np.isfinite(np.asarray(function(np.r_[at, body.parameters]))).all()


def _derived(body: Body) -> tuple[ca.Function, ca.Function, ca.Function]:
    """Of point and parameters: all that `surface_function` returns, and its first and second derivatives."""
    x = ca.SX.sym("x", 3 + body.width)
    out = ca.vertcat(*surface_function(body)(x[:3], x[3:]))
    jacobian = ca.jacobian(out, x)
    outputs: list[Any] = [out, jacobian, ca.jacobian(ca.vec(jacobian), x)]
    value, first, second = (ca.Function(name, [x], [each]) for name, each in zip("abc", outputs, strict=True))
    return value, first, second


def check_support(body: Body, surface: Array, rng: np.random.Generator) -> None:
    """Nothing of many points (P, 3) on the surface is farther in any direction, and some are next to as far."""
    for direction in rng.normal(size=(40, 3)):
        direction /= np.linalg.norm(direction)
        farthest = (body.support(direction) + body.ball * direction) @ direction
        np.testing.assert_allclose(farthest, farthest[0], atol=1e-9)
        reached = (surface @ direction).max()
        assert reached - 1e-9 <= farthest[0] <= reached + 5e-3
    lower, upper = body.bounding_box
    np.testing.assert_allclose(lower, surface.min(axis=0), atol=5e-3)
    np.testing.assert_allclose(upper, surface.max(axis=0), atol=5e-3)


def check_placed(body: Body, rng: np.random.Generator) -> None:
    """Moved rigidly, in numbers and in symbols, it is as far from points that move along; packed, it is the same."""
    turn, shift = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    moved = body.placed(turn, shift)
    twice = body.measured(lambda lengths: 2 * lengths).placed(np.eye(3), np.zeros(3))
    np.testing.assert_allclose(twice.signed_distance(2 * np.ones(3)), 2 * body.signed_distance(np.ones(3)))
    assert len(body.parameters) == body.width
    point, parameters = ca.SX.sym("point", 3), ca.SX.sym("parameters", body.width)
    surface = type(body).surface(parameters).mapped(lambda p: ca.mtimes(ca.SX(turn), p) + ca.SX(shift))
    function = ca.Function("f", [point, parameters], [*surface.distance_and_normal(point)])
    here = surface_function(body)
    for at in around(body, rng, 30):
        there = turn @ at + shift
        np.testing.assert_allclose(moved.signed_distance(there), body.signed_distance(at), atol=1e-12)
        np.testing.assert_allclose(moved.outward(there), turn @ body.outward(at), atol=1e-9)
        distance, normal, *_ = (np.asarray(value).ravel() for value in here(at, body.parameters))
        far, out = (np.asarray(value).ravel() for value in function(there, body.parameters))
        np.testing.assert_allclose(far, distance, atol=1e-9)
        np.testing.assert_allclose(out, turn @ normal, atol=1e-6)
    np.testing.assert_allclose(moved.centroid, turn @ body.centroid + shift, atol=1e-12)
    np.testing.assert_allclose(moved.unit_inertia, turn @ body.unit_inertia @ turn.T, atol=1e-12)
    assert np.isclose(moved.volume, body.volume)


def check_lowest(body: Body, rng: np.random.Generator) -> None:
    """Of the points that the core names for a direction upward, the lowest is as low as the support point below."""
    up, parameters = ca.SX.sym("up", 3), ca.SX.sym("parameters", body.width)
    core = type(body).surface(parameters).core
    points = ca.Function("f", [up, parameters], [ca.horzcat(*core.lowest(up)), ca.horzcat(*core.marks(up))])
    for direction in rng.normal(size=(30, 3)):
        direction /= np.linalg.norm(direction)
        lowest, marks = (np.asarray(found).T for found in points(direction, body.parameters))
        np.testing.assert_allclose((lowest @ direction).min(), (body.support(-direction) @ direction)[0], atol=1e-3)
        assert (marks @ direction).min() <= (lowest @ direction).min() + 1e-9


def check_faces(body: Body, sharp: Body, rng: np.random.Generator, least: float) -> None:
    """Where half-spaces keep a contact on a face, the normal in symbols is that of the sharp body; and there is room.

    Args:
        body: with rounded edges.
        sharp: the same with edges that are hardly round.
        rng: which draws points.
        least: share of points on the surface that are off the edges of their faces, at least.
    """
    function, within = surface_function(body), 0
    points = rng.uniform(*body.bounding_box, (400, 3))
    for point in map(sharp.on_surface, points):
        normals, offsets = body.face(point)
        assert len(normals) == len(offsets) <= body.face_bounds
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
        if np.all(normals @ point <= offsets):
            within += 1
            normal = np.asarray(function(point, body.parameters)[1]).ravel()
            assert np.linalg.norm(normal - sharp.outward(point)) < 2 * TILT
    assert within >= least * len(points)


def check_edges(body: Body, rng: np.random.Generator) -> None:
    """Edges are of the core."""
    for start, end in body.edges():
        for share in rng.uniform(size=5):
            at = start + share * (np.asarray(end) - start)
            np.testing.assert_allclose(body.core_offset(at), 0, atol=1e-9)


def revolved(
    profile: Callable[[Array], Array], height: float, kinks: tuple[float, ...] = ()
) -> tuple[float, float, float]:
    """Volume, and unit inertia along and across the axis, of a solid of revolution about its middle, by quadrature.

    Args:
        profile: heights -> squared radii; a polynomial from kink to kink.
        height: half its length.
        kinks: heights where it is not smooth.
    """
    nodes, weights = np.polynomial.legendre.leggauss(8)
    cuts = [-height, *kinks, height]
    z = np.concatenate([(a + b) / 2 + (b - a) / 2 * nodes for a, b in pairwise(cuts)])
    w = np.concatenate([(b - a) / 2 * weights for a, b in pairwise(cuts)])
    square = profile(z)
    volume = float(np.pi * w @ square)
    along = float(np.pi / 2 * w @ square**2) / volume
    across = float(np.pi * w @ (square**2 / 4 + z**2 * square)) / volume
    return volume, along, across


def check_links(
    body: Body,
    core: Placed,
    rng: np.random.Generator,
    most: float = 2e-3,
    swept: float = 0.0,
) -> None:
    """Distances of links, thin ones, from a body's core are coal's.

    Args:
        body: of a size of about one.
        core: as coal has it.
        rng: where links are.
        most: by how much all but a few may be off, where the body's edges are round.
        swept: what coal's body is larger by.
    """
    ends, parameters = [ca.SX.sym(name, 3) for name in ("start", "end")], ca.SX.sym("parameters", body.width)
    surface = type(body).surface(parameters)
    distance = ca.Function("distance", [*ends, parameters], [core_distance(Segment(*ends), surface.core)])
    missed = []
    for start, end in rng.uniform(-2, 2, (400, 2, 3)):
        length = float(np.linalg.norm(end - start))
        truth = coal_distance(along_z(coal.Capsule(1e-6, length), start, end), core) + 1e-6
        found = float(distance(start, end, body.parameters)) - swept
        if truth > 0:
            assert found < truth + 0.03
        if truth > 0.03:
            missed.append(found - truth)
    assert len(missed) > 5
    assert min(missed) > -2e-3
    assert max(missed) < 1e-2
    assert np.quantile(np.abs(missed), 0.98) < most


def check_solid(body: Body, whole: Placed) -> None:
    """Its volume, centre and inertia are those of what coal has of its sharp-edged shape."""
    shape, placed = whole
    turn, volume = placed.getRotation(), shape.computeVolume()
    assert body.volume == pytest.approx(volume)
    np.testing.assert_allclose(body.centroid, placed.transform(shape.computeCOM()), atol=1e-12)
    expected = turn @ shape.computeMomentofInertiaRelatedToCOM() @ turn.T / volume
    np.testing.assert_allclose(body.unit_inertia, expected, atol=1e-12)


def shape_in_task(given: str, refused: Mapping[str, str]) -> Any:
    """The shape of a task whose object is given as in a file, and is refused, with some words, as others."""
    ball = "sphere: {center: [0, 0, 0], radius: 0.03}"
    for wrong, allowed in refused.items():
        with pytest.raises(TaskError, match=allowed):
            parse_task(BALL.replace(ball, wrong))
    (shape,) = parse_task(BALL.replace(ball, given)).object.shapes
    return shape
