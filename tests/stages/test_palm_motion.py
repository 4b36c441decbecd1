"""What a palm that moves carries, against SciPy's rotations."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.stages.floating import FloatingStage
from casadi_hands.stages.model import Model, build_model
from casadi_hands.stages.object_side import straight_path
from casadi_hands.stages.palm_motion import added_to_spline, goals_seen_from_palm, poses_at
from casadi_hands.task import Task, parse_task
from tests.stages.example import Motion, drawing, everything
from tests.stages.test_model import rotations

CARRIED = """
object: {mass: 0.1, shapes: [{capsule: {start: [0, -0.03, 0], end: [0, 0.03, 0], radius: 0.018}}]}
palm:
  radius: 0.05
  position: [0, 0, 0.12]
  facing: [0, 0, -1]
  motion: [{at: 1, position: [0, 0, 0.2]}, {at: 2.5, position: [0.15, 0, 0.2]}, {at: 3, position: [0.15, 0, 0.15]}]
motion:
  - {at: 0, position: [0, 0, 0.018]}
  - {at: 1, position: [0, 0, 0.098]}
  - {at: 2.5, position: [0.15, 0, 0.098]}
  - {at: 3, position: [0.15, 0, 0.048]}
fingers:
  thumb: {touches: [0.018, 0, 0]}
  index: {touches: [-0.018, 0.02, 0]}
  middle: {touches: [-0.018, -0.02, 0]}
friction: 0.7
"""


def carried() -> tuple[Task, Model]:
    task = parse_task(CARRIED)
    return task, build_model(task)


def seen(model: Model, poses: np.ndarray) -> tuple[np.ndarray, Rotation]:
    """Poses (S, 6) as the palm sees them at the samples."""
    palm = rotations(model.palm_quaternion)
    return palm.inv().apply(poses[:, :3] - model.palm_position), palm.inv() * Rotation.from_rotvec(poses[:, 3:])


def test_what_a_palm_carries_stays_where_it_is_on_it() -> None:
    # The palm of this one turns, too.
    _, model = everything()
    motion = Motion(model, np.zeros((len(model.schedule.keyframes), 6)))
    keyframes = motion.along(model.schedule.keyframes)
    assert np.ptp(keyframes, axis=0).min() > 0.01
    positions, turns = seen(model, poses_at(model, keyframes))
    np.testing.assert_allclose(positions, positions[[0] * len(positions)], atol=1e-9)
    assert np.max((turns[0].inv() * turns).magnitude()) < 1e-9
    for offset in (-1, 1):
        times = model.schedule.samples + offset * model.schedule.step
        np.testing.assert_allclose(poses_at(model, keyframes, offset), motion.along(times), atol=1e-9)


def test_keyframes_are_where_they_are_and_a_palm_that_stands_adds_nothing() -> None:
    _, model = everything()
    poses = np.random.default_rng(0).normal(size=(len(model.schedule.keyframes), 6))
    np.testing.assert_allclose(poses_at(model, poses)[model.schedule.keyframe_samples], poses, atol=1e-12)
    assert np.abs(added_to_spline(model, 0)).max() > 1e-3
    _, standing = drawing()
    assert not added_to_spline(standing, 1).any()


def test_what_is_carried_is_not_accelerated_on_its_palm() -> None:
    task, model = carried()
    stage = FloatingStage(model)
    floating = stage.solve(dict(task.weights.floating))
    positions, turns = seen(model, poses_at(model, floating.pose))
    away = np.linalg.norm(positions - positions[0], axis=1) * model.units.length
    assert away.max() < 5e-4
    assert np.rad2deg(np.max((turns[0].inv() * turns).magnitude())) < 3
    assert floating.solution.terms["object_acceleration"] < 1e-2


@pytest.mark.parametrize("degrees", [120, 270])
def test_an_object_that_turns_with_its_palm_does_not_turn_on_it(degrees: float) -> None:
    turn = math.radians(degrees)
    half = [[math.cos(a), math.sin(a), 0.0] for a in (turn / 2, turn)]
    text = f"""
object: {{mass: 0.1, shapes: [{{sphere: {{center: [0, 0, 0], radius: 0.03}}}}]}}
palm:
  radius: 0.05
  position: [0, 0, 0.3]
  facing: [1, 0, 0]
  up: [0, 0, 1]
  motion:
    - {{at: 1, position: [0, 0, 0.3], facing: {half[0]}}}
    - {{at: 2, position: [0, 0, 0.3], facing: {half[1]}}}
motion:
  - {{at: 0, position: [0.1, 0, 0.3]}}
  - {{at: 1, position: {[0.1 * c for c in half[0][:2]] + [0.3]}, rotation: {{axis: [0, 0, 1], degrees: {degrees / 2}}}}}
  - {{at: 2, position: {[0.1 * c for c in half[1][:2]] + [0.3]}, rotation: {{axis: [0, 0, 1], degrees: {degrees}}}}}
fingers: {{left: {{touches: [0, 0.03, 0]}}, right: {{touches: [0, -0.03, 0]}}}}
"""
    model = build_model(parse_task(text))
    goals = goals_seen_from_palm(model)
    np.testing.assert_allclose(goals, goals[[0] * len(goals)], atol=1e-9)
    straight = straight_path(model)
    np.testing.assert_allclose(straight[-1, 3:], [0, 0, turn], atol=1e-9)
    assert np.all(np.diff(straight[:, 5]) > 0)
    positions, turns = seen(model, poses_at(model, straight))
    np.testing.assert_allclose(positions, positions[[0] * len(positions)], atol=1e-9)
    assert np.max((turns[0].inv() * turns).magnitude()) < 1e-9
