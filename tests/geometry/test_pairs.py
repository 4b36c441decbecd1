"""Distances of cores looked up by their kinds, against coal and against each other."""

from __future__ import annotations

import casadi as ca
import coal
import numpy as np
import pytest
from numpy.typing import NDArray

from casadi_hands.geometry import pairs
from casadi_hands.geometry.bodies import KINDS, Body, packed, surfaces, width_of
from casadi_hands.geometry.bodies.box import Box
from casadi_hands.geometry.bodies.capsule import Capsule, Segment
from casadi_hands.geometry.bodies.convex import Convex
from casadi_hands.geometry.bodies.cylinder import Cylinder
from casadi_hands.geometry.bodies.sphere import Point, Sphere
from casadi_hands.motion.rotation import exponential, rotation_matrix
from tests.geometry.bodies.checks import along_z, coal_distance

Array = NDArray[np.float64]
THIN = 1e-6
BODIES: list[Body] = [
    Box(np.array([0.1, 0, 0]), np.array([0.8, 0.6, 0.5]), np.array([0.1, 0.2, 0]), 0.02),
    Cylinder(np.array([0, 0, -0.4]), np.array([0, 0.1, 0.5]), 0.3, 0.05),
    Convex(np.vstack([0.5 * np.eye(3), -0.4 * np.eye(3)]), 0.05),
]


def segment_to_segment(way: str) -> ca.Function:
    """Four ends (3,) -> distance of two segments, in closed form or as for any core."""
    ends = [ca.SX.sym("end", 3) for _ in range(4)]
    one, other = Segment(*ends[:2]), Segment(*ends[2:])
    found = {"closed": pairs.core_distance, "any": pairs._segment_and_core}[way](one, other)
    return ca.Function("f", ends, [found])


def thin(start: Array, end: Array) -> tuple[object, coal.Transform3s]:
    return along_z(coal.Capsule(THIN, np.linalg.norm(end - start)), start, end)


def test_segments_are_as_far_apart_as_by_coal(rng: np.random.Generator) -> None:
    function, checked = segment_to_segment("closed"), 0
    for ends in rng.normal(size=(300, 4, 3)):
        truth = coal_distance(thin(*ends[:2]), thin(*ends[2:])) + 2 * THIN
        if truth > 0.3:
            np.testing.assert_allclose(float(function(*ends)), truth, atol=1e-3)
            checked += 1
    assert checked > 100


def test_what_serves_any_core_finds_the_closed_form(rng: np.random.Generator) -> None:
    """It is never too small, and close, but for segments next to parallel, where it is slow."""
    closed, other = segment_to_segment("closed"), segment_to_segment("any")
    off = []
    for ends in rng.normal(size=(300, 4, 3)):
        exact = float(closed(*ends))
        if exact > 0.3:
            off.append(float(other(*ends)) - exact)
    assert min(off) > -2e-3
    assert np.quantile(off, 0.9) < 5e-3
    assert max(off) < 0.1


def test_what_serves_any_core_is_exact_beside_a_point(rng: np.random.Generator) -> None:
    for start, end, point in rng.normal(size=(50, 3, 3)):
        segment = Segment(ca.SX(start), ca.SX(end))
        found = float(ca.evalf(pairs._segment_and_core(segment, Point(ca.SX(point)))))
        nearest = Capsule(start, end, 1.0).core_point(point)
        assert found == pytest.approx(np.linalg.norm(point - nearest), abs=1e-6)


@pytest.mark.parametrize("length", [0.0, 0.5, 3.0])
def test_a_segment_and_a_point(length: float, rng: np.random.Generator) -> None:
    for start, way, point in rng.normal(size=(50, 3, 3)):
        end = start + length * way
        found = float(ca.evalf(pairs.core_distance(Segment(ca.SX(start), ca.SX(end)), Point(ca.SX(point)))))
        truth = np.linalg.norm(point - Capsule(start, end, 1.0).core_point(point))
        assert found >= truth - 1e-9
        if truth > 0.3:
            assert found == pytest.approx(truth, abs=1e-3)


def test_a_point_is_a_segment_of_no_length(rng: np.random.Generator) -> None:
    for start, end, point in rng.normal(size=(30, 3, 3)):
        one, at = Segment(ca.SX(start), ca.SX(end)), ca.SX(point)
        as_point = float(ca.evalf(pairs.core_distance(one, Point(at))))
        assert as_point == pytest.approx(float(ca.evalf(pairs.core_distance(one, Segment(at, at)))), abs=1e-6)


def check_derivatives(value: ca.SX, x: ca.SX, at: Array, h: float, slope_off: float, bend_off: float) -> None:
    """First and second derivatives against differences over ``h``."""
    function = ca.Function("f", [x], [value, ca.gradient(value, x), ca.hessian(value, x)[0]])
    _, gradient, hessian = (np.asarray(found) for found in function(at))
    ahead, behind = ([function(at + s * h * e) for e in np.eye(len(at))] for s in (1, -1))
    slopes = [float(a[0] - b[0]) / (2 * h) for a, b in zip(ahead, behind, strict=True)]
    np.testing.assert_allclose(gradient.ravel(), slopes, atol=slope_off)
    bends = [np.asarray(a[1] - b[1]).ravel() / (2 * h) for a, b in zip(ahead, behind, strict=True)]
    np.testing.assert_allclose(hessian, bends, atol=bend_off)


def test_derivatives_are_those_of_differences() -> None:
    # Skew, both nearest points inside, where no clamp is at its corner.
    x = ca.SX.sym("x", 12)
    value = segment_to_segment("closed")(x[:3], x[3:6], x[6:9], x[9:])
    at = np.array([-1, 0.1, 0, 1.2, 0, 0.2, 0.3, 0.9, -1, 0.1, 1.1, 1.3])
    check_derivatives(value, x, at, 1e-6, 1e-7, 1e-5)


@pytest.mark.parametrize("end", [(1.2, 0.9, 0.2), (-0.3, 1.6, 0.4)], ids=["inside", "at an end"])
@pytest.mark.parametrize("body", BODIES, ids=[body.kind for body in BODIES])
def test_derivatives_by_a_body_s_pose_and_a_segment_s_ends(body: Body, end: tuple[float, ...]) -> None:
    """All that finds the nearest points is constant to derivatives, which are there all the same."""
    x = ca.SX.sym("x", 12)
    turn = rotation_matrix(exponential(x[6:9]))
    surface = surfaces((type(body),), ca.SX(body.parameters))[0].mapped(lambda p: x[9:] + ca.mtimes(turn, p))
    value = pairs.core_distance(Segment(x[:3], x[3:6]), surface.core)
    at = np.array([-1.1, 1.2, 0.3, *end, 0.2, -0.3, 0.4, 0.1, -0.2, 0.05])
    check_derivatives(value, x, at, 1e-5, 1e-4, 1e-2)


def test_what_is_farther_than_enough_need_not_be_found(rng: np.random.Generator) -> None:
    """Nearer, with derivatives, it is what it would be anyway; else it is more than that, and as flat as can be."""
    x, body, enough = ca.SX.sym("x", 6), BODIES[-1], 0.4
    core = surfaces((type(body),), ca.SX(body.parameters))[0].core
    found = []
    for limit in (None, ca.SX(enough)):
        value = pairs.core_distance(Segment(x[:3], x[3:]), core, limit)
        derivatives = ca.gradient(value, x), ca.densify(ca.hessian(value, x)[0])
        found.append(ca.Function("f", [x], [value, *derivatives]))
    near = 0
    for at in rng.normal(size=(200, 6)):
        exact, either = ([np.asarray(each) for each in function(at)] for function in found)
        if exact[0] < enough:
            near += 1
            assert [a.tolist() for a in either] == [a.tolist() for a in exact]
        else:
            assert either[0] >= enough
            assert not np.any(either[1]) or either[0] == exact[0]
    assert 20 < near < 180


def test_what_finds_the_nearest_points_is_called_once() -> None:
    """Derivatives of a distance compute none of it again: else they grow with a body's faces and all variables."""
    x, body = ca.SX.sym("x", 6), BODIES[-1]
    core = surfaces((type(body),), ca.SX(body.parameters))[0].core
    value = pairs.core_distance(Segment(x[:3], x[3:]), core)
    found = ca.Function("f", [x], [value, ca.gradient(value, x), ca.hessian(value, x)[0]])
    assert found.str(True).count("= nearest_") == 1


def test_bodies_in_one_column_are_told_apart(rng: np.random.Generator) -> None:
    bodies = [Sphere(np.ones(3), 0.2), Capsule(np.zeros(3), np.array([0, 0, 1.0]), 0.3), Sphere(-np.ones(3), 0.4)]
    kinds = tuple(type(body) for body in bodies)
    assert width_of(kinds) == 4 + 7 + 4 == len(packed(bodies))
    assert [KINDS["sphere"], KINDS["capsule"]] == [Sphere, Capsule]
    point, parameters = ca.SX.sym("point", 3), ca.SX.sym("parameters", 15)
    found = [each.distance_and_normal(point)[0] for each in surfaces(kinds, parameters)]
    function = ca.Function("f", [point, parameters], found)
    for at in 3 * rng.normal(size=(20, 3)):
        distances = [float(value) for value in function(at, packed(bodies))]
        np.testing.assert_allclose(distances, [body.signed_distance(at) for body in bodies], atol=1e-5)
