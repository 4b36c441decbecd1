"""Servos of a hand as other readers see them: in the URDF, in MuJoCo's scene, in the page."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from casadi_hands.export.mjcf import scene_mjcf
from casadi_hands.export.page.robot import Robot
from casadi_hands.export.record import design_record, hand_from_record
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.problem.motors import joint_motors
from casadi_hands.task.servos import SERVOS
from tests.export.example import example_design, example_hand, example_motion, example_task


@pytest.mark.parametrize("name", SERVOS)
def test_pinocchio_and_mujoco_see_the_same_masses(name: str) -> None:
    hand = replace(example_hand(), servo=name)
    bare, model = (pin.buildModelFromXML(hand_urdf(each)) for each in (example_hand(), hand))
    scene = mujoco.MjModel.from_xml_string(scene_mjcf(example_task(), hand, example_motion()))
    for i, finger in enumerate(hand.fingers):
        for j in range(len(finger.links)):
            inertia = model.inertias[model.getJointId(f"finger{i}_joint{j}")]
            more = SERVOS[name].mass if j + 1 < len(finger.links) else 0.0
            assert inertia.mass == pytest.approx(bare.inertias[model.getJointId(f"finger{i}_joint{j}")].mass + more)
            body = scene.body(f"finger{i}_link{j}")
            assert body.mass[0] == pytest.approx(inertia.mass)
            assert body.ipos == pytest.approx(inertia.lever, abs=1e-9)
            assert np.sort(body.inertia) == pytest.approx(np.linalg.eigvalsh(inertia.inertia), rel=1e-6)


def test_the_page_draws_a_case_at_every_joint() -> None:
    hand = replace(example_hand(), servo="XL330-M288")
    robot = Robot(hand_urdf(hand))
    cases = [shape for shape in robot.shapes if shape.sides is not None]
    assert len(cases) == hand.degrees_of_freedom
    assert all(case.sides == pytest.approx((0.026, 0.034, 0.020)) for case in cases)
    poses = robot.link_poses({})
    centers = np.array([(poses[case.link] @ case.placement)[:3, 3] for case in cases])
    joints = [poses[name][:3, 3] for name in poses if name != "palm"]
    assert all(np.min(np.linalg.norm(centers - joint, axis=1)) < 1e-9 for joint in joints)
    assert not [shape for shape in Robot(hand_urdf(example_hand())).shapes if shape.sides is not None]


def test_links_with_servos_are_damped_more() -> None:
    bare, heavy = (joint_motors(example_task(), replace(example_hand(), servo=name)) for name in (None, "STS3215"))
    first = 0
    for finger in example_hand().fingers:
        last = first + len(finger.links) - 1
        assert heavy[last] == bare[last]  # the last joint moves no servo
        assert all(heavy[k].damping > bare[k].damping for k in range(first, last))
        first = last + 1


def test_the_record_keeps_the_servo() -> None:
    for name in (None, "SG90"):
        hand = replace(example_hand(), servo=name)
        record = design_record(replace(example_design(), hand=hand))
        assert record["hand"].get("servo") == name
        assert hand_from_record(record) == hand
