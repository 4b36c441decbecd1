"""An object on its joint, against finite differences, kinetic energy, and SciPy's rotations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.problem.attachment import Attachment
from casadi_hands.problem.model import Model
from casadi_hands.problem.resampling import resampled_model, shortened
from casadi_hands.problem.si import build_model
from casadi_hands.task import parse_task
from tests.task.test_attached import HINGE, SCREW, SLIDER, TEXT

CASES = [(HINGE, "angle: 70"), (SCREW, "angle: -40"), (SLIDER, "distance: 0.02")]


def model(joint: str, goal: str) -> Model:
    return build_model(parse_task(TEXT.format(joint=joint, goal=goal, palm="", first="", more="")))


def held(joint: str, goal: str) -> tuple[Model, Attachment]:
    found = model(joint, goal)
    assert found.attachment is not None
    return found, found.attachment


def placed(of: Model, pose: np.ndarray) -> tuple[np.ndarray, Rotation]:
    return pose[:3], Rotation.from_rotvec(pose[3:]) * Rotation.from_quat(of.reference, scalar_first=True)


@pytest.mark.parametrize(("joint", "goal"), CASES)
def test_rates_are_those_of_the_poses(joint: str, goal: str) -> None:
    of, attachment = held(joint, goal)
    h, q = 1e-6, 0.3
    (before, turn0), (after, turn1) = (placed(of, pose) for pose in attachment.poses(np.array([q - h, q + h])))
    rate = attachment.rates(np.array([q]), np.array([2.0]))[0]
    np.testing.assert_allclose(rate[:3], 2 * (after - before) / (2 * h), atol=1e-7)
    np.testing.assert_allclose(rate[3:], 2 * (turn0.inv() * turn1).as_rotvec() / (2 * h), atol=1e-7)


@pytest.mark.parametrize(("joint", "goal"), CASES)
def test_the_mass_is_that_of_the_kinetic_energy(joint: str, goal: str) -> None:
    of, attachment = held(joint, goal)
    rate = attachment.rates(np.array([0.2]), np.array([1.0]))[0]
    energy = rate[:3] @ rate[:3] / 2 + rate[3:] @ of.inertia @ rate[3:] / 2
    assert attachment.mass / 2 == pytest.approx(energy, rel=1e-9)


@pytest.mark.parametrize(("joint", "goal"), CASES)
def test_goals_and_coordinates_are_each_other_s(joint: str, goal: str) -> None:
    of, attachment = held(joint, goal)
    task = parse_task(TEXT.format(joint=joint, goal=goal, palm="", first="", more=""))
    for pose, given in zip(of.goal_poses, task.motion, strict=True):
        position, turn = placed(of, pose)
        np.testing.assert_allclose(position * of.units.length, given.position, atol=1e-12)
        assert (turn.inv() * Rotation.from_rotvec(given.rotation.vector)).magnitude() < 1e-9
    found = attachment.coordinates(of.goal_positions, of.goal_vectors)
    np.testing.assert_allclose(found, attachment.goals, atol=1e-12)


def test_part_of_the_way_is_on_the_joint() -> None:
    of, attachment = held(HINGE, "angle: 70")
    part = shortened(of, 0.5)
    np.testing.assert_allclose(part.goal_poses, attachment.poses(attachment.goals / 2), atol=1e-15)


def test_what_is_exerted_is_answered_in_every_scenario() -> None:
    more = "perturbations: [{from: 1.5, to: 2, torque: [0, 0.01, 0]}]"
    goal = "distance: 0.01}\n  - {at: 4, distance: 0.02, exert: {force: [0, 0, 2], torque: [0.03, 0, 0]}"
    of = build_model(parse_task(TEXT.format(joint=SLIDER, goal=goal, palm="", first="", more=more)))
    for each in (of, resampled_model(of, of.schedule.halved(np.ones(len(of.schedule.samples) - 1, bool)))):
        share = np.interp(each.schedule.samples, [1.9, 2.0, 4.0, 4.1], [0, 1, 1, 0])
        force, torque = np.array([0, 0, -2]) / of.units.force, np.array([-0.03, 0, 0]) / of.units.torque
        for scenario in each.scenarios:
            np.testing.assert_allclose(scenario.force, np.outer(share, force), atol=1e-12)
        np.testing.assert_allclose(each.scenarios[0].torque, np.outer(share, torque), atol=1e-12)
        assert each.disturbance is not None
        pushed = each.disturbance.torque[:, 1] * of.units.torque
        acts = (each.schedule.samples >= 1.5 - 1e-9) & (each.schedule.samples <= 2.0 + 1e-9)
        np.testing.assert_allclose(pushed[acts], 0.01, rtol=1e-9)
