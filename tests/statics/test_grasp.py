"""The grasp map, least-squares forces and the gate of defuzzification against hand-made grasps and linear programs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.geometry.contact_points import inward_normals
from casadi_hands.problem.model import Model
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.gate import least_squares_forces, needed_wrenches, passes_gate
from casadi_hands.statics.grasp import friction_edges, grasp_map
from casadi_hands.task import parse_task
from tests.stages.example import Motion, everything, made_up_values, project, rod

BALL = """
object: {{mass: 0.1, shapes: [{{sphere: {{center: [0, 0, 0], radius: 0.03}}}}]}}
palm: {{radius: 0.06, position: [0, 0, 0.2], facing: [0, 0, -1]}}
motion: [{{at: 0, position: [0, 0, 0.1]}}, {{at: 0.4, position: [0, 0, 0.11]}}]
friction: {friction}
gravity: [0, 0, {gravity}]
fingers:
"""


def ball(*elevations: float, gravity: float = -9.81, friction: float = 0.5) -> Model:
    """Three fingers around a ball at one elevation (degrees), and one for each further elevation of 90."""
    text, names = BALL.format(gravity=gravity, friction=friction), iter("abcdefg")
    for elevation in elevations:
        turns = [0.0] if elevation == 90 else [0.0, 120.0, 240.0]
        for turn in turns:
            e, a = np.radians(elevation), np.radians(turn)
            x, y, z = 0.03 * np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
            text += f"  {next(names)}: {{touches: [{x}, {y}, {z}]}}\n"
    return build_model(parse_task(text))


def plan(model: Model, *active: int, pose: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """Contacts where the task has them, with these flags (1 by default); the object stands still but for ``pose``."""
    keyframes = len(model.schedule.keyframes)
    return {
        "pose": np.zeros((keyframes, 6)) if pose is None else pose,
        "point": np.tile(model.patches.reshape(1, -1), (keyframes, 1)),
        "invariant": np.tile(active or np.ones(model.contacts), (keyframes, 1)),
    }


def falling(model: Model, gravities: float) -> np.ndarray:
    """Poses (N, 6) of an object that is pulled down with some times the acceleration of gravity, and caught."""
    pose = np.zeros((len(model.schedule.keyframes), 6))
    pose[:, 2] = -gravities / model.units.inertial * model.schedule.keyframes**2 / 2
    return pose


def test_grasp_map_sums_forces_and_torques(rng: np.random.Generator) -> None:
    points, forces = rng.normal(size=(2, 4, 3))
    wrench = grasp_map(points) @ forces.ravel()
    np.testing.assert_allclose(wrench, np.r_[forces.sum(axis=0), np.cross(points, forces).sum(axis=0)], atol=1e-12)


def test_normals_point_into_the_object(rng: np.random.Generator) -> None:
    _, model = everything()
    points = model.patches + 0.05 * rng.normal(size=model.patches.shape)
    expected = [-project(p, rod(body))[1] for p, body in zip(points, model.touched, strict=True)]
    np.testing.assert_allclose(inward_normals(points, model.touched), expected, atol=1e-12)


def test_edges_are_on_the_cone(rng: np.random.Generator) -> None:
    normals = Rotation.random(2, rng=rng).apply([0, 0, 1])
    edges = friction_edges(normals, np.array([0.5, 0.8]))
    for normal, mu, span in zip(normals, (0.5, 0.8), np.split(edges, 2, axis=1), strict=True):
        pressing = normal @ span
        across = np.linalg.norm(span - np.outer(normal, pressing), axis=0)
        np.testing.assert_allclose(pressing, 1, atol=1e-12)
        np.testing.assert_allclose(across, mu, atol=1e-12)
        np.testing.assert_allclose(span.mean(axis=1), normal, atol=1e-12)


def test_least_squares_forces_hold_the_weight(rng: np.random.Generator) -> None:
    _, model = everything()
    turn = Rotation.random(rng=rng)
    forces = least_squares_forces(model, turn.as_matrix())
    assert model.ground is not None
    points = model.patches
    np.testing.assert_allclose(turn.apply(forces).sum(axis=0), -model.gravity, atol=1e-9)
    np.testing.assert_allclose(np.cross(points, forces).sum(axis=0), 0, atol=1e-9)


def test_needed_wrench_is_that_of_newton_and_euler() -> None:
    # Against SciPy's splines and rotations; spins by quaternions there, by logarithms here, apart by (turn a step)².
    _, model = everything()
    pose = 0.3 * made_up_values(model)["pose"]
    motion = Motion(model, pose)
    at = [int(np.argmin(np.abs(model.schedule.samples - time))) for time in model.schedule.keyframes]
    wrenches = needed_wrenches(model, pose)
    for wrench, s in zip(wrenches, at, strict=True):
        turn = motion.at(0)[1][s]
        force = turn.inv().apply(model.units.inertial * motion.acceleration[s] - model.gravity)
        np.testing.assert_allclose(wrench[:3], force, atol=1e-9)
    torques = motion.inertial_torque[at]
    assert np.abs(torques).max() > 1e-3
    assert np.abs(wrenches[:, 3:] - torques).max() < 0.02 * np.abs(torques).max()


def test_needed_torque_about_one_axis_is_inertia_times_angular_acceleration() -> None:
    model = ball(0)
    keyframes = model.schedule.keyframes
    pose = np.zeros((len(keyframes), 6))
    pose[:, 4] = 3.0 * keyframes**2
    at = np.searchsorted(model.schedule.samples, keyframes - 1e-9)
    alpha = Motion(model, np.roll(pose, -3, axis=1)).acceleration[at, 1]
    expected = model.units.inertial * 0.4 * alpha  # a ball's inertia is 2/5 m r²
    np.testing.assert_allclose(needed_wrenches(model, pose)[:, 4], expected, atol=1e-9)
    assert np.abs(expected).max() > 1e-3


def test_gate_accepts_force_closure(rng: np.random.Generator) -> None:
    model = ball(0)
    assert passes_gate(model, plan(model))
    # Three contacts around the equator can make any wrench, so any motion will do, and any gravity.
    random = 0.5 * rng.normal(size=(len(model.schedule.keyframes), 6))
    assert passes_gate(model, plan(model, pose=random))
    upward = ball(0, gravity=9.81)
    assert passes_gate(upward, plan(upward))


def test_gate_refuses_a_grasp_that_lost_the_rank() -> None:
    model = ball(0)
    assert not passes_gate(model, plan(model, 1, 1, 0))
    assert not passes_gate(model, plan(model, 1, 0, 0))


def test_gate_refuses_a_grasp_that_lost_a_contact_it_needs() -> None:
    # Three contacts 40° below the equator push up only (sin 40° > 0.5 cos 40°); pushing down takes the one on top.
    model, upward = ball(-40, 90), ball(-40, 90, gravity=9.81)
    below, top = (1, 1, 1, 0), (0, 0, 0, 1)
    assert np.linalg.matrix_rank(grasp_map(model.patches[:3])) == np.linalg.matrix_rank(grasp_map(model.patches))
    assert passes_gate(model, plan(model, *below))
    assert not passes_gate(model, plan(model, *top))
    assert passes_gate(upward, plan(upward))
    assert not passes_gate(upward, plan(upward, *below))


@pytest.mark.parametrize(("gravities", "holds"), [(0.5, True), (3.0, False)])
def test_gate_sees_the_motion(gravities: float, holds: bool) -> None:
    # Contacts from below can let an object fall, but not faster than it falls by itself.
    model = ball(-40, 90)
    pose = falling(model, gravities)
    assert passes_gate(model, plan(model, 1, 1, 1, 0, pose=pose)) == holds
    assert passes_gate(model, plan(model, pose=pose))


@pytest.mark.parametrize(("friction", "holds"), [(0.2, False), (0.6, True)])
def test_gate_asks_friction_of_a_grasp_from_above(friction: float, holds: bool) -> None:
    # 20° above the equator: to lift, friction must beat tan 20° = 0.36; eight edges lose at most 8 %.
    model = ball(20, friction=friction)
    assert passes_gate(model, plan(model)) == holds
