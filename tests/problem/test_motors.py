"""Motors that give as the task says, whatever the load."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from casadi_hands.export.mjcf import scene_mjcf
from casadi_hands.problem.motors import joint_motors
from casadi_hands.task import parse_task
from tests.export.example import TASK, example_hand, example_motion


@pytest.mark.parametrize("more", ["", "gravity: [0, 0, -1.6]\n", "actuator: {torque: 3, speed: 9}\n"])
@pytest.mark.parametrize("mass", ["0.001", "0.1", "20"])
def test_a_motor_is_one_newton_metre_per_radian_stiff_whatever_it_bears(mass: str, more: str) -> None:
    task = parse_task(TASK.replace("mass: 0.1", f"mass: {mass}") + more)
    motors = joint_motors(task, example_hand())
    assert len(motors) == 6
    assert {motor.stiffness for motor in motors} == {1.0}
    # The rotor on its own spring: 200 rad/s.
    assert [(motor.stiffness / motor.armature) ** 0.5 for motor in motors] == pytest.approx([200.0] * 6)
    assert motors == joint_motors(parse_task(TASK), example_hand())


@pytest.mark.parametrize("stiffness", [0.4, 1.0, 30.0])
def test_damping_is_critical_for_what_mujoco_says_a_joint_moves(stiffness: float) -> None:
    task, hand = parse_task(TASK + f"actuator: {{stiffness: {stiffness}}}\n"), example_hand()
    motion = example_motion()
    # Stretched straight out, as at zero angles.
    straight = replace(motion, joint_angles=np.zeros_like(motion.joint_angles))
    model = mujoco.MjModel.from_xml_string(scene_mjcf(task, hand, straight))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for motor, name in zip(joint_motors(task, hand), hand.joint_names, strict=True):
        address, momentum = model.joint(name).dofadr[0], np.zeros(model.nv)
        mujoco.mj_mulM(model, data, momentum, np.eye(model.nv)[address])
        assert motor.stiffness == stiffness
        assert motor.damping == pytest.approx(2 * np.sqrt(stiffness * momentum[address]), rel=1e-9)


def test_damping_that_is_given_is_taken() -> None:
    motors = joint_motors(parse_task(TASK + "actuator: {damping: 0.007}\n"), example_hand())
    assert {(motor.stiffness, motor.damping) for motor in motors} == {(1.0, 0.007)}
