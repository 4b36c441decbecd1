"""Motors that share joints, as written: MuJoCo's springs, URDF's mimics, and what readers make of them."""

from __future__ import annotations

import json
from dataclasses import replace
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from casadi_hands.export.commands import commanded
from casadi_hands.export.design import Design
from casadi_hands.export.mjcf import scene_mjcf
from casadi_hands.export.record import design_record, hand_from_record, record_text
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.problem.drive import Drive
from casadi_hands.problem.hand import Hand
from casadi_hands.problem.motion import Motion
from tests.export.example import example_hand, example_motion, example_task

RATIOS = np.array([[1.0, 0.0], [-0.5, 0.0], [0.0, 1.0], [0.0, 0.6], [0.3, -1.2], [0.0, 0.0]])
OFFSETS = (0.1, -1.0, 0.3, -0.4, 0.5, 0.6)  # -1 is what MuJoCo takes for none given


def shared() -> Hand:
    """The example's hand with two motors for its six joints."""
    return replace(example_hand(), drive=Drive(tuple(map(tuple, RATIOS.tolist())), OFFSETS, 3.0, 4.0))


def shared_motion() -> Motion:
    """Its motion with positions of these motors."""
    motion = example_motion()
    positions = np.column_stack([np.sin(motion.time), 1.0 - np.cos(motion.time)])
    return commanded(example_task(), shared(), replace(motion, motor_positions=positions))


def test_commands_are_where_the_motors_turn_the_joints() -> None:
    motion = shared_motion()
    assert motion.motor_positions is not None
    expected = np.array(OFFSETS) + motion.motor_positions @ RATIOS.T
    np.testing.assert_allclose(motion.joint_commands, expected, atol=1e-15)


def test_springs_pull_at_joints_and_as_hard_at_motors(rng: np.random.Generator) -> None:
    task, hand, motion = example_task(), shared(), shared_motion()
    model = mujoco.MjModel.from_xml_string(scene_mjcf(task, hand, motion))
    data = mujoco.MjData(model)
    assert model.nu == 2
    joints = [model.joint(name) for name in hand.joint_names]
    motors = [model.joint(f"motor{m}") for m in range(2)]
    angles, positions = rng.normal(size=6), rng.normal(size=2)
    for joint, angle in zip([*joints, *motors], [*angles, *positions], strict=True):
        data.qpos[joint.qposadr[0]] = angle
    mujoco.mj_forward(model, data)
    torques = task.actuator.stiffness * (np.array(OFFSETS) + RATIOS @ positions - angles)
    found = [data.qfrc_spring[joint.dofadr[0]] for joint in joints]
    np.testing.assert_allclose(found, torques, atol=1e-9)
    np.testing.assert_allclose([data.qfrc_spring[m.dofadr[0]] for m in motors], -RATIOS.T @ torques, atol=1e-9)


def test_motors_go_where_they_are_told_and_joints_to_their_commands() -> None:
    """In the air, with nothing to press on."""
    task, hand, motion = example_task(), shared(), shared_motion()
    model = mujoco.MjModel.from_xml_string(scene_mjcf(task, hand, motion))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    told = np.array([0.2, -0.3])
    for _ in range(1000):
        data.ctrl[:] = told
        mujoco.mj_step(model, data)
    found = [data.qpos[model.joint(name).qposadr[0]] for name in (*hand.joint_names, "motor0", "motor1")]
    np.testing.assert_allclose(found, [*(np.array(OFFSETS) + RATIOS @ told), *told], atol=1e-3)


def test_keyframes_hold_the_motors_at_their_positions() -> None:
    motion = shared_motion()
    model = mujoco.MjModel.from_xml_string(scene_mjcf(example_task(), shared(), motion))
    assert motion.motor_positions is not None
    for key, sample in ((0, 0), (1, 0), (2, 10), (3, 20)):
        np.testing.assert_allclose(model.key_ctrl[key], motion.motor_positions[sample], atol=1e-12)
        at = [model.joint(f"motor{m}").qposadr[0] for m in range(2)]
        np.testing.assert_allclose(model.key_qpos[key][at], motion.motor_positions[sample], atol=1e-12)


def test_joints_of_one_motor_mimic_each_other_and_pinocchio_keeps_them_all(tmp_path) -> None:
    text = hand_urdf(shared())
    mimics = {joint.get("name"): joint.find("mimic") for joint in ElementTree.fromstring(text).findall("joint")}
    leaders = {name: mimic.get("joint") for name, mimic in mimics.items() if mimic is not None}
    assert leaders == {
        "finger0_joint1": "finger0_joint0",
        "finger1_joint1": "finger1_joint0",
        "finger2_joint1": "finger0_joint0",
    }
    commands = dict(zip(shared().joint_names, np.array(OFFSETS) + RATIOS @ [0.7, -0.2], strict=True))
    for name, leader in leaders.items():
        mimic = mimics[name]
        assert mimic is not None
        multiplier, offset = float(mimic.get("multiplier", "1")), float(mimic.get("offset", "0"))
        assert commands[name] == pytest.approx(multiplier * commands[leader] + offset)
    turned = {each.get("name") for each in ElementTree.fromstring(text).findall("transmission/joint")}
    assert turned == set(shared().joint_names) - set(leaders)
    assert pin.buildModelFromXML(text).nq == 6


def test_a_motor_for_every_joint_leaves_the_files_as_they_were() -> None:
    assert "mimic" not in hand_urdf(example_hand())
    scene = scene_mjcf(example_task(), example_hand(), example_motion())
    assert "tendon" not in scene
    assert "motor0" not in scene


def test_the_record_holds_the_motors() -> None:
    design = Design(example_task(), "failed", hand=shared(), motion=shared_motion())
    record = json.loads(record_text(design_record(design)))
    assert record["hand"]["motors"] == 2
    np.testing.assert_array_equal(record["hand"]["ratios"], RATIOS)
    np.testing.assert_array_equal(record["hand"]["offsets"], OFFSETS)
    assert hand_from_record(record) == shared()
    alone = json.loads(record_text(design_record(replace(design, hand=example_hand(), motion=example_motion()))))
    assert alone["hand"]["motors"] == 6
    assert "ratios" not in alone["hand"]
    assert hand_from_record(alone) == example_hand()
