"""Distances of bodies against coal's."""

import itertools
import math

import casadi as ca
import coal
import numpy as np
import pytest

from casadi_hands.geometry.bodies.capsule import Capsule
from casadi_hands.geometry.bodies.sphere import Sphere
from casadi_hands.task.hand import SHORTEST_HINGE
from casadi_hands.terms import clearance

RADIUS, THICK = 0.1, 0.16
# A finger of three links, well away from what it is measured against.
JOINTS = np.array([[0.2, 0, 0], [0.3, 0.2, 0.8], [0.1, 0.9, 1.3], [-0.6, 1.2, 1.2]])
OTHER = np.array([[-0.7, 0, 0], [-0.9, -0.4, 0.9], [-0.2, -0.8, 1.6]])
BODIES = Capsule(np.array([-1, 0, 2.2]), np.array([1, 0.2, 2.4]), 0.3), Sphere(np.array([1.2, 1, 1]), 0.25)


def fold(points: np.ndarray, joint: int) -> float:
    """A radius times the cosine of the turn at a joint, by the law of cosines, over that of the sharpest fold."""
    before, after = (math.dist(points[joint], points[joint + side]) for side in (-1, 1))
    across = math.dist(points[joint - 1], points[joint + 1])
    return RADIUS * ((across**2 - before**2 - after**2) / (2 * before * after) + 0.3)


def of_one(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances of links that are no neighbours, and how far neighbours are from the sharpest fold."""
    ends = [(ca.SX(a), ca.SX(b)) for a, b in itertools.pairwise(points)]
    apart, unfolded = clearance.links_of_one(ends, radii(points)), clearance.unfolded(ends, ca.SX(RADIUS))
    return np.asarray(ca.evalf(apart)).ravel(), np.asarray(ca.evalf(unfolded)).ravel()


def radii(points: np.ndarray) -> list[ca.SX]:
    """Of a finger's links: the last one is thicker."""
    return [*[ca.SX(RADIUS)] * (len(points) - 2), ca.SX(THICK)]


def links(points: np.ndarray) -> list[tuple[ca.DM, ca.DM]]:
    return [(ca.DM(a), ca.DM(b)) for a, b in itertools.pairwise(points)]


def coal_distance(a, b, other_a, other_b, radius: float, other_radius: float) -> float:
    shapes = []
    for start, end, r in ((a, b, radius), (other_a, other_b, other_radius)):
        along = np.asarray(end) - start
        length = np.linalg.norm(along)
        z = along / length if length else np.array([0, 0, 1.0])
        x = np.linalg.svd(z[None])[2][1]
        frame = coal.Transform3s(np.column_stack([x, np.cross(z, x), z]), (np.asarray(start) + end) / 2)
        shapes += [coal.Capsule(r, length) if length else coal.Sphere(r), frame]
    return coal.distance(*shapes, coal.DistanceRequest(), coal.DistanceResult())


def test_overlap_is_the_square_of_what_is_too_deep() -> None:
    found = np.asarray(clearance.overlap(ca.DM([-0.5, -1e-3, 0.0, 0.1, 2.0]))).ravel()
    # Half the transition, of 1e-3 to both sides, is left where bodies just touch.
    np.testing.assert_allclose(found, [0, 0, 1e-6 / 6, 0.01, 4], atol=1e-6, rtol=1e-4)
    assert found[2] == pytest.approx(1e-6 / 6)


def test_links_and_object() -> None:
    ends = [(ca.SX(a), ca.SX(b)) for a, b in itertools.pairwise(JOINTS)]
    bodies = [type(body).surface(ca.SX(body.parameters)) for body in BODIES]
    found = np.asarray(ca.evalf(clearance.links_and_object(ends, radii(JOINTS), bodies))).ravel()
    axes = [(BODIES[0].start, BODIES[0].end, 0.3), (BODIES[1].center, BODIES[1].center, 0.25)]
    expected = [
        coal_distance(a, b, start, end, thick, radius)
        for (a, b), thick in zip(itertools.pairwise(JOINTS), (RADIUS, RADIUS, THICK), strict=True)
        for start, end, radius in axes
    ]
    np.testing.assert_allclose(found, expected, atol=5e-4)


def test_links_of_two_fingers_and_of_one() -> None:
    both = (links(JOINTS), radii(JOINTS)), (links(OTHER), radii(OTHER))
    found = np.asarray(ca.evalf(clearance.links_and_links(*both))).ravel()
    thick = {(i, j): (THICK if i == 2 else RADIUS, THICK if j == 1 else RADIUS) for i in range(3) for j in range(2)}
    expected = [coal_distance(*JOINTS[i : i + 2], *OTHER[j : j + 2], *sizes) for (i, j), sizes in thick.items()]
    np.testing.assert_allclose(found, expected, atol=5e-4)
    folds = [fold(JOINTS, 1), fold(JOINTS, 2)]
    apart, unfolded = of_one(JOINTS)
    np.testing.assert_allclose(apart, [coal_distance(*JOINTS[:2], *JOINTS[2:], RADIUS, THICK)], atol=5e-4)
    np.testing.assert_allclose(unfolded, folds, atol=5e-4)
    assert of_one(JOINTS[:3])[0].size == 0
    np.testing.assert_allclose(of_one(JOINTS[:3])[1], folds[:1], atol=5e-4)
    assert [each.size for each in of_one(JOINTS[:2])] == [0, 0]


@pytest.mark.parametrize("degrees", [0, 30, 90, 107.4, 107.5, 108, 150, 180])
@pytest.mark.parametrize("length", [0.3, 0.8])
def test_neighbours_that_fold_no_sharper_than_allowed_are_clear_of_each_other(degrees: float, length: float) -> None:
    angle = np.radians(degrees)
    along = np.array([0, np.sin(angle), np.cos(angle)])
    points = np.array([[0, 0, 0], [0, 0, 0.5], [0, 0, 0.5] + length * along])
    (found,) = of_one(points)[1]
    assert found == pytest.approx(RADIUS * (np.cos(angle) + 0.3), abs=5e-4)
    # Bodies as they are built: each begins the shortest hinge off its joint.
    hinge = SHORTEST_HINGE * RADIUS
    apart = coal_distance([0, 0, hinge], points[1], points[1] + hinge * along, points[2], RADIUS, RADIUS)
    assert (apart > 0) == (degrees < 107.7)
    # A thicker last link begins as many of its own radii off.
    for thick in (1.5 * RADIUS, 2 * RADIUS):
        hinge = SHORTEST_HINGE * thick
        root, tip = points[1] + hinge * along, points[1] + (hinge + length) * along
        apart = coal_distance([0, 0, -1], points[1], root, tip, RADIUS, thick)
        assert apart > 0 or degrees > 107.7
    assert (found > 0) == (degrees < 107.45)


def test_links_and_palm_are_seen_beside_above_and_below_its_rim() -> None:
    # The palm is a coal cylinder below z = 0; the far end of the first link, middles and ends of the others.
    found = np.asarray(ca.evalf(clearance.links_and_palm(links(JOINTS), radii(JOINTS), ca.DM(0.5)))).ravel()
    palm, frame = coal.Cylinder(0.5, 10), coal.Transform3s(np.eye(3), np.array([0, 0, -5.0]))
    points = [JOINTS[1], JOINTS[1:3].mean(axis=0), JOINTS[2], JOINTS[2:].mean(axis=0), JOINTS[3]]
    # The last link is thicker, from its joint on.
    thick = [RADIUS, RADIUS, THICK, THICK, THICK]
    for value, point, radius in zip(found, points, thick, strict=True):
        at = coal.Transform3s(np.eye(3), point)
        sphere = coal.Sphere(radius)
        truth = coal.distance(palm, frame, sphere, at, coal.DistanceRequest(), coal.DistanceResult())
        assert value == pytest.approx(truth, abs=1e-5)


def test_links_and_ground_are_heights_along_its_normal() -> None:
    up = np.array([1, 2, 2]) / 3
    found = np.asarray(
        ca.evalf(clearance.links_and_ground(links(JOINTS), radii(JOINTS), ca.DM(up), ca.DM(-0.4)))
    ).ravel()
    np.testing.assert_allclose(found, JOINTS @ up + 0.4 - [RADIUS, RADIUS, THICK, THICK], atol=1e-12)
