"""Drake as the replay's engine, against closed forms, against Pinocchio, and on a grasp that holds."""

from __future__ import annotations

import builtins
import dataclasses
import platform
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.errors import DesignError, HandsError
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.task import Ground
from casadi_hands.verify import Perturbation, replay
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.replays.drake import DrakeSimulation, load_drake
from casadi_hands.verify.replays.drake_scene import PATCH, PRESS
from casadi_hands.verify.replays.perturb import suite
from casadi_hands.verify.replays.plan import Plan
from casadi_hands.verify.replays.replay import can_play
from tests.verify.fixture import MASS, RADIUS, Scene, carried

WEIGHT, FLOOR, GROUND_FRICTION = MASS * 9.81, -1.0, 0.3
LYING = (np.pi / 2, 0.0, 0.0)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """Return the carried capsule, with a ground one metre below where nothing reaches it."""
    scene = carried(tmp_path_factory.mktemp("task"))
    ground = Ground(height=FLOOR, friction=GROUND_FRICTION, touches=(0.0, 0.0, -0.05))
    return dataclasses.replace(scene, task=scene.task.model_copy(update={"ground": ground}))


@pytest.fixture(scope="module")
def folder(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Folder:
    return read_folder(scene.write(tmp_path_factory.mktemp("result")))


def _away(folder: Folder, **changes: Any) -> DrakeSimulation:
    """Return the scene with the object a metre beside the hand."""
    return DrakeSimulation(folder, Perturbation(start_shift=(1.0, 0.0, 0.0), **changes))


def _triple(vector: Any) -> tuple[float, float, float]:
    x, y, z = np.asarray(vector).tolist()
    return x, y, z


def _lying(folder: Folder, **changes: Any) -> DrakeSimulation:
    """Return the scene with the object lying on the ground, along y."""
    start = folder.motion.object_position[0]
    turn = (
        Rotation.from_rotvec(LYING) * Rotation.from_quat(folder.motion.object_orientation[0], scalar_first=True).inv()
    )
    shift = np.array([1.0, 0.0, FLOOR + RADIUS]) - start
    scene = DrakeSimulation(
        folder, Perturbation(start_shift=_triple(shift), start_turn=_triple(turn.as_rotvec()), **changes)
    )
    _still(folder, scene, 0.3)
    return scene


def _plan(folder: Folder, steps: int, **changes: Any) -> Any:
    """Return a plan that stays at the motion's first sample."""
    motion = folder.motion
    plan = SimpleNamespace(
        angles=np.tile(motion.joint_angles[0], (steps + 1, 1)),
        commands=np.tile(motion.joint_angles[0], (steps + 1, 1)),
        damped=np.zeros((steps + 1, len(motion.joint_names))),
        palm_position=np.tile(motion.base_position[0], (steps + 1, 1)),
        palm_quaternion=np.tile(motion.base_orientation[0], (steps + 1, 1)),
        external_force=np.zeros((steps + 1, 3)),
        external_torque=np.zeros((steps + 1, 3)),
    )
    vars(plan).update(changes)
    return type("Plan", (SimpleNamespace,), {"__len__": lambda self: len(self.angles), "ahead": Plan.ahead})(
        **vars(plan)
    )


def _still(
    folder: Folder, scene: DrakeSimulation, time: float, push: Any = (0.0, 0.0, 0.0), **changes: Any
) -> np.ndarray:
    """Play a plan that stays where it is; return the object's positions after every step."""
    steps = round(time / scene.step)
    plan, path = _plan(folder, steps, **changes), []
    for i in range(steps):
        scene.play(plan, i, np.asarray(push), None)
        path.append(scene.object_pose()[0].copy())
    return np.array(path)


@pytest.mark.parametrize("factor", [1.0, 1.2])
def test_object_falls_and_is_pushed_by_its_mass(folder: Folder, factor: float) -> None:
    scene, push, time = _away(folder, mass=factor), np.array([0.3, -0.2, 0.1]), 0.2
    start = scene.object_pose()[0].copy()
    moved = _still(folder, scene, time, push)[-1] - start
    # Semi-implicit Euler is half a step ahead.
    expected = (push / (factor * MASS) + folder.gravity) * time * (time + scene.step) / 2
    assert moved == pytest.approx(expected, abs=1e-9)


def test_a_task_without_gravity_has_none(scene: Scene, tmp_path: Path) -> None:
    task = scene.task.model_copy(update={"gravity": (0.0, 0.0, 0.0)})
    folder = read_folder(dataclasses.replace(scene, task=task).write(tmp_path))
    simulation = _away(folder)
    start = simulation.object_pose()[0].copy()
    assert _still(folder, simulation, 0.1)[-1] == pytest.approx(start, abs=1e-12)


@pytest.mark.parametrize("axis", [0, 2])
def test_object_turns_by_its_inertia(folder: Folder, axis: int) -> None:
    scene, time = _away(folder, mass=1.2), 0.1
    before = Rotation.from_quat(scene.object_pose()[1], scalar_first=True)
    inertia = 1.2 * np.asarray(folder.task.object.inertia)[axis, axis]
    torque = before.apply(1e-3 * np.eye(3)[axis])
    steps = round(time / scene.step)
    _still(folder, scene, time, external_torque=np.tile(torque, (steps + 1, 1)))
    after = Rotation.from_quat(scene.object_pose()[1], scalar_first=True)
    turned = (before.inv() * after).as_rotvec()
    assert turned[axis] == pytest.approx(1e-3 / inertia * time * (time + scene.step) / 2, rel=1e-2)


def test_joints_give_under_the_fingers_inertia_when_the_palm_accelerates(folder: Folder) -> None:
    """Each joint is off by Pinocchio's torque over the motor's stiffness; a palm moved by hand would not show it."""
    scene, acceleration = _away(folder), np.array([6.0, -4.0, 3.0])
    steps = round(0.3 / scene.step)
    time = scene.step * np.arange(steps + 1)
    path = folder.motion.base_position[0] + 0.5 * acceleration * time[:, None] ** 2
    _still(folder, scene, 0.3, palm_position=path)
    model, base = folder.model.copy(), Rotation.from_quat(folder.motion.base_orientation[0], scalar_first=True)
    model.gravity.linear = -base.inv().apply(acceleration)
    columns = folder.joint_columns()
    angles = np.zeros(model.nq)
    angles[columns] = folder.motion.joint_angles[0]
    torque = pin.rnea(model, model.createData(), angles, np.zeros(model.nv), np.zeros(model.nv))[columns]
    drives = ElementTree.parse(folder.path / "scene.xml").getroot().iter("position")
    stiffness = {drive.get("joint"): float(drive.get("kp", "nan")) for drive in drives}
    expected = -torque / [stiffness[name] for name in folder.motion.joint_names]
    off = _angles(folder, scene) - folder.motion.joint_angles[0]
    assert np.abs(expected).max() > 1e-4
    assert off == pytest.approx(expected, abs=0.02 * np.abs(expected).max())


def _angles(folder: Folder, scene: DrakeSimulation) -> np.ndarray:
    plant, context = scene._plant, scene._context
    return np.array([plant.GetJointByName(name).get_angle(context) for name in folder.motion.joint_names])


def test_palm_goes_as_planned(folder: Folder) -> None:
    scene, time = _away(folder), 0.2
    steps = round(time / scene.step)
    base = Rotation.from_quat(folder.motion.base_orientation[0], scalar_first=True)
    share = np.linspace(0.0, 1.0, steps + 1)
    turns = Rotation.from_rotvec(share[:, None] * [0.3, -0.5, 0.2]) * base
    path = folder.motion.base_position[0] + share[:, None] * [0.02, 0.01, -0.03]
    _still(folder, scene, time, palm_position=path, palm_quaternion=turns.as_quat(scalar_first=True))
    pose = scene._plant.GetFreeBodyPose(scene._context, scene._palm)
    velocity = scene._plant.EvalBodySpatialVelocityInWorld(scene._context, scene._palm)
    assert pose.translation() == pytest.approx(path[-1], abs=1e-7)
    assert pose.rotation().matrix() == pytest.approx(turns[-1].as_matrix(), abs=1e-5)
    assert velocity.translational() == pytest.approx(np.array([0.02, 0.01, -0.03]) / time, abs=1e-4)
    assert velocity.rotational() == pytest.approx(np.array([0.3, -0.5, 0.2]) / time, abs=1e-2)


def test_joint_sensors_are_off_as_the_perturbation_says(folder: Folder) -> None:
    bias = tuple(0.01 * np.arange(1, 7))
    scene = _away(folder, joint_bias=bias)
    assert _angles(folder, scene) == pytest.approx(folder.motion.joint_angles[0] + bias)
    _still(folder, scene, 0.1)
    assert _angles(folder, scene) == pytest.approx(folder.motion.joint_angles[0] + bias, abs=1e-6)


def test_motors_push_no_harder_than_they_can(folder: Folder) -> None:
    """A set point far off turns a joint as its torque limit lets it, from rest: by torque over inertia at first."""
    slow, fast = _away(folder, effort=0.01), _away(folder, effort=0.02)
    steps = 10
    far = np.tile(folder.motion.joint_angles[0] + 1.0, (steps + 1, 1))
    moved = []
    for scene in (slow, fast):
        _still(folder, scene, steps * scene.step, commands=far)
        moved.append(_angles(folder, scene) - folder.motion.joint_angles[0])
    assert np.abs(moved[0]).max() > 1e-4
    assert moved[1] == pytest.approx(2 * moved[0], rel=0.02)


def test_stiffer_motors_press_as_planned(folder: Folder) -> None:
    """A command ahead of the planned angle asks for a torque, whatever the stiffness."""
    steps = round(0.3 / DrakeSimulation.step)
    ahead = np.tile(folder.motion.joint_angles[0] + 0.02, (steps + 1, 1))
    moved = []
    for factor in (1.0, 2.0):
        scene = _away(folder, stiffness=factor)
        _still(folder, scene, 0.3, commands=ahead)
        moved.append(_angles(folder, scene) - folder.motion.joint_angles[0])
    assert moved[0] == pytest.approx(np.full(6, 0.02), abs=1e-5)
    assert moved[1] == pytest.approx(np.full(6, 0.01), abs=1e-5)


def test_commands_press_by_the_squeeze(folder: Folder) -> None:
    steps = round(0.3 / DrakeSimulation.step)
    scene, ahead = _away(folder, squeeze=1.5), np.tile(folder.motion.joint_angles[0] + 0.02, (steps + 1, 1))
    _still(folder, scene, 0.3, commands=ahead)
    assert _angles(folder, scene) - folder.motion.joint_angles[0] == pytest.approx(np.full(6, 0.03), abs=1e-5)


def test_commands_come_late_by_the_delay(folder: Folder) -> None:
    """What is 10 ms late is where the other was 10 ms before."""
    steps = 40
    rise = folder.motion.joint_angles[0] + 0.1 * (np.arange(steps + 1) / steps)[:, None]
    paths = []
    for delay in (0.0, 0.01):
        scene = _away(folder, delay=delay)
        plan, path = _plan(folder, steps, angles=rise, commands=rise), []
        for i in range(steps):
            scene.play(plan, i, np.zeros(3), None)
            path.append(_angles(folder, scene))
        paths.append(np.array(path))
    late = round(0.01 / DrakeSimulation.step)
    assert np.abs(paths[0][-1] - paths[0][0]).min() > 0.02
    assert paths[1][late:] == pytest.approx(paths[0][:-late], abs=1e-5)


def test_links_sag_by_what_they_weigh_beyond_the_plan(folder: Folder) -> None:
    """Each joint gives by Pinocchio's torque of the weight that nothing carries."""
    scene = _away(folder, link_mass=1.5)
    _still(folder, scene, 0.3)
    model, base = folder.model.copy(), Rotation.from_quat(folder.motion.base_orientation[0], scalar_first=True)
    model.gravity.linear = 0.5 * base.inv().apply(folder.gravity)
    columns, angles = folder.joint_columns(), np.zeros(model.nq)
    angles[columns] = folder.motion.joint_angles[0]
    torque = pin.rnea(model, model.createData(), angles, np.zeros(model.nv), np.zeros(model.nv))[columns]
    drives = ElementTree.parse(folder.path / "scene.xml").getroot().iter("position")
    stiffness = {drive.get("joint"): float(drive.get("kp", "nan")) for drive in drives}
    expected = -torque / [stiffness[name] for name in folder.motion.joint_names]
    assert np.abs(expected).max() > 1e-5
    off = _angles(folder, scene) - folder.motion.joint_angles[0]
    assert off == pytest.approx(expected, abs=0.03 * np.abs(expected).max())
    heavier, planned = (
        each._plant.CalcTotalMass(each._context, [each._hand]) - each._palm.get_mass(each._context)
        for each in (scene, _away(folder))
    )
    assert heavier == pytest.approx(1.5 * planned)


def test_torsion_is_refused_and_left_out_of_the_suite(folder: Folder) -> None:
    with pytest.raises(HandsError, match="patches"):
        _away(folder, torsion=2.0)
    told = {name for name, each in suite(folder, 0, 1).items() if can_play("drake", each)}
    assert set(suite(folder, 0, 1)) - told == {
        "torsional friction of 0",
        *(f"torsional friction times {factor}" for factor in ("0.5", "2", "4")),
    }


@pytest.mark.parametrize("factor", [1.0, 0.8])
def test_ground_holds_below_its_friction(folder: Folder, factor: float) -> None:
    scene = _lying(folder, friction=factor)
    assert scene.touches("ground")
    path = _still(folder, scene, 0.3, [0.0, 0.95 * factor * GROUND_FRICTION * WEIGHT, 0.0])[:, 1]
    # It leans first, on its soft surface; then it creeps.
    assert abs(path[-1] - path[0]) < 1.5e-4
    assert abs(path[-1] - path[-51]) < 1e-4 * 50 * scene.step


@pytest.mark.parametrize("factor", [1.0, 0.8])
def test_object_slides_on_the_ground_by_what_friction_leaves(folder: Folder, factor: float) -> None:
    scene, push = _lying(folder, friction=factor), 2 * GROUND_FRICTION * WEIGHT
    path = _still(folder, scene, 0.2, [0.0, push, 0.0])[:, 1]
    speeds = np.diff(path) / scene.step
    gained = (speeds[-1] - speeds[-51]) / (50 * scene.step)
    assert gained == pytest.approx((push - factor * GROUND_FRICTION * WEIGHT) / MASS, rel=0.02)


@pytest.mark.parametrize("share", [0.7, 1.5])
def test_a_patch_resists_twisting_by_its_radius(folder: Folder, share: float) -> None:
    """Pressed onto the ground, the capsule's round end stands on a patch whose radius closed form gives."""
    press = PRESS * WEIGHT
    tip = max(shape.radius for name, link in folder.links.items() if name != "palm" for shape in link.capsules)
    # The ground is rigid: of the object alone, the pressure rises twice as fast as between object and fingertip.
    relative, patch = tip * RADIUS / (tip + RADIUS), PATCH * tip
    gradient = 2 * press / (np.pi * relative * (patch**2 / (2 * relative)) ** 2)
    depth = np.sqrt(press / (np.pi * gradient * RADIUS))
    holds = 8 / 15 * GROUND_FRICTION * press * np.sqrt(2 * RADIUS * depth)
    upright = (1.0, 0.0, FLOOR + 0.05 - depth)
    start, now = folder.motion.object_position[0], folder.motion.object_orientation[0]
    turn = Rotation.from_quat(now, scalar_first=True).inv().as_rotvec()
    scene = DrakeSimulation(folder, Perturbation(start_shift=_triple(upright - start), start_turn=_triple(turn)))
    steps = round(0.1 / scene.step)
    torque = np.tile([0.0, 0.0, share * holds], (steps + 1, 1))
    _still(folder, scene, 0.1, [0.0, 0.0, WEIGHT - press], external_torque=torque)
    spun = Rotation.from_quat(scene.object_pose()[1], scalar_first=True).as_rotvec()[2]
    # By closed form it turns by 0.34 rad where the torque is half as large again; the patch is a polygon.
    assert abs(spun) < 5e-3 if share < 1.0 else spun > 0.1


@pytest.mark.parametrize(("weights", "stiffer"), [(1.0, 1.0), (2.0, 1.0), (8.0, 4.0)])
def test_contacts_that_press_harder_are_stiffer(folder: Folder, weights: float, stiffer: float) -> None:
    force = np.zeros_like(folder.motion.contact_force)
    force[3, 1, 0] = -weights * WEIGHT

    def planned(forces: np.ndarray) -> Folder:
        return dataclasses.replace(folder, motion=dataclasses.replace(folder.motion, contact_force=forces))

    def modulus(of: Folder) -> float:
        scene = _away(of)
        (first, *_) = scene._plant.GetCollisionGeometriesForBody(scene._plant.GetBodyByName("object"))
        properties = scene._graph.model_inspector().GetProximityProperties(first)
        return float(properties.GetProperty("hydroelastic", "hydroelastic_modulus"))

    assert modulus(planned(force)) / modulus(planned(0 * force)) == pytest.approx(stiffer)


def test_coefficients_of_hand_and_ground_are_the_tasks(folder: Folder) -> None:
    scene = _away(folder, friction=0.8)
    inspector, plant = scene._graph.model_inspector(), scene._plant

    def coefficient(body: Any) -> float:
        (first, *_) = plant.GetCollisionGeometriesForBody(body)
        return float(
            inspector.GetProximityProperties(first).GetProperty("material", "coulomb_friction").static_friction()
        )

    own = coefficient(plant.GetBodyByName("object"))
    for body, expected in (
        (plant.GetBodyByName("finger0_link1"), folder.task.friction),
        (plant.GetBodyByName("palm"), folder.task.friction),
        (plant.world_body(), GROUND_FRICTION),
    ):
        other = coefficient(body)
        assert 2 * own * other / (own + other) == pytest.approx(0.8 * expected)


def test_mechanics_are_the_urdf_files(folder: Folder) -> None:
    scene = _away(folder)
    plant, context = scene._plant, scene._context
    for name, body in {**folder.links, "object": folder.object}.items():
        if name == "palm":
            continue
        inertia = plant.GetBodyByName(name).CalcSpatialInertiaInBodyFrame(context)
        assert inertia.get_mass() == pytest.approx(body.mass)
        assert inertia.get_com() == pytest.approx(body.center_of_mass)
        about_center = inertia.Shift(inertia.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
        assert about_center == pytest.approx(body.inertia)


def test_displaced_object_is_held_where_it_is(folder: Folder) -> None:
    """Far from the hand nothing else holds it: it stays until the support fades, and then falls."""
    scene, plan, heights = _away(folder), _plan(folder, 1), []
    home = scene.object_pose()[0].copy()
    scene.settle(plan, lambda plant, context: heights.append(scene.object_pose()[0][2] - home[2]))
    gone = np.array(heights)
    # The springs alone bear it when the squeeze is complete: it hangs by g / SUPPORT² at most.
    assert gone[: round(0.29 / scene.step)].min() > -9.81 / 60**2
    assert gone[-1] < -5e-3


def test_a_transmission_changes_nothing(scene: Scene, folder: Folder, tmp_path: Path) -> None:
    other = scene.write(tmp_path)
    (other / "hand.urdf").write_text(hand_urdf(scene.hand))
    paths = []
    for each in (folder, read_folder(other)):
        simulation = DrakeSimulation(each, Perturbation())
        assert len(simulation._plant.GetJointActuatorIndices()) == 6
        simulation.settle(Plan(each, simulation.step), None)
        paths.append(np.concatenate([simulation.object_pose()[0], _angles(each, simulation)]))
    assert paths[0] == pytest.approx(paths[1], abs=1e-4)


def test_the_same_replay_twice_is_the_same(folder: Folder) -> None:
    poses = []
    for _ in range(2):
        scene = DrakeSimulation(folder, Perturbation(mass=1.1, start_shift=(1e-3, 0.0, 0.0)))
        scene.settle(Plan(folder, scene.step), None)
        poses.append(np.concatenate(scene.object_pose()))
    assert np.array_equal(*poses)


def test_a_good_grasp_carries_its_object_as_in_mujoco(folder: Folder) -> None:
    drake, mujoco = replay(folder.path, engine="drake"), replay(folder.path)
    assert not drake.dropped
    assert drake.lost_contacts == ()
    assert drake.position_mean == pytest.approx(mujoco.position_mean, abs=1e-3)
    assert drake.angle_mean == pytest.approx(mujoco.angle_mean, abs=1.0)


def test_no_friction_drops(folder: Folder) -> None:
    assert replay(folder.path, Perturbation(friction=0.02), engine="drake").dropped


def test_fingers_that_touch_are_told(folder: Folder) -> None:
    far, near = _away(folder), DrakeSimulation(folder, Perturbation())
    near.settle(Plan(folder, near.step), None)
    links = ("finger0_link1", "finger1_link1", "finger2_link1")
    assert [near.touches(link) for link in links] == [True] * 3
    assert [far.touches(link) for link in links] == [False] * 3
    assert not near.touches("ground")


def test_scene_of_another_hand_is_refused(folder: Folder, scene: Scene, tmp_path: Path) -> None:
    copy = scene.write(tmp_path)
    text = (copy / "scene.xml").read_text()
    read = read_folder(copy)
    for change in (text.replace("finger2_joint1", "finger2_other"), text[:200], text.replace('kp="', 'kp="a')):
        (copy / "scene.xml").write_text(change)
        with pytest.raises(DesignError, match=r"scene\.xml"):
            DrakeSimulation(read, Perturbation())
    (copy / "scene.xml").unlink()
    with pytest.raises(DesignError, match=r"scene\.xml"):
        DrakeSimulation(read, Perturbation())


def _without(monkeypatch: pytest.MonkeyPatch, error: Callable[[str], Exception]) -> None:
    load = builtins.__import__

    def refuse(name: str, *args: Any, **kwargs: Any) -> Any:
        if name.partition(".")[0] == "pydrake":
            raise error(name)
        return load(name, *args, **kwargs)

    for name in [name for name in sys.modules if name.partition(".")[0] == "pydrake"]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setattr("casadi_hands.verify.replays.drake_scene.import_module", refuse)


def test_drake_that_is_missing_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    _without(monkeypatch, lambda name: ModuleNotFoundError(f"No module named '{name}'", name=name))
    with pytest.raises(HandsError, match=r"pip install 'casadi-hands\[drake\]'$"):
        load_drake()
    monkeypatch.setattr(platform, "system", lambda: "Windows")
    monkeypatch.setattr(platform, "machine", lambda: "AMD64")
    with pytest.raises(HandsError, match="no wheel of it for Windows on AMD64"):
        load_drake()


def test_drake_that_cannot_be_loaded_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    _without(monkeypatch, lambda name: ImportError("libX.so:\nno such file"))
    with pytest.raises(HandsError, match=r"cannot be loaded \(libX.so: no such file\)"):
        load_drake()
