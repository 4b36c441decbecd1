"""What a palm that moves carries, against SciPy's rotations."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.problem.model import Model
from casadi_hands.problem.palm_motion import added_to_spline, carried_velocity, goals_seen_from_palm, poses_at
from casadi_hands.problem.resampling import on_palm, resampled, resampled_model
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.stage import FloatingStage
from casadi_hands.stages.object_motion.values import straight_path
from casadi_hands.stages.refine.values import Margin
from casadi_hands.task import Task, parse_task
from tests.problem.test_model import rotations
from tests.stages.example import Motion, drawing, everything
from tests.stages.refining import carrying

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
    return seen_by(model.palm_position, model.palm_quaternion, poses)


def seen_by(position: np.ndarray, quaternion: np.ndarray, poses: np.ndarray) -> tuple[np.ndarray, Rotation]:
    """Poses (S, 6) as they are seen from a palm at these positions (S, 3) and quaternions (S, 4)."""
    palm = rotations(quaternion)
    return palm.inv().apply(poses[:, :3] - position), palm.inv() * Rotation.from_rotvec(poses[:, 3:])


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


def test_what_is_carried_has_the_speed_of_its_place_on_the_palm() -> None:
    _, model = everything()
    motion = Motion(model, np.zeros((len(model.schedule.keyframes), 6)))
    step, times = 1e-5, model.schedule.samples[1:-1]
    differences = (motion.along(times + step) - motion.along(times - step))[:, :3] / (2 * step)
    velocity = carried_velocity(model)
    assert np.abs(velocity).max() > 0.3
    np.testing.assert_allclose(velocity[1:-1], differences, atol=1e-4)
    np.testing.assert_allclose(velocity[[0, -1]], 0, atol=1e-6)
    assert not carried_velocity(drawing()[1]).any()


def test_a_palm_s_waypoints_between_goals_are_samples() -> None:
    model = build_model(parse_task(CARRIED.replace("  - {at: 1, position: [0, 0, 0.098]}\n", "")))
    at = np.abs(model.schedule.samples - 1).argmin()
    assert model.schedule.samples[at] == 1
    np.testing.assert_allclose(model.palm_position[at] * model.units.length, [0, 0, 0.2], atol=1e-9)
    assert len(model.schedule.goals) == 3


@pytest.mark.parametrize("task", [carried, everything])  # only the second's palm turns
def test_between_knots_a_palm_goes_its_own_way_and_what_it_carries_goes_along(
    task: Callable[[], tuple[Task, Model]],
) -> None:
    _, model = task()
    fewer, whole = resampled_model(model, model.schedule.stepped(0.4)), carrying().start
    assert len(fewer.schedule.samples) < 0.6 * len(model.schedule.samples)
    assert np.ptp(model.palm_position, axis=0).max() > 0.3
    along = Motion(model, np.zeros((len(model.schedule.keyframes), 6))).along
    there, here = along(fewer.schedule.samples), along(model.schedule.samples)
    # The program adds a constant to the palm's way, and the object goes along with that.
    added, count = np.array([0.1, -0.2, 0.05]), len(there)
    hand = replace(
        whole,
        angles=tuple(np.ones((count, a.shape[1])) for a in whole.angles),
        palm_position=fewer.palm_position + added,
        palm_quaternion=fewer.palm_quaternion,
        position=there[:, :3] + added,
        vector=there[:, 3:],
        point=np.zeros((count, *whole.point.shape[1:])),
        force=np.zeros((count, *whole.force.shape[1:])),
        active=np.ones((count, whole.active.shape[1]), bool),
    )
    closer = resampled(hand, fewer, model)
    np.testing.assert_allclose(closer.palm_position, model.palm_position + added, atol=1e-9)
    np.testing.assert_allclose(closer.position, here[:, :3] + added, atol=1e-9)
    np.testing.assert_allclose(closer.vector, here[:, 3:], atol=1e-9)


def test_a_motion_put_on_another_palm_looks_the_same_from_it() -> None:
    whole = carrying().start
    count = len(whole.position)
    rng = np.random.default_rng(0)
    positions, turns = rng.normal(size=(count, 3)), Rotation.random(count, rng=rng)
    moved = on_palm(whole, positions, turns.as_quat(scalar_first=True))
    for before, after in zip(
        seen_by(whole.palm_position, whole.palm_quaternion, np.hstack([whole.position, whole.vector])),
        seen_by(moved.palm_position, moved.palm_quaternion, np.hstack([moved.position, moved.vector])),
        strict=True,
    ):
        given, found = (each.as_matrix() if isinstance(each, Rotation) else each for each in (before, after))
        np.testing.assert_allclose(found, given, atol=1e-9)
    np.testing.assert_array_equal(moved.palm_position, positions)


def test_refined_motions_are_smooth_as_their_palm_sees_them() -> None:
    made_up = carrying()
    given, model = made_up.stage.given, made_up.model
    parameters = given.parameters(made_up.start, Margin()) | {f"weight.{t}": 1.0 for t in made_up.stage.problem.terms}

    def jerk(velocity: np.ndarray) -> float:
        rate = np.hstack([velocity, np.zeros_like(velocity)])
        return made_up.stage.solver.evaluate(given.start(made_up.start) | {"rate": rate}, parameters)["object_jerk"]

    velocity = carried_velocity(model)
    assert jerk(velocity) < 1e-9
    assert jerk(0 * velocity) > 1


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
