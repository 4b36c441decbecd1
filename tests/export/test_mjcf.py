"""The scene as MuJoCo loads it."""

from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from casadi_hands.export.commands import commanded
from casadi_hands.export.mjcf import scene_mjcf
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.task import parse_task
from tests.export.example import TASK, example_hand, example_motion, example_task
from tests.export.test_urdf import chain, odd_hand


def scene(task=None, motion=None):
    return mujoco.MjModel.from_xml_string(
        scene_mjcf(task or example_task(), example_hand(), motion or example_motion())
    )


def start(model):
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    return data


def names(model, kind, count):
    return {mujoco.mj_id2name(model, kind, k) for k in range(count)}


def test_names_are_those_of_the_urdf():
    model = scene()
    links = {f"finger{i}_link{j}" for i in range(3) for j in range(2)}
    joints = set(example_hand().joint_names)
    assert names(model, mujoco.mjtObj.mjOBJ_BODY, model.nbody) == {"world", "palm", "object"} | links
    assert names(model, mujoco.mjtObj.mjOBJ_JOINT, model.njnt) == joints | {"object"}
    assert names(model, mujoco.mjtObj.mjOBJ_ACTUATOR, model.nu) == joints
    assert model.joint("object").type[0] == mujoco.mjtJoint.mjJNT_FREE


def test_masses_and_inertias_agree_with_urdf_and_task():
    model, task = scene(), example_task()
    hand = pin.buildModelFromXML(hand_urdf(example_hand()))
    for i in range(3):
        for j in range(2):
            body, other = model.body(f"finger{i}_link{j}"), hand.inertias[hand.getJointId(f"finger{i}_joint{j}")]
            assert body.mass[0] == pytest.approx(other.mass, rel=1e-12)
            assert body.ipos == pytest.approx(other.lever, abs=1e-12)
            assert sorted(body.inertia) == pytest.approx(sorted(np.diag(other.inertia)), rel=1e-9)
    assert model.body("palm").mass[0] == pytest.approx(hand.inertias[0].mass, rel=1e-12)
    assert model.body("object").mass[0] == pytest.approx(task.object.mass)
    principal = np.linalg.eigvalsh(np.array(task.object.inertia))
    assert sorted(model.body("object").inertia) == pytest.approx(sorted(principal), rel=1e-9)


@pytest.mark.parametrize("reset", [True, False])
def test_the_start_is_the_motions_first_sample(reset):
    # Whether the keyframe is asked for or the scene just loaded.
    model, motion = scene(), example_motion()
    data = start(model) if reset else mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    assert data.body("object").xpos == pytest.approx(motion.object_position[0])
    assert data.body("palm").xpos == pytest.approx(motion.base_position[0])
    assert data.body("palm").xmat.reshape(3, 3)[:, 2] == pytest.approx([1, 0, 0], abs=1e-12)
    for k, name in enumerate(motion.joint_names):
        assert data.joint(name).qpos[0] == motion.joint_angles[0, k]
    for c, link in enumerate(motion.contact_link):
        world = data.body(link).xpos + data.body(link).xmat.reshape(3, 3) @ motion.contact_point_link[0, c]
        assert world == pytest.approx(motion.object_position[0] + motion.contact_point_object[0, c], abs=1e-9)


def test_bodies_stand_at_the_start_as_in_the_urdf():
    hand, motion = odd_hand(), example_motion()
    angles = np.random.default_rng(2).uniform(-1, 1, (len(motion.time), 6))
    motion = replace(motion, joint_angles=angles, joint_names=hand.joint_names, contact_link=("finger0_link0",) * 3)
    model = mujoco.MjModel.from_xml_string(scene_mjcf(example_task(), hand, motion))
    data = mujoco.MjData(model)
    urdf = pin.buildModelFromXML(hand_urdf(hand))
    other = urdf.createData()
    palm = pin.SE3(pin.Quaternion(*motion.base_orientation[0]), motion.base_position[0])
    # As loaded, and wherever the joints turn then: the axes are the URDF's too.
    for row in (None, angles[0], angles[1]):
        if row is not None:
            for name, angle in zip(hand.joint_names, row, strict=True):
                data.joint(name).qpos = angle
        mujoco.mj_kinematics(model, data)
        configuration = pin.neutral(urdf)
        for name, angle in zip(hand.joint_names, angles[0] if row is None else row, strict=True):
            configuration[urdf.joints[urdf.getJointId(name)].idx_q] = angle
        pin.framesForwardKinematics(urdf, other, configuration)
        for i, finger in enumerate(hand.fingers):
            for j in range(len(finger.links)):
                pose = palm * other.oMf[urdf.getFrameId(f"finger{i}_link{j}")]
                body = data.body(f"finger{i}_link{j}")
                assert body.xpos == pytest.approx(pose.translation, abs=1e-12)
                assert body.xmat.reshape(3, 3) == pytest.approx(pose.rotation, abs=1e-12)


def test_bent_links_stand_in_the_scene_as_written_out_by_hand():
    hand, motion = odd_hand(), example_motion()
    angles = np.random.default_rng(2).uniform(-1, 1, (len(motion.time), 6))
    motion = replace(motion, joint_angles=angles, joint_names=hand.joint_names, contact_link=("finger0_link0",) * 3)
    model = mujoco.MjModel.from_xml_string(scene_mjcf(example_task(), hand, motion))
    data = mujoco.MjData(model)
    palm = pin.SE3(pin.Quaternion(*motion.base_orientation[0]), motion.base_position[0])
    for row in angles[[0, 7]]:
        for name, angle in zip(hand.joint_names, row, strict=True):
            data.joint(name).qpos = angle
        mujoco.mj_kinematics(model, data)
        for name, (rotation, position) in chain(hand, row).items():
            assert data.body(name).xpos == pytest.approx(palm.act(position), abs=1e-12)
            assert data.body(name).xmat.reshape(3, 3) == pytest.approx(palm.rotation @ rotation, abs=1e-12)


def test_loaded_and_not_reset_no_finger_is_in_the_object():
    model = scene()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    item, apart = model.geom("object0").id, np.zeros(6)
    for i in range(3):
        first, last = (
            mujoco.mj_geomDistance(model, data, model.geom(f"finger{i}_link{j}").id, item, 1.0, apart) for j in range(2)
        )
        assert first > 0.01
        assert last == pytest.approx(0, abs=1e-4)
    assert all(contact.dist > -1e-4 for contact in data.contact)


@pytest.mark.parametrize("palm_shift", [(0.0, 0.0, 0.0), (0.0, 0.02, 0.05)])
def test_keyframes_are_the_start_and_the_goals(palm_shift):
    task, hand = example_task(), example_hand()
    motion = commanded(task, hand, example_motion(palm_shift))
    model = scene(motion=example_motion(palm_shift))  # given its commands on the way
    assert [model.key(k).name for k in range(model.nkey)] == ["start", "goal1", "goal2", "goal3"]
    data = mujoco.MjData(model)
    for name, sample in (("start", 0), ("goal1", 0), ("goal2", 10), ("goal3", 20)):
        mujoco.mj_resetDataKeyframe(model, data, model.key(name).id)
        assert data.time == motion.time[sample]
        mujoco.mj_kinematics(model, data)
        for body, place in (("object", "object"), ("palm", "base")):
            assert data.body(body).xpos == pytest.approx(getattr(motion, f"{place}_position")[sample], abs=1e-12)
            turn = getattr(motion, f"{place}_orientation")[sample]
            assert abs(data.body(body).xquat @ turn) == pytest.approx(1, abs=1e-12)
        for k, joint in enumerate(motion.joint_names):
            assert data.joint(joint).qpos[0] == motion.joint_angles[sample, k]
            assert data.ctrl[model.actuator(joint).id] == motion.joint_commands[sample, k]
        if any(palm_shift):
            assert data.mocap_pos[0] == pytest.approx(motion.base_position[sample], abs=1e-12)
            assert data.mocap_quat[0] == pytest.approx(motion.base_orientation[sample], abs=1e-12)


@pytest.mark.parametrize("name", ["start", "goal1", "goal2", "goal3"])
def test_commands_of_a_keyframe_hold_the_object_there(name):
    model = scene()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(name).id)
    before = data.joint("object").qpos[:3].copy()
    mujoco.mj_step(model, data, 1000)
    assert np.linalg.norm(data.body("object").xpos - before) < 0.001


def test_neighbours_in_a_chain_do_not_collide():
    model = scene()
    data = start(model)
    for i in range(3):
        data.joint(f"finger{i}_joint0").qpos = 0.0
        data.joint(f"finger{i}_joint1").qpos = 3.0  # folded back: the second segment lies on the first, at the palm
    data.joint("object").qpos[:3] = [1.0, 0.0, 1.0]
    mujoco.mj_forward(model, data)
    touching = {
        tuple(sorted(model.body(model.geom(g).bodyid[0]).name for g in contact.geom)) for contact in data.contact
    }
    assert touching == {(f"finger{i}_link1", "palm") for i in range(3)}


def test_friction_is_the_tasks():
    model = scene()
    data = start(model)
    data.joint("object").qpos[:3] = [0.5, 0.0, 0.2 + 0.0599]  # resting 0.1 mm deep in the ground
    mujoco.mj_forward(model, data)
    assert data.ncon == 1
    assert data.contact[0].friction[0] == pytest.approx(0.8)
    data.joint("object").qpos[:3] = [0.0749, 0.0, 0.3]
    data.joint("finger0_joint0").qpos -= 0.02
    data.joint("finger1_joint0").qpos += 0.02
    mujoco.mj_forward(model, data)
    held = [contact for contact in data.contact if model.geom("object0").id in contact.geom]
    assert held
    for contact in held:
        assert contact.friction[0] == pytest.approx(0.5)
        assert contact.friction[2] == pytest.approx(2 / 3 * 0.5 * 0.3 * 0.13 * 0.06)  # of the task's own links
        assert contact.dim == 4


def test_actuators_push_no_harder_than_the_effort():
    model = scene()
    data = start(model)
    data.ctrl[:] += 3.0
    mujoco.mj_forward(model, data)
    assert data.actuator_force == pytest.approx(np.full(6, 2.0))


def test_the_object_is_held_for_two_seconds():
    """Joints driven with the torque of a squeeze (0.8 N a side, by the transposed Jacobian) carry the object."""
    model = scene()
    data = start(model)
    mujoco.mj_forward(model, data)
    motion = example_motion()
    for c, link in enumerate(motion.contact_link):
        point = data.body(link).xpos + data.body(link).xmat.reshape(3, 3) @ motion.contact_point_link[0, c]
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, point, model.body(link).id)
        torque = jacobian.T @ (motion.contact_force[0, c] * 1.5)
        for k in range(model.nu):
            address = model.jnt_dofadr[model.actuator_trnid[k, 0]]
            data.ctrl[k] += torque[address] / model.actuator_gainprm[k, 0]
    before = np.array(data.body("object").xpos)
    mujoco.mj_step(model, data, 2000)
    assert np.linalg.norm(data.body("object").xpos - before) < 0.002


def test_a_moving_palm_follows_its_target():
    model = scene(motion=example_motion(palm_shift=(0.0, 0.0, 0.1)))
    data = start(model)
    # The fingers would meet the object on the way.
    data.joint("object").qpos[:3] = [1.0, 0.0, 0.26]
    assert model.joint("palm").type[0] == mujoco.mjtJoint.mjJNT_FREE
    for step in range(500):
        data.mocap_pos[0] = [0.0, 0.0, 0.3 + 0.1 * step / 500]
        mujoco.mj_step(model, data)
    assert data.body("palm").xpos == pytest.approx([0.0, 0.0, 0.4], abs=0.002)
    assert data.joint("palm").qvel[2] == pytest.approx(0.2, rel=0.05)


def test_a_task_scaled_in_length_gravity_and_stiffness_has_scaled_motors():
    hand, motion = example_hand(), example_motion()

    def ten_times(link):
        return replace(link, length=10 * link.length, radius=10 * link.radius)

    # A thousandth of the density keeps the links' masses.
    fingers = tuple(replace(finger, links=tuple(map(ten_times, finger.links))) for finger in hand.fingers)
    large = replace(hand, fingers=fingers, density=hand.density / 1000)
    task = example_task()
    heavy = parse_task(TASK + "gravity: [0, 0, -98.1]\nactuator: {stiffness: 100}\n")
    small = mujoco.MjModel.from_xml_string(scene_mjcf(task, hand, motion))
    big = mujoco.MjModel.from_xml_string(scene_mjcf(heavy, large, motion))
    assert big.actuator_gainprm[:, 0] == pytest.approx(100 * small.actuator_gainprm[:, 0])
    assert big.dof_armature[:6] == pytest.approx(100 * small.dof_armature[:6])
    assert big.actuator_biasprm[:, 2] == pytest.approx(100 * small.actuator_biasprm[:, 2])


def test_there_is_no_ground_where_the_task_has_none():
    task = parse_task(TASK.replace("ground: {height: 0.2, friction: 0.8}", ""))
    model = scene(task=task)
    assert "ground" not in names(model, mujoco.mjtObj.mjOBJ_GEOM, model.ngeom)
