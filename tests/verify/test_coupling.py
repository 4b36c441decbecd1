"""Motors that share joints, audited and replayed: a grasp of known torques, and the same falsified."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from casadi_hands.errors import DesignError, HandsError
from casadi_hands.export.commands import commanded, joint_torques
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.problem.coupling import fit_coupling
from casadi_hands.problem.drive import Drive
from casadi_hands.verify import Perturbation, replay
from casadi_hands.verify.audit import audit_files
from casadi_hands.verify.checks.drive import drive_problems
from casadi_hands.verify.figures.coupling import coupling_figures
from casadi_hands.verify.reading.folder import read_folder
from casadi_hands.verify.replays.plan import Plan
from casadi_hands.verify.replays.replay import ENGINES
from casadi_hands.verify.replays.series import stronger_motors
from casadi_hands.verify.replays.simulation import SUPPORT, Simulation
from tests.verify.falsify import both
from tests.verify.fixture import Scene, carried, result

MOTORS = 3


def shared(directory: Path, motors: int = MOTORS) -> Scene:
    """The carried object, in fingers whose commands are on the lines that are nearest to those that it needs."""
    scene = carried(directory, "motors: 3\n")
    scene = replace(scene, task=scene.task.model_copy(update={"motors": motors}))
    needed = scene.motion.joint_angles + joint_torques(scene.hand, scene.motion) / scene.task.actuator.stiffness
    found = fit_coupling(needed, motors, np.ones(needed.shape[1]))
    ratios = np.where(np.abs(found.ratios) < 0.1, 0.0, found.ratios)
    torques = joint_torques(scene.hand, scene.motion)
    # Motors of the task have 0.5 N·m and 5 rad/s; the joints they share have what they need.
    drive = Drive(tuple(map(tuple, ratios.tolist())), tuple(found.offsets.tolist()), 0.5, 5.0)
    hand = replace(scene.hand, drive=drive, effort=1.5 * float(np.abs(torques).max()))
    motion = replace(scene.motion, motor_positions=found.positions)
    stated = result(scene.task, hand, len(motion.time))["hand"]
    stated |= {"motors": motors, "ratios": ratios.tolist(), "offsets": found.offsets.tolist()}
    stated |= {"motor_effort": 0.5, "motor_velocity": 5.0}
    return Scene(scene.task, hand, commanded(scene.task, hand, motion), {"hand": stated})


def write(scene: Scene, folder: Path) -> Path:
    scene.write(folder)
    (folder / "hand.urdf").write_text(hand_urdf(scene.hand))
    return folder


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return shared(tmp_path_factory.mktemp("task"))


@pytest.fixture(scope="module")
def good(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(scene, tmp_path_factory.mktemp("good"))


def test_the_files_agree(good: Path) -> None:
    assert audit_files(good).problems == ()


def test_figures_are_those_of_virtual_work_and_of_the_lines(scene: Scene, good: Path) -> None:
    motion, drive = scene.motion, scene.hand.drive
    assert drive is not None
    assert motion.motor_positions is not None
    figures, torques = audit_files(good).figures, joint_torques(scene.hand, scene.motion)
    needed = motion.joint_angles + torques / scene.task.actuator.stiffness
    off = np.abs(needed - np.array(drive.offsets) - motion.motor_positions @ np.array(drive.ratios).T).max()
    assert off > 1e-6
    assert figures["coupling"].value == pytest.approx(off, rel=1e-6)
    assert figures["torque"].value == pytest.approx(np.abs(torques @ np.array(drive.ratios)).max() / 0.5, rel=1e-6)
    rates = np.abs(np.diff(motion.motor_positions, axis=0)).max(axis=1) / np.diff(motion.time)
    assert figures["speed"].value == pytest.approx(rates.max() / 5.0, rel=1e-9)
    assert (figures["motors"].value, figures["motors"].holds) == (3.0, True)


def test_a_hand_with_more_motors_than_asked_for_is_not_certified(tmp_path: Path) -> None:
    folder = carried(tmp_path / "task", "motors: 2\n").write(tmp_path / "hand")
    figures = {figure.name: figure for figure in coupling_figures(read_folder(folder))}
    assert figures["motors"].value == 6.0
    assert not figures["motors"].holds


def test_a_task_that_wants_a_motor_a_joint_has_one(tmp_path: Path) -> None:
    scene = shared(tmp_path / "task")
    folder = write(replace(scene, task=scene.task.model_copy(update={"motors": "independent"})), tmp_path / "result")
    assert "motors: 3 share the joints, where the task has one for every joint" in drive_problems(read_folder(folder))


Falsify = Callable[[Path], None]


def in_record(change: Callable[[dict], None]) -> Falsify:
    def falsify(folder: Path) -> None:
        record = json.loads((folder / "result.json").read_text())
        change(record["hand"])
        (folder / "result.json").write_text(json.dumps(record))

    return falsify


def in_file(name: str, path: str, attribute: str, value: str) -> Falsify:
    def falsify(folder: Path) -> None:
        tree = ElementTree.parse(folder / name)
        element = tree.getroot().find(path)
        assert element is not None
        element.set(attribute, value)
        tree.write(folder / name)

    return falsify


def other_ratio(hand: dict) -> None:
    row = next(row for row in hand["ratios"] if 1.0 not in row and any(row))
    m = next(m for m, ratio in enumerate(row) if ratio)
    row[m] *= 1.1


def in_motion(change: Callable[[np.ndarray], np.ndarray]) -> Falsify:
    def falsify(folder: Path) -> None:
        with np.load(folder / "motion.npz") as file:
            arrays = dict(file)
        arrays["motor_positions"] = change(arrays["motor_positions"])
        np.savez(folder / "motion.npz", **arrays)

    return falsify


MOTOR = ".//body[@name='motor1']"
FALSE: dict[str, tuple[Falsify, str]] = {
    "another ratio": (in_record(other_ratio), r"joint_commands: .* where the motors of result\.json turn it"),
    "another offset": (
        in_record(lambda hand: hand["offsets"].__setitem__(0, 0.0)),
        r"joint_commands: .* where the motors of result\.json turn it",
    ),
    "a ratio out of bounds": (
        in_record(lambda hand: hand["ratios"][0].__setitem__(0, 9.0)),
        r"the task allows sizes from 0\.1 to 2 \(hand\.ratios\)",
    ),
    "fewer motors than there are": (in_record(lambda hand: hand.update(motors=1)), r"motors: result\.json says 1"),
    "a weak motor": (in_record(lambda hand: hand.update(motor_effort=0.4)), r"motor_effort: result\.json says 0\.4"),
    "other positions": (in_motion(lambda values: 1.1 * values), r"joint_commands: "),
    "a stiffer spring": (in_file("scene.xml", "tendon/fixed", "stiffness", "50"), r"the spring of joint .* has 50"),
    "a spring at rest elsewhere": (in_file("scene.xml", "tendon/fixed", "springlength", "0.9"), r"rests at 0\.9"),
    "another pulley": (in_file("scene.xml", "tendon/fixed/joint", "coef", "2"), r"does not pull by the ratios"),
    "a soft motor": (
        in_file("scene.xml", "actuator/position", "kp", "0.01"),
        r"motor0 is held .* with 0\.01 N·m/rad, not",
    ),
    "a motor that drags": (in_file("scene.xml", "actuator/position", "kv", "9"), r"motor0 is held .* with 9 N·m·s/rad"),
    "an actuator of another name": (
        in_file("scene.xml", "actuator/position", "name", "motor9"),
        r"the actuator of motor0 is called motor9",
    ),
    "a spring that drags": (
        in_file("scene.xml", "tendon/fixed", "damping", "1"),
        r"the spring of joint finger0_joint0 has a damping of 1 N·m·s/rad, the critical one is 0\.\d+",
    ),
    "a heavy pulley": (
        in_file("scene.xml", ".//body[@name='finger0_link1']/joint", "armature", "1e-3"),
        r"joint finger0_joint1: its rotor has 0\.001 kg·m², on the task's stiffness it is 2\.5e-05",
    ),
    "a heavy rotor": (in_file("scene.xml", MOTOR + "/joint", "armature", "1"), r"the rotor of motor1 has 1 kg·m²"),
    "a motor of another mass": (in_file("scene.xml", MOTOR + "/inertial", "mass", "5"), r"the body of motor1 is not"),
    "a motor of another inertia": (
        in_file("scene.xml", MOTOR + "/inertial", "fullinertia", "1 1 1 0 0 0"),
        r"the body of motor1 is not",
    ),
    "a motor with its mass off its axis": (
        in_file("scene.xml", MOTOR + "/inertial", "pos", "0.1 0 0"),
        r"motor1 does not turn about z at the world's origin",
    ),
    "a motor elsewhere": (in_file("scene.xml", MOTOR, "pos", "0 0 1"), r"motor1 does not turn about z at the world's"),
    "a motor with limits": (
        both(
            in_file("scene.xml", MOTOR + "/joint", "limited", "true"),
            in_file("scene.xml", MOTOR + "/joint", "range", "-0.1 0.1"),
        ),
        r"motor1 has limits; only its torque has",
    ),
    "a motor that pushes harder": (
        in_file("scene.xml", "actuator/position", "forcerange", "-9 9"),
        r"the torque of motor0 is not limited",
    ),
    "a mimic of its own": (
        in_file("hand.urdf", "joint/mimic", "multiplier", "7"),
        r"follows .* in hand\.urdf it does not",
    ),
}


@pytest.mark.parametrize("what", FALSE)
def test_a_falsified_drive_is_found(what: str, good: Path, tmp_path: Path) -> None:
    falsify, words = FALSE[what]
    shutil.copytree(good, folder := tmp_path / "false")
    falsify(folder)
    assert any(re.search(words, problem) for problem in audit_files(folder).problems)


def test_a_drive_of_no_motors_is_refused(good: Path, tmp_path: Path) -> None:
    shutil.copytree(good, folder := tmp_path / "none")
    in_record(lambda hand: hand.update(motors=0, ratios=[[] for _ in hand["ratios"]]))(folder)
    in_motion(lambda values: values[:, :0])(folder)
    with pytest.raises(DesignError, match=r"result\.json: motors that share joints are none: motor_positions has no"):
        audit_files(folder)


def test_replays_move_the_motors_alone(tmp_path: Path) -> None:
    """Three motors share six joints, whose torques change over the motion: the object is carried as by six motors."""
    scene = shared(tmp_path / "task")
    folder = write(scene, tmp_path / "shared")
    controls: list[np.ndarray] = []
    outcome = replay(folder, observer=lambda model, data: controls.append(data.ctrl.copy()))
    assert not outcome.dropped
    assert np.shape(controls)[1] == MOTORS
    assert scene.motion.motor_positions is not None
    np.testing.assert_allclose(controls[-1], scene.motion.motor_positions[-1], atol=1e-2)
    own = replay(carried(tmp_path / "task").write(tmp_path / "own"))
    assert abs(outcome.position_max - own.position_max) < 1e-3
    assert abs(outcome.angle_max - own.angle_max) < 1.0


def test_what_no_spring_can_be_told_is_refused_and_not_tried(good: Path) -> None:
    with pytest.raises(HandsError, match=r"squeeze: given 1\.5; allowed: 1, since motors that share joints"):
        replay(good, Perturbation(squeeze=1.5))
    assert list(stronger_motors(good)) == []


@pytest.mark.parametrize("engine", ["mujoco", "drake"])
def test_springs_press_at_once_where_the_object_is_off_its_place(engine: str, good: Path) -> None:
    """So nothing bears it beside the support, on which it sags by g / SUPPORT² as a critically damped spring does."""
    pytest.importorskip("mujoco" if engine == "mujoco" else "pydrake")
    folder, heights = read_folder(good), list[float]()
    scene = ENGINES[engine](folder, Perturbation(start_shift=(1.0, 0.0, 0.0)))
    home = scene.object_pose()[0][2].copy()
    scene.settle(Plan(folder, scene.step), lambda *_: heights.append(scene.object_pose()[0][2] - home))
    for time in (0.05, 0.1, 0.25):
        due = -9.81 / SUPPORT**2 * (1 - (1 + SUPPORT * time) * np.exp(-SUPPORT * time))
        assert heights[round(time / scene.step) - 1] == pytest.approx(due, rel=0.05)


def test_perturbations_change_springs(good: Path) -> None:
    folder = read_folder(good)
    bias = tuple(0.01 * np.arange(6.0))
    plain, changed = (Simulation(folder, p) for p in (Perturbation(), Perturbation(stiffness=2.0, joint_bias=bias)))
    np.testing.assert_allclose(changed.model.tendon_stiffness, 2.0 * plain.model.tendon_stiffness)
    shift = changed.model.tendon_lengthspring - plain.model.tendon_lengthspring
    np.testing.assert_allclose(shift, np.array(bias)[:, None] * [1.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(changed.model.actuator_gainprm, plain.model.actuator_gainprm)
