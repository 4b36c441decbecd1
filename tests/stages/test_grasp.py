"""The grasp map, least-squares forces and the gate of defuzzification against hand-made grasps and linear programs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.stages.grasp import friction_edges, grasp_map, inward_normals, least_squares_forces, passes_gate
from casadi_hands.stages.model import Model, build_model
from casadi_hands.task import parse_task
from tests.stages.example import everything, project

RANDOM = np.random.default_rng(0)
BALL = """
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {radius: 0.06, position: [0, 0, 0.2], facing: [0, 0, -1]}
motion: [{at: 0, position: [0, 0, 0.1]}, {at: 0.4, position: [0, 0, 0.11]}]
friction: 0.5
fingers:
"""


def ball(*elevations: float) -> Model:
    """Three fingers around a ball at one elevation (degrees), and one for each further elevation of 90."""
    text, names = BALL, iter("abcdefg")
    for elevation in elevations:
        turns = [0.0] if elevation == 90 else [0.0, 120.0, 240.0]
        for turn in turns:
            e, a = np.radians(elevation), np.radians(turn)
            x, y, z = 0.03 * np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
            text += f"  {next(names)}: {{touches: [{x}, {y}, {z}]}}\n"
    return build_model(parse_task(text))


def plan(model: Model, force: np.ndarray, active: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """The same forces (C, 3) at every sample, contacts where the task has them."""
    keyframes, samples = len(model.schedule.keyframes), len(model.schedule.samples)
    flags = np.ones(model.contacts) if active is None else active
    return {
        "point": np.tile(model.patches.reshape(1, -1), (keyframes, 1)),
        "force": np.tile(force.reshape(1, -1), (samples, 1)),
        "activity": np.tile(flags, (keyframes, 1)),
    }


def making(model: Model, wrench: list[float]) -> np.ndarray:
    """Some forces (C, 3), feasible or not, that make a wrench."""
    return (np.linalg.pinv(grasp_map(model.patches)) @ wrench).reshape(-1, 3)


def test_grasp_map_sums_forces_and_torques() -> None:
    points, forces = RANDOM.normal(size=(2, 4, 3))
    wrench = grasp_map(points) @ forces.ravel()
    np.testing.assert_allclose(wrench, np.r_[forces.sum(axis=0), np.cross(points, forces).sum(axis=0)], atol=1e-12)


def test_normals_point_into_the_object() -> None:
    _, model = everything()
    points = model.patches + 0.05 * RANDOM.normal(size=model.patches.shape)
    expected = [-project(p, c)[1] for p, c in zip(points, model.capsules, strict=True)]
    np.testing.assert_allclose(inward_normals(points, model.capsules), expected, atol=1e-12)


def test_edges_are_on_the_cone() -> None:
    normals = Rotation.random(2, rng=RANDOM).apply([0, 0, 1])
    edges = friction_edges(normals, np.array([0.5, 0.8]))
    for normal, mu, span in zip(normals, (0.5, 0.8), np.split(edges, 2, axis=1), strict=True):
        pressing = normal @ span
        across = np.linalg.norm(span - np.outer(normal, pressing), axis=0)
        np.testing.assert_allclose(pressing, 1, atol=1e-12)
        np.testing.assert_allclose(across, mu, atol=1e-12)
        np.testing.assert_allclose(span.mean(axis=1), normal, atol=1e-12)


def test_least_squares_forces_hold_the_weight() -> None:
    _, model = everything()
    turn = Rotation.random(rng=RANDOM)
    forces = least_squares_forces(model, turn.as_matrix())
    assert model.ground is not None
    points = np.vstack([model.patches, model.ground.patch])
    np.testing.assert_allclose(turn.apply(forces).sum(axis=0), -model.gravity, atol=1e-9)
    np.testing.assert_allclose(np.cross(points, forces).sum(axis=0), 0, atol=1e-9)


def test_gate_accepts_force_closure() -> None:
    model = ball(0)
    assert passes_gate(model, plan(model, making(model, [0, 0, 1, 0, 0, 0])))
    # Whatever the planned forces, only their wrench counts: a squeeze can make any.
    assert passes_gate(model, plan(model, making(model, [0.4, -0.8, 2, 0.1, 0.1, -0.2])))


def test_gate_refuses_a_grasp_that_lost_the_rank() -> None:
    model = ball(0)
    forces = making(model, [0, 0, 1, 0, 0, 0])
    assert not passes_gate(model, plan(model, forces, np.array([1, 1, 0])))
    assert not passes_gate(model, plan(model, forces, np.array([1, 0, 0])))


def test_gate_refuses_a_grasp_that_lost_a_contact_it_needs() -> None:
    # Three contacts 40° below the equator push up only (sin 40° > 0.5 cos 40°); pushing down takes the one on top.
    model, top, below = ball(-40, 90), np.array([0, 0, 0, 1]), np.array([1, 1, 1, 0])
    down = np.array([[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, -2.0]])
    assert passes_gate(model, plan(model, down))
    # The wrench is the one that the active contacts are planned to make, so it is planned on those below.
    missing = np.vstack([making(ball(-40), [0, 0, -2, 0, 0, 0]), np.zeros(3)])
    assert np.linalg.matrix_rank(grasp_map(model.patches[:3])) == np.linalg.matrix_rank(grasp_map(model.patches))
    assert not passes_gate(model, plan(model, missing, below))
    up = np.vstack([making(ball(-40), [0, 0, 2, 0, 0, 0]), np.zeros(3)])
    assert passes_gate(model, plan(model, up, below))
    assert not passes_gate(model, plan(model, down, top))


@pytest.mark.parametrize(("friction", "holds"), [(0.2, False), (0.6, True)])
def test_gate_asks_friction_of_a_grasp_from_above(friction: float, holds: bool) -> None:
    # 20° above the equator: to lift, friction must beat tan 20° = 0.36; eight edges lose at most 8 %.
    text = BALL.replace("friction: 0.5", f"friction: {friction}")
    e = np.radians(20)
    for name, turn in zip("abc", (0, 120, 240), strict=True):
        x, y = 0.03 * np.cos(e) * np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn))])
        text += f"  {name}: {{touches: [{x}, {y}, {0.03 * np.sin(e)}]}}\n"
    model = build_model(parse_task(text))
    assert passes_gate(model, plan(model, making(model, [0, 0, 1, 0, 0, 0]))) == holds
