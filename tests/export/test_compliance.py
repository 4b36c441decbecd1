"""Contacts that give like rubber, as MuJoCo has them."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from casadi_hands.export.compliance import contact_time, link_eases
from casadi_hands.export.mjcf import scene_mjcf
from casadi_hands.problem.inertia import body_inertials
from casadi_hands.problem.motors import joint_motors
from casadi_hands.task import parse_task
from tests.export.example import TASK, example_hand, example_motion, example_task


def pressed(force, shape=(0.0, 1.0, 0.0)):
    """The example's motion, with a force (N) of the first contact at all samples."""
    motion = example_motion()
    forces = np.zeros_like(motion.contact_force)
    forces[:, 0] = force * np.array(shape)
    return replace(motion, contact_force=forces)


def moved(motion):
    """The motion with a palm that is carried along."""
    path = motion.base_position.copy()
    path[:, 0] += np.linspace(0.0, 0.05, len(path))
    return replace(motion, base_position=path)


@pytest.mark.parametrize("moves", [False, True])
def test_links_are_moved_as_easily_as_mujoco_says(moves):
    task, hand, motion = example_task(), example_hand(), example_motion()
    model = mujoco.MjModel.from_xml_string(scene_mjcf(task, hand, moved(motion) if moves else motion))
    eases = link_eases(hand, motion, joint_motors(task, hand), moves)
    assert len(eases) == 6
    for name, ease in eases.items():
        assert ease == pytest.approx(model.body(name).invweight0[0], rel=1e-6)


@pytest.mark.parametrize("force", [0.3, 3.0])
def test_a_pressed_fingertip_gives_by_hertz(force):
    """A ball of the fingertip's radius and mass lies on the object, in a scene with the hand's contacts."""
    task, hand = example_task(), example_hand()
    motion, tip = pressed(force), example_hand().fingers[0].links[-1]
    motors = joint_motors(task, hand)
    time = contact_time(task, hand, motion, motors, False, 0.0)
    scene = mujoco.MjModel.from_xml_string(scene_mjcf(task, hand, motion))
    assert scene.geom_solref[:, 0] == pytest.approx(max(time, 0.002), rel=1e-5)
    ease = link_eases(hand, motion, motors, False)[motion.contact_link[0]] + 1 / task.object.mass
    ball = mujoco.MjModel.from_xml_string(f"""
        <mujoco><option gravity="0 0 {-force * ease}" cone="elliptic" timestep="{time / 20}"/>
          <default><geom solref="{time} 1" solimp="{" ".join(map(str, scene.geom_solimp[0][:3]))}"/></default>
          <worldbody><geom type="plane" size="1 1 1"/>
            <body pos="0 0 {tip.radius}"><freejoint/><geom size="{tip.radius}" mass="{1 / ease}"/></body>
          </worldbody></mujoco>""")
    data = mujoco.MjData(ball)
    for _ in range(4000):
        mujoco.mj_step(ball, data)
    modulus = 3e6 / 0.75
    hertz = np.cbrt(9 * force**2 / (16 * modulus**2 * tip.radius))
    # Deeper contacts are stiffer than barely touching ones, for which the time is set.
    assert 0.6 * hertz < tip.radius - data.qpos[2] < 1.05 * hertz


def test_a_hand_of_one_joint_has_a_link_that_is_moved():
    """One column is one number a row to Pinocchio."""
    whole = example_hand()
    hand = replace(whole, fingers=(replace(whole.fingers[0], links=whole.fingers[0].links[:1]),))
    motion = example_motion()
    motion = replace(motion, joint_names=motion.joint_names[:1], joint_angles=motion.joint_angles[:, :1])
    motors = joint_motors(example_task(), hand)
    eases = link_eases(hand, motion, motors, False)
    assert list(eases) == ["finger0_link0"]
    link = hand.fingers[0].links[0]
    (body,) = (each for name, each in body_inertials(hand).items() if name == "finger0_link0")
    lever = np.cross(link.axis, body.center)
    about = link.axis @ body.inertia @ link.axis + body.mass * lever @ lever + motors[0].armature
    assert eases["finger0_link0"] == pytest.approx(lever @ lever / about / 3, rel=1e-9)


def test_forces_of_other_bodies_and_of_none_count_for_nothing():
    task, hand, motion = example_task(), example_hand(), pressed(0.0)
    motors = joint_motors(task, hand)
    assert contact_time(task, hand, motion, motors, False, 0.002) == pytest.approx(0.01)
    ground = replace(pressed(1.0), contact_link=("ground", *motion.contact_link[1:]))
    assert contact_time(task, hand, ground, motors, False, 0.002) == pytest.approx(0.01)


def test_the_time_step_bounds_how_stiff_contacts_are():
    """A ball of a gram on strong motors asks for more than the step allows."""
    task = parse_task(TASK.replace("mass: 0.1", "mass: 0.0001"))
    hand = example_hand()
    motors = joint_motors(task, hand)
    assert contact_time(task, hand, pressed(50.0), motors, False, 0.002) == 0.002
