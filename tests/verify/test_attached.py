"""An object on its joint: the witness against closed forms and MuJoCo's own kinematics, inertia and swing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from casadi_hands.export.design import Design
from casadi_hands.export.record import design_record
from casadi_hands.verify.checks.mount import mount_problems
from casadi_hands.verify.figures.attached import attachment_figures, joint_residual, joint_speeds
from casadi_hands.verify.figures.disturbances import external_problems
from casadi_hands.verify.figures.wrench import least_margin
from casadi_hands.verify.held import Held, held, joint_problems
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.reading.scene_file import read_scene
from casadi_hands.verify.replays.perturb import Perturbation
from casadi_hands.verify.replays.plan import Plan
from casadi_hands.verify.replays.simulation import Simulation
from tests.verify.fixture import Scene, plain, read_task

TIME = np.linspace(0.0, 1.0, 41)
TEXT = """
name: arm
object:
  mass: 0.2
  shapes: [{{capsule: {{start: [0, 0.01, -0.04], end: [0, 0.01, 0.04], radius: 0.01}}}}]
  attached: {{{joint}}}
palm: {{radius: 0.05, position: [0, 0, -0.5], facing: [0, 0, 1]}}
motion: [{{at: 0, position: [0.2, 0, 0], rotation: {{axis: [1, 2, 3], degrees: 40}}}}, {{at: 1, {goal}{exert}}}]
fingers: {{left: {{touches: [-0.01, 0.01, 0]}}, right: {{touches: [0.01, 0.01, 0]}}}}
hand: {{joint_limits: [-150, 150], link_radius: 0.006, hinge_length: 0}}
"""
HINGE = "hinge: {point: [0.01, 0, 0.03], axis: [1, 1, 0], stiffness: 0.05, damping: 0.001}"
SCREW = "screw: {point: [0.01, 0, 0.03], axis: [1, 1, 0], pitch: 0.03, stiffness: 0.05, damping: 0.001}"
SLIDER = "slider: {axis: [1, 1, 1], stiffness: 20, damping: 0.4}"
JOINTS = [(HINGE, "angle: 10"), (SCREW, "angle: 10"), (SLIDER, "distance: 0.01")]


def swinging(directory: Path, joint: str, goal: str, exert: str = "", push: float = 0.0) -> tuple[Scene, Held, Any]:
    """The object let go at its first goal: no hand touches it, and SciPy says where it swings.

    ``push`` is a constant force along the joint that the file calls friction.
    """
    scene = plain(read_task(directory, TEXT.format(joint=joint, goal=goal, exert=exert)), TIME)
    folder = read_folder(replace(scene, motion=replace(scene.motion, **resting(0))).write(directory / "at rest"))
    joint_held = held(folder)
    assert joint_held is not None
    mass, gravity = folder.object.mass, folder.gravity

    def slope(_: float, state: np.ndarray) -> np.ndarray:
        q, speed = state
        # The derivative of the potential energy by the coordinate, by central differences.
        ends = joint_held.place(np.array([q - 1e-6, q + 1e-6]))[0]
        pull = mass * gravity @ (ends[1] - ends[0]) / 2e-6
        return np.array(
            [speed, (pull + push - joint_held.stiffness * q - joint_held.damping * speed) / joint_held.mass]
        )

    solved = solve_ivp(slope, (0, 1), [0, 0], method="DOP853", rtol=1e-11, atol=1e-13, dense_output=True)
    position, velocity = solved.sol(TIME)
    at, turn = joint_held.place(position)
    rows = {
        "object_position": at,
        "object_orientation": turn.as_quat(scalar_first=True),
        "attachment_position": position,
        "attachment_velocity": velocity,
        "attachment_friction": np.full(len(TIME), push),
    }
    return scene.moved(**rows), joint_held, solved.sol


def resting(value: float) -> dict[str, np.ndarray]:
    names = ("attachment_position", "attachment_velocity", "attachment_friction")
    return {name: np.full(len(TIME), float(value)) for name in names}


def read(scene: Scene, directory: Path) -> Folder:
    stated = {"attached": design_record(Design(scene.task, "feasible"))["attached"]}
    return read_folder(replace(scene, changes={**stated, **scene.changes}).write(directory / "result"))


@pytest.mark.parametrize(("joint", "goal"), JOINTS)
def test_a_swing_leaves_next_to_no_residual_and_a_push_leaves_itself(tmp_path: Path, joint: str, goal: str) -> None:
    scene, on, _ = swinging(tmp_path, joint, goal)
    folder = read(scene, tmp_path)
    force, torque = joint_residual(folder, on)
    assert max(force.max(), torque.max()) < 1e-4
    assert joint_problems(folder) == []
    # The same swing cannot be had with one more force, which is then what is left over.
    push = 0.1 * on.unit(folder)
    pushed = read(scene.moved(attachment_friction=np.full(len(TIME), push)), tmp_path)
    left = np.array(joint_residual(pushed, on)).sum(axis=0)
    np.testing.assert_allclose(left, 0.1, atol=1e-4)


@pytest.mark.parametrize(("joint", "goal"), JOINTS)
def test_speeds_follow_from_momentum(tmp_path: Path, joint: str, goal: str) -> None:
    scene, on, swing = swinging(tmp_path, joint, goal, push=0.002)
    launch, arrival = joint_speeds(read(scene, tmp_path), on)
    speeds = swing(TIME)[1]
    scale = np.abs(speeds).max()
    np.testing.assert_allclose(launch, speeds[:-1], atol=1e-4 * scale)
    np.testing.assert_allclose(arrival, speeds[1:], atol=1e-4 * scale)


@pytest.mark.parametrize(("joint", "goal"), JOINTS)
def test_mujoco_has_the_same_joint(tmp_path: Path, joint: str, goal: str) -> None:
    scene, on, swing = swinging(tmp_path, joint, goal)
    folder = read(scene, tmp_path)
    model = mujoco.MjModel.from_xml_path(str(folder.path / "scene.xml"))
    data = mujoco.MjData(model)
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "object")
    for q in (0.0, 0.2, -0.5):
        own = np.array([on.advance * q, q] if "screw" in joint else [q])
        data.qpos[model.jnt_qposadr[model.body_jntadr[body]] :][: len(own)] = own
        mujoco.mj_kinematics(model, data)
        position, turn = on.place(np.array([q]))
        np.testing.assert_allclose(data.xpos[body], position[0], atol=1e-12)
        theirs = Rotation.from_quat(data.xquat[body], scalar_first=True)
        assert (theirs.inv() * turn[0]).magnitude() < 1e-9
    # Let go, it swings as SciPy has it.
    mujoco.mj_resetDataKeyframe(model, data, 0)
    while data.time < 0.5:
        mujoco.mj_step(model, data)
    reached = data.qpos[model.jnt_qposadr[model.body_jntadr[body] + model.body_jntnum[body] - 1]]
    travel = np.ptp(swing(np.linspace(0, 0.5, 51))[0])
    assert reached == pytest.approx(swing(0.5)[0], abs=0.02 * travel)
    assert mount_problems(folder, read_scene(folder.path / "scene.xml")) == []


def test_a_scene_with_another_joint_is_found_out(tmp_path: Path) -> None:
    scene, _, _ = swinging(tmp_path, HINGE, "angle: 10")
    folder = read(scene, tmp_path)
    file = folder.path / "scene.xml"
    text = file.read_text()
    for old, new, words in (
        ('stiffness="0.05"', 'stiffness="0.06"', "the stiffness of joint object"),
        ('frictionloss="0.0"', 'frictionloss="0.01"', "the friction of joint object"),
        ('type="hinge"', 'type="slide"', "is a slide"),
        ('name="object" type', 'name="other" type', "hangs on other"),
    ):
        assert old in text
        file.write_text(text.replace(old, new))
        assert any(words in problem for problem in mount_problems(folder, read_scene(file)))


def test_friction_that_helps_or_is_too_much_is_seen(tmp_path: Path) -> None:
    joint = HINGE.replace("}", ", friction_torque: 0.02}")
    scene, on, swing = swinging(tmp_path, joint, "angle: 10")
    speeds = swing(TIME)[1]

    def shortfall(friction: np.ndarray) -> float:
        (figure,) = attachment_figures(read(scene.moved(attachment_friction=friction), tmp_path), on)
        return figure.value

    assert shortfall(-0.02 * np.sign(speeds)) == pytest.approx(0, abs=1e-9)
    assert shortfall(-0.015 * np.sign(speeds)) == pytest.approx(0.25)
    assert shortfall(0.02 * np.sign(speeds)) == pytest.approx(2)
    assert shortfall(-0.03 * np.sign(speeds)) == pytest.approx(0.5)


def test_an_object_off_its_joint_is_found_out(tmp_path: Path) -> None:
    scene, _, _ = swinging(tmp_path, HINGE, "angle: 10")
    off = scene.motion.object_position + np.where(np.arange(41)[:, None] == 16, [0, 0, 1e-4], 0.0)
    (problem,) = joint_problems(read(scene.moved(object_position=off), tmp_path))
    assert "at 0.4 s the object is 0.1 mm and 0° off the joint" in problem
    missing = scene.moved(attachment_friction=None)
    assert joint_problems(read(missing, tmp_path)) == ["attachment_friction: missing, though a joint holds the object"]


def test_what_is_exerted_must_be_in_the_motion_in_full(tmp_path: Path) -> None:
    scene, _, _ = swinging(tmp_path, SLIDER, "distance: 0.01", ", exert: {force: [0, 0, 3]}")
    answered = np.tile([0.0, 0.0, -3.0], (41, 1))
    assert external_problems(read(scene.moved(external_force=answered), tmp_path)) == []
    for wrong in (0.9 * answered, 0 * answered, -answered):
        assert external_problems(read(scene.moved(external_force=wrong), tmp_path))


def test_what_the_grasp_has_left_along_a_joint_is_to_the_nearer_end() -> None:
    assert least_margin(np.array([-2.0, 1.0, 3.0]), 0.5) == 2.5
    assert least_margin(np.array([-2.0, 1.0, 3.0]), -1.5) == 0.5
    assert least_margin(np.array([1.0, 3.0]), 0.25) == 0.25
    assert least_margin(np.array([1.0, 3.0]), 4.0) == 0.0
    # Its figure goes into JSON, which knows no numbers of NumPy.
    assert type(least_margin(np.array([1.0, 3.0]), np.float64(0.25))) is float


def test_a_replay_starts_off_its_place_only_as_far_as_the_joint_lets_it(tmp_path: Path) -> None:
    scene, on, _ = swinging(tmp_path, HINGE, "angle: 10")
    folder = read(scene, tmp_path)
    turn = tuple((0.03 * on.axis + 0.02 * np.cross(on.axis, [0, 0, 1])).tolist())
    world = Simulation(folder, Perturbation(start_turn=turn, start_shift=(0.001, 0.0, 0.0)))
    place, rotation = on.place(np.array([0.03]))
    position, quaternion = world.object_pose()
    np.testing.assert_allclose(position, place[0], atol=1e-9)
    assert (Rotation.from_quat(quaternion, scalar_first=True).inv() * rotation[0]).magnitude() < 1e-6
    # And is held there by its support, which lets go at last.
    highest: list[float] = []
    plan = Plan(folder, world.step)
    world.settle(plan, lambda _, data: highest.append(float(data.time)))
    assert len(highest) == 500


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({}, []),
        ({"joint": "slider"}, ["attached: result.json says slider, task.yaml says hinge"]),
        ({"friction": 99.0}, ["attached: friction is 99.0 in result.json, which is not the task's"]),
        ({"axis": [0.0, 0.0, 1.0]}, ["attached: axis is [0.0, 0.0, 1.0] in result.json, which is not the task's"]),
        ({"point": None}, ["attached: point is none in result.json, which is not the task's"]),
    ],
)
def test_the_joint_that_a_result_states_is_the_tasks(change: dict[str, Any], words: list[str], tmp_path: Path) -> None:
    scene, _, _ = swinging(tmp_path, HINGE, "angle: 10")
    stated = design_record(Design(scene.task, "feasible"))["attached"]
    assert joint_problems(read(replace(scene, changes={"attached": {**stated, **change}}), tmp_path)) == words
