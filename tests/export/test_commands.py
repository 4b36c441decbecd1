"""Velocities, torques and commands of joints against numeric Pinocchio, cubics, and the motors that MuJoCo loads."""

from dataclasses import fields, replace
from itertools import pairwise

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.export.commands import commanded, joint_torques, joint_velocities
from casadi_hands.export.mjcf import scene_mjcf
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.problem.motion import Motion
from tests.export.example import example_hand, example_motion, example_task
from tests.export.test_urdf import chain, odd_hand

SAMPLES = 9


def random_motion(hand, links) -> Motion:
    """A motion in which nothing fits: palm, joints and contacts on the named links at random."""
    rng, contacts = np.random.default_rng(3), len(links)
    turns = Rotation.random(2 * SAMPLES, rng=rng).as_quat(scalar_first=True)
    return Motion(
        time=np.linspace(0.0, 1.0, SAMPLES),
        object_position=rng.normal(size=(SAMPLES, 3)),
        object_orientation=turns[:SAMPLES],
        base_position=rng.normal(size=(SAMPLES, 3)),
        base_orientation=turns[SAMPLES:],
        joint_angles=rng.uniform(-1, 1, (SAMPLES, hand.degrees_of_freedom)),
        joint_names=hand.joint_names,
        contact_names=tuple(f"contact{c}" for c in range(contacts)),
        contact_link=tuple(links),
        contact_active=np.ones((SAMPLES, contacts), dtype=bool),
        contact_force=rng.normal(size=(SAMPLES, contacts, 3)),
        contact_point_object=rng.normal(size=(SAMPLES, contacts, 3)),
        contact_point_link=rng.normal(scale=0.05, size=(SAMPLES, contacts, 3)),
        external_force=np.zeros((SAMPLES, 3)),
        external_torque=np.zeros((SAMPLES, 3)),
    )


def pinocchio_torques(hand, motion):
    """J^T f of every contact, with the forces turned from the world into the palm, where the model stands."""
    model = pin.buildModelFromXML(hand_urdf(hand))
    data, torques = model.createData(), np.zeros_like(motion.joint_angles)
    columns = [model.joints[model.getJointId(name)].idx_v for name in motion.joint_names]
    for s in range(len(motion.time)):
        configuration = np.zeros(model.nq)
        configuration[columns] = motion.joint_angles[s]
        pin.computeJointJacobians(model, data, configuration)
        pin.updateFramePlacements(model, data)
        palm = pin.Quaternion(*motion.base_orientation[s]).matrix()
        for c, link in enumerate(motion.contact_link):
            if link == "ground":
                continue
            frame = model.getFrameId(link)
            jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            arm = data.oMf[frame].rotation @ motion.contact_point_link[s, c]
            point = jacobian[:3] - pin.skew(arm) @ jacobian[3:]
            torques[s] += (point.T @ palm.T @ motion.contact_force[s, c])[columns]
    return torques


@pytest.mark.parametrize(
    "links",
    [
        ["finger0_link2"],
        ["finger0_link2", "finger1_link0", "finger2_link1"],
        ["finger0_link1", "finger2_link0", "ground"],  # on links that others hang on
        ["finger2_link1", "finger2_link1"],
    ],
)
def test_torques_are_the_transposed_jacobians_times_the_forces(links):
    hand = odd_hand()
    motion = random_motion(hand, links)
    found = joint_torques(hand, motion)
    assert np.abs(found).max() > 0.01
    np.testing.assert_allclose(found, pinocchio_torques(hand, motion), atol=1e-12)


def test_torques_of_bent_fingers_do_the_forces_virtual_work():
    """Where one joint turns a little, its torque's work is that of the forces on the way that their points go."""
    hand, links = odd_hand(), ["finger0_link2", "finger1_link0", "finger2_link1"]
    motion, h = random_motion(hand, links), 1e-6
    found = joint_torques(hand, motion)

    def points(s, angles):
        palm = Rotation.from_quat(motion.base_orientation[s], scalar_first=True)
        poses = [chain(hand, angles)[link] for link in links]
        on_link = motion.contact_point_link[s]
        return [palm.apply(at + turn @ point) for (turn, at), point in zip(poses, on_link, strict=True)]

    for s in range(SAMPLES):
        for j, step in enumerate(h * np.eye(6)):
            ahead, behind = (points(s, motion.joint_angles[s] + sign * step) for sign in (1, -1))
            work = ((np.array(ahead) - behind) * motion.contact_force[s]).sum()
            assert found[s, j] == pytest.approx(work / (2 * h), abs=1e-9)


def test_torques_of_the_example_squeeze_and_lift():
    hand, motion = example_hand(), example_motion()
    np.testing.assert_allclose(joint_torques(hand, motion), pinocchio_torques(hand, motion), atol=1e-12)


# Velocities.

TIME = np.linspace(0.0, 1.0, 21)


def still_motion(angles, active=None) -> Motion:
    """The example's fingers with given angles; contacts act throughout or where told."""
    active = np.ones((len(TIME), 3), dtype=bool) if active is None else active
    return replace(example_motion(), time=TIME, joint_angles=angles, contact_active=active)


def swinging(time):
    """Six angles that rest at 0 s and 1 s."""
    return 0.4 * np.sin(np.pi * time[:, None] / 2 + np.arange(6)) * (1 - np.cos(2 * np.pi * time[:, None]))


def test_velocities_are_the_angles_slopes_and_the_motion_rests_at_its_ends():
    found = joint_velocities(still_motion(swinging(TIME)))
    np.testing.assert_allclose(found[[0, -1]], 0, atol=1e-12)
    assert np.abs(found).max() > 1
    slopes = (swinging(TIME + 1e-6) - swinging(TIME - 1e-6)) / 2e-6
    np.testing.assert_allclose(found, slopes, atol=2e-3)


def test_where_its_contact_switches_a_finger_may_turn_abruptly():
    # Two cubics that meet with a kink, at rest at the ends: each of two splines is its cubic.
    switch = 8
    first = TIME**2 * (3 - TIME)
    kink = TIME[switch]
    second = first[switch] + 2 * ((1 - TIME) ** 3 - (1 - kink) ** 3)
    before = np.arange(len(TIME)) < switch
    bent = np.where(before, first, second)
    slopes = np.where(before, 6 * TIME - 3 * TIME**2, -6 * (1 - TIME) ** 2)
    assert abs((6 * kink - 3 * kink**2) - slopes[switch]) > 1
    active = np.ones((len(TIME), 3), dtype=bool)
    active[switch:, 1] = False
    found = joint_velocities(still_motion(np.tile(bent[:, None], 6), active))
    # The velocity at the switch is that of what follows.
    np.testing.assert_allclose(found[:, 2:4], np.tile(slopes[:, None], 2), atol=1e-9)
    # Fingers whose contacts go on turn smoothly, here past the kink.
    others = found[:, [0, 1, 4, 5]]
    assert np.abs(others[switch - 1 : switch + 1] - slopes[switch - 1 : switch + 1, None]).min() > 0.1


@pytest.mark.parametrize("lifted", [slice(8, 9), slice(8, 10), slice(1, 2), slice(19, 20), slice(20, 21), slice(0, 1)])
def test_a_contact_that_switches_twice_in_a_row_or_at_an_end_leaves_slopes(lifted):
    # Angles along one line: whatever is between two switches has that slope. The ends rest.
    active = np.ones((len(TIME), 3), dtype=bool)
    active[lifted, 0] = False
    found = joint_velocities(still_motion(np.tile(0.5 * TIME[:, None], 6), active))
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found[[0, -1]], 0, atol=1e-12)
    switches = [k for k in (lifted.start, lifted.stop) if 0 < k < 20]
    for one, other in pairwise(switches):
        np.testing.assert_allclose(found[one:other, :2], 0.5, atol=1e-9)


# Commands.


@pytest.mark.parametrize("palm_shift", [(0.0, 0.0, 0.0), (0.0, 0.02, 0.05)])
def test_motors_told_the_commands_exert_the_planned_torques_on_the_planned_motion(palm_shift):
    task, hand = example_task(), example_hand()
    motion = commanded(task, hand, example_motion(palm_shift))
    model = mujoco.MjModel.from_xml_string(scene_mjcf(task, hand, motion))
    stiffness, damping = model.actuator_gainprm[:, 0], -model.actuator_biasprm[:, 2]
    assert (damping > 0).all()
    expected = motion.joint_angles + (motion.joint_torques + damping * motion.joint_velocities) / stiffness
    np.testing.assert_allclose(motion.joint_commands, expected, atol=1e-12)
    assert np.abs(motion.joint_commands - motion.joint_angles).max() > 1e-3
    data = mujoco.MjData(model)
    for k in range(len(motion.time)):
        for j, name in enumerate(motion.joint_names):
            data.joint(name).qpos, data.joint(name).qvel = motion.joint_angles[k, j], motion.joint_velocities[k, j]
            data.ctrl[model.actuator(name).id] = motion.joint_commands[k, j]
        mujoco.mj_forward(model, data)
        exerted = [data.actuator_force[model.actuator(name).id] for name in motion.joint_names]
        np.testing.assert_allclose(exerted, motion.joint_torques[k], atol=1e-9)


def test_nothing_else_of_the_motion_changes():
    motion = example_motion()
    found = commanded(example_task(), example_hand(), motion)
    for item in fields(Motion):
        if item.name not in ("joint_velocities", "joint_torques", "joint_commands"):
            assert getattr(found, item.name) is getattr(motion, item.name)
    assert motion.joint_commands is None
