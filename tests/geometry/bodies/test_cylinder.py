"""Cylinders: coal measures the core, swept by hand; symbols against numbers; inertia by coal; a can in a task file."""

from __future__ import annotations

import casadi as ca
import coal
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.errors import TaskError
from casadi_hands.geometry.bodies import KINDS
from casadi_hands.geometry.bodies.capsule import Segment
from casadi_hands.geometry.bodies.cylinder import Cylinder
from casadi_hands.geometry.pairs import core_distance
from casadi_hands.task import parse_task
from tests.stages.synthesis.example import BALL

CAN = Cylinder(np.array([0.1, -0.2, -0.7]), np.array([0.3, 0.4, 0.6]), 0.5, 0.05)


def core() -> tuple[coal.Cylinder, coal.Transform3s]:
    """The core, for coal."""
    axis = CAN.helper
    turn = Rotation.align_vectors([axis], [[0, 0, 1]])[0].as_matrix()
    length = float(np.linalg.norm(CAN.end - CAN.start))
    return coal.Cylinder(CAN.radius - CAN.edge_radius, length - 2 * CAN.edge_radius), coal.Transform3s(
        turn, CAN.centroid
    )


def coal_distance(shape: object, placed: coal.Transform3s) -> float:
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = True
    return float(coal.distance(*core(), shape, placed, request, result))


def test_distances_of_points_are_those_of_coal(rng: np.random.Generator) -> None:
    tiny = 1e-7
    for point in rng.uniform(-1.3, 1.3, (200, 3)):
        found = coal_distance(coal.Sphere(tiny), coal.Transform3s(np.eye(3), point)) + tiny
        if found > 1e-3:
            assert CAN.signed_distance(point) == pytest.approx(found - CAN.edge_radius, abs=2e-5)
        else:  # coal's depths are rough; within, the nearer of face and side counts
            height = abs((point - CAN.centroid) @ CAN.helper)
            side = np.linalg.norm(np.cross(point - CAN.centroid, CAN.helper)) - CAN.radius
            face = height - np.linalg.norm(CAN.end - CAN.start) / 2
            if max(side, face) < -CAN.edge_radius:
                assert CAN.signed_distance(point) == pytest.approx(max(side, face))


def test_symbols_measure_what_numbers_do(rng: np.random.Generator) -> None:
    point = ca.SX.sym("point", 3)
    distance, normal = Cylinder.surface(ca.SX(CAN.parameters)).distance_and_normal(point, 1e-6)
    measured = ca.Function("measured", [point], [distance, normal])
    slope = ca.Function("slope", [point], [ca.gradient(distance, point), ca.hessian(distance, point)[0]])
    for at in rng.uniform(-1.3, 1.3, (200, 3)):
        found, outward = (np.asarray(value).ravel() for value in measured(at))
        assert found[0] == pytest.approx(CAN.signed_distance(at), abs=2e-3)
        if found[0] > 0.02:
            assert outward @ CAN.outward(at) > 0.999
            np.testing.assert_allclose(np.asarray(slope(at)[0]).ravel(), outward, atol=0.02)
        assert np.isfinite(np.asarray(slope(at)[1])).all()


def test_a_point_is_moved_onto_the_surface_along_its_normal(rng: np.random.Generator) -> None:
    for point in rng.uniform(-1, 1, (100, 3)):
        on = CAN.on_surface(point)
        assert CAN.signed_distance(on) == pytest.approx(0, abs=1e-12)
        assert np.linalg.norm(on - point) == pytest.approx(abs(CAN.signed_distance(point)))
    middle = (CAN.start + CAN.end) / 2
    assert not CAN.has_normal(middle + (CAN.radius - 0.6) * CAN.helper) or CAN.has_normal(CAN.start)


def test_its_farthest_points_are_those_of_many_on_its_surface(rng: np.random.Generator) -> None:
    turn = Rotation.align_vectors([CAN.helper], [[0, 0, 1]])[0]
    angle = np.linspace(0, 2 * np.pi, 721)[:, None]
    rim = turn.apply(np.hstack([np.cos(angle), np.sin(angle), 0 * angle])) * (CAN.radius - CAN.edge_radius)
    faces = np.array([CAN.start + CAN.edge_radius * CAN.helper, CAN.end - CAN.edge_radius * CAN.helper])
    points = np.vstack([face + rim for face in faces])
    for direction in rng.normal(size=(50, 3)):
        assert (CAN.support(direction) @ direction).max() == pytest.approx((points @ direction).max(), abs=1e-4)
    lower, upper = CAN.bounding_box
    np.testing.assert_allclose(lower, points.min(axis=0) - CAN.edge_radius, atol=1e-4)
    np.testing.assert_allclose(upper, points.max(axis=0) + CAN.edge_radius, atol=1e-4)


def test_mass_properties_are_those_of_coal() -> None:
    length = float(np.linalg.norm(CAN.end - CAN.start))
    whole = coal.Cylinder(CAN.radius, length)
    assert CAN.volume == pytest.approx(whole.computeVolume())
    turn = Rotation.align_vectors([CAN.helper], [[0, 0, 1]])[0].as_matrix()
    expected = turn @ whole.computeMomentofInertia() @ turn.T / whole.computeVolume()
    np.testing.assert_allclose(CAN.unit_inertia, expected, atol=1e-12)


def test_the_distance_of_a_link_is_that_of_coal(rng: np.random.Generator) -> None:
    ends = [ca.SX.sym(name, 3) for name in ("start", "end")]
    surface = Cylinder.surface(ca.SX(CAN.parameters))
    distance = ca.Function("distance", ends, [core_distance(Segment(*ends), surface.core)])
    missed = []
    for start, end in rng.uniform(-2, 2, (300, 2, 3)):
        length = np.linalg.norm(end - start)
        turn = Rotation.align_vectors([(end - start) / length], [[0, 0, 1]])[0].as_matrix()
        found = coal_distance(coal.Capsule(1e-6, length), coal.Transform3s(turn, (start + end) / 2)) + 1e-6
        if found > 0.05:
            missed.append(float(distance(start, end)) - found)
    # Hardly off by more than the rounding of corners.
    assert min(missed) > -2e-3
    assert np.quantile(missed, 0.98) < 2e-3
    assert max(missed) < 1e-2


def test_a_task_file_gives_a_can() -> None:
    ball = "sphere: {center: [0, 0, 0], radius: 0.03}"
    can = "cylinder: {start: [0, 0, -0.02], end: [0, 0, 0.02], radius: 0.03}"
    (shape,) = parse_task(BALL.replace(ball, can)).object.shapes
    assert type(shape.body) is KINDS["cylinder"] is Cylinder
    assert shape.edge_radius == pytest.approx(0.001)
    for wrong, allowed in (
        (can.replace("0.02]", "-0.02]").replace("--", "-"), "two faces apart from each other"),
        (can.replace("radius: 0.03", "radius: 0.03, edge_radius: 0.02"), "an edge_radius smaller than"),
    ):
        with pytest.raises(TaskError, match=allowed):
            parse_task(BALL.replace(ball, wrong))
