"""A whole-hand solve of figure 3.6b from its own stages 1 and 2, judged by SciPy and numeric Pinocchio; slow."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.stage import FloatingStage
from casadi_hands.task import Task, load_task
from tests.problem.test_model import rotations
from tests.stages.example import Motion, PinFinger, project, rod, spline_at
from tests.stages.searched import whole_hand_of_two_joints

TASK = Path(__file__).parents[3] / "problems" / "horizontal_translation.yaml"
MILLIMETRE = 1e-3
pytestmark = pytest.mark.slow


@dataclass
class Solved:
    """The stages' results for fingers of two joints each."""

    task: Task
    model: Model
    floating: Floating
    result: WholeHand

    def in_palm(self, sample: int, point: np.ndarray) -> np.ndarray:
        """A point of the object, object frame, seen from the palm; lengths."""
        turn = Rotation.from_rotvec(self.result.vector[sample]) * rotations(self.model.reference)
        in_world = turn.apply(point) + self.result.position[sample]
        palm = rotations(self.result.palm_quaternion[sample])
        return palm.inv().apply(in_world - self.result.palm_position[sample])


@pytest.fixture(scope="module")
def solved() -> Solved:
    task = load_task(TASK)
    model = build_model(task)
    floating = FloatingStage(model).solve(dict(task.weights.floating))
    result = whole_hand_of_two_joints(task, model, floating, trials=5)
    return Solved(task, model, floating, result)


def test_goals_are_kept(solved: Solved) -> None:
    for goal in solved.task.motion:
        sample = int(np.argmin(np.abs(solved.model.schedule.samples - goal.at)))
        error = solved.result.position[sample] * solved.model.units.length - np.array(goal.position)
        assert np.linalg.norm(error) < MILLIMETRE
        turn = Rotation.from_rotvec(solved.result.vector[sample]) * rotations(solved.model.reference)
        assert np.degrees((turn * Rotation.from_rotvec(goal.rotation.vector).inv()).magnitude()) < 1


def test_samples_are_the_splines_of_keyframes(solved: Solved) -> None:
    schedule, result = solved.model.schedule, solved.result
    poses = spline_at(schedule.keyframes, result.solution.values["pose"], schedule.samples)
    np.testing.assert_allclose(np.hstack([result.position, result.vector]), poses, atol=1e-12)
    at_keyframes = [int(np.argmin(np.abs(schedule.samples - time))) for time in schedule.keyframes]
    for angles, finger in zip(result.angles, result.fingers, strict=True):
        np.testing.assert_allclose(angles[at_keyframes], finger.angles, atol=1e-12)


def test_contacts_touch_both_surfaces(solved: Solved) -> None:
    model, result, length = solved.model, solved.result, solved.model.units.length
    for i, (finger, contact) in enumerate(zip(result.fingers, result.contacts, strict=True)):
        tip = np.array([0, 0, 0, 0, 0, finger.lengths[-1], model.link_radius])
        for s in np.flatnonzero(result.active[:, contact]):
            point = result.point[s, contact]
            assert np.linalg.norm(project(point, rod(model.touched[contact]))[0] - point) * length < MILLIMETRE
            chain, rotation = PinFinger(finger, model.link_radius).chain(result.angles[i][s])
            on_link = rotation.T @ (solved.in_palm(s, point) - chain[-2])
            assert np.linalg.norm(project(on_link, tip)[0] - on_link) * length < MILLIMETRE


def test_forces_balance(solved: Solved) -> None:
    model, result = solved.model, solved.result
    motion = Motion(model, result.solution.values["pose"])
    acceleration = motion.acceleration * model.units.length / 9.81
    for s, turn in enumerate(motion.at(0)[1]):
        residual = turn.apply(result.force[s].sum(axis=0)) - [0, 0, 1] - acceleration[s]
        assert np.linalg.norm(residual) < 5e-2


def test_friction_on_the_object_is_kept(solved: Solved) -> None:
    model, result = solved.model, solved.result
    excess = []
    for s, contact in zip(*np.nonzero(result.active), strict=True):
        inward = -project(result.point[s, contact], rod(model.touched[contact]))[1]
        pressing = result.force[s, contact] @ inward
        excess.append(np.linalg.norm(result.force[s, contact] - pressing * inward) - model.friction * pressing)
    assert max(excess) <= 1e-6


def test_joints_keep_their_limits_at_keyframes(solved: Solved) -> None:
    low, high = solved.model.joint_limits
    for finger in solved.result.fingers:
        assert finger.angles.min() >= low - 1e-6
        assert finger.angles.max() <= high + 1e-6
