"""Gaits: contacts that let go one after the other while the others hold."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from casadi_hands.problem.model import Model
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.gait import ROLLED, farthest_turn, gait
from casadi_hands.stages.floating.regrasp import FARTHEST
from casadi_hands.stages.object_motion.values import straight_path
from casadi_hands.task import parse_task


def ball(degrees: float, fingers: int = 4, friction: float = 0.7) -> Model:
    """A ball between fingers evenly around it that turns by so much, 22.5° from keyframe to keyframe."""
    goals, low = round(degrees / 90), np.radians(12)
    motion = "".join(
        f"  - {{at: {3 * n}, position: [0, 0, 0.2], rotation: {{axis: [0, 0, 1], degrees: {90 * n}}}}}\n"
        for n in range(goals + 1)
    )
    touched = "".join(
        f"  f{i}: {{touches: [{np.cos(a) * np.cos(low):.5f}, {np.sin(a) * np.cos(low):.5f}, {-np.sin(low):.5f}]}}\n"
        for i, a in enumerate(np.arange(fingers) * 2 * np.pi / fingers)
    )
    return build_model(
        parse_task(f"""
object: {{mass: 500, shapes: [{{sphere: {{center: [0, 0, 0], radius: 1}}}}]}}
palm: {{radius: 1.7, position: [0, 0, 3.5], facing: [0, 0, -1]}}
motion:
{motion.replace("0.2]", "0.5]")}
fingers:
{touched}
friction: {friction}
keyframes_between: 3
""")
    )


def holds(model: Model, points: np.ndarray, gravity: np.ndarray) -> bool:
    """Whether contacts at these points of a unit ball can bear its weight, by a linear programme."""
    columns = []
    for point in points:
        inward = -point / np.linalg.norm(point)
        across = np.linalg.svd(inward[None])[2][1:]
        for angle in np.linspace(0, 2 * np.pi, 16, endpoint=False):
            force = inward + model.friction * (np.cos(angle) * across[0] + np.sin(angle) * across[1])
            columns.append(np.concatenate([force, np.cross(point, force)]))
    # Soft fingertips bear what is left of the moment about their normals.
    for point in points:
        inward = -point / np.linalg.norm(point)
        for sign in (-1, 1):
            columns.append(np.concatenate([inward, np.cross(point, inward) + sign * model.torsion * inward]))
    found = linprog(np.ones(len(columns)), A_eq=np.array(columns).T, b_eq=np.concatenate([-gravity, np.zeros(3)]))
    return bool(found.status == 0)


@pytest.mark.parametrize("degrees", [270, 720])
def test_one_at_a_time_lets_go_and_the_others_hold(degrees: int) -> None:
    model = ball(degrees)
    pose = straight_path(model)
    plan = gait(model, pose)
    assert plan is not None
    assert not plan.asked
    assert plan.lifted.sum(axis=1).max() == 1
    assert not plan.lifted[[0, -2, -1]].any()
    turns = Rotation.from_rotvec(np.outer(pose[:, 5] - pose[0, 5], [0, 0, 1]))
    first = plan.patches[0] / np.linalg.norm(plan.patches[0], axis=1)[:, None]
    for k, turn in enumerate(turns):
        seen = turn.apply(plan.patches[k])
        np.testing.assert_allclose(np.linalg.norm(seen, axis=1), 1, atol=1e-9)
        assert np.arccos(np.clip(np.einsum("ci,ci->c", seen, first), -1, 1)).max() <= FARTHEST + 1e-9
        touching = plan.patches[k][~plan.lifted[k]]
        assert holds(model, touching, turn.inv().apply([0, 0, -1.0]))
    # A contact has not moved but where it was lifted, and each had to be lifted as often as the turn asks for.
    moved = np.any(np.diff(plan.patches, axis=0) != 0, axis=2)
    assert not (moved & ~plan.lifted[:-1]).any()
    assert plan.lifted.sum(axis=0).min() >= np.floor((np.radians(degrees) - FARTHEST) / (FARTHEST + np.radians(75)))


def test_two_fingers_cannot_walk() -> None:
    model = ball(270, fingers=2)
    assert gait(model, straight_path(model)) is None


def test_little_friction_leaves_nobody_to_hold() -> None:
    model = ball(270, fingers=3, friction=0.3)
    assert gait(model, straight_path(model)) is None


def test_turns_of_more_than_one_count() -> None:
    model = ball(720)
    assert farthest_turn(model, straight_path(model)) == pytest.approx(4 * np.pi)
    once = ball(90)
    assert farthest_turn(once, straight_path(once)) == pytest.approx(np.pi / 2)
    assert np.pi < ROLLED < 2 * np.pi


def test_turns_of_more_than_a_round_are_counted_from_the_middle() -> None:
    model = ball(720)
    np.testing.assert_allclose(model.goal_vectors[:, 2], np.radians(np.arange(9) * 90 - 360), atol=1e-9)
    np.testing.assert_allclose(model.goal_vectors[:, :2], 0, atol=1e-12)
    once = ball(270)
    np.testing.assert_allclose(once.goal_vectors[:, 2], np.radians(np.arange(4) * 90), atol=1e-9)
