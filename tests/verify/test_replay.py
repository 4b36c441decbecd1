"""Replays of a grasp that holds, and of grasps that cannot."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.errors import DesignError, HandsError
from casadi_hands.export.mjcf import scene_mjcf
from casadi_hands.verify import Perturbation, audit_files, replay, replay_many
from casadi_hands.verify.reading.folder import read_folder
from casadi_hands.verify.replays.engine import load_mujoco
from casadi_hands.verify.replays.perturb import draw_perturbation
from casadi_hands.verify.replays.simulation import SUPPORT, Simulation
from tests.verify.fixture import Scene, carried


def _write(scene: Scene, directory: Path) -> Path:
    folder = scene.write(directory)
    (folder / "scene.xml").write_text(scene_mjcf(scene.task, scene.hand, scene.motion))
    return folder


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return carried(tmp_path_factory.mktemp("task"))


@pytest.fixture(scope="module")
def folder(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _write(scene, tmp_path_factory.mktemp("result"))


def test_a_good_grasp_carries_its_object(folder: Path) -> None:
    outcome = replay(folder)
    assert not outcome.dropped
    assert outcome.lost_contacts == ()
    assert outcome.position_mean < 2e-3
    assert outcome.angle_mean < 2.0
    assert outcome.position_final <= outcome.position_max


def test_contact_forces_of_the_engine_carry_the_object(folder: Path) -> None:
    """Momentum: over the motion, MuJoCo's contact forces give the object what gravity does not take."""
    total, times, velocities = [], [], []

    def watch(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        body, force = model.body("object").id, np.zeros(3)
        for i, contact in enumerate(data.contact):
            bodies = [model.geom_bodyid[geom] for geom in contact.geom]
            if body in bodies:
                local = np.zeros(6)
                mujoco.mj_contactForce(model, data, i, local)
                sign = 1.0 if bodies[1] == body else -1.0
                force += sign * contact.frame.reshape(3, 3).T @ local[:3]
        total.append(force)
        times.append(data.time)
        velocities.append(data.joint("object").qvel[:3].copy())

    replay(folder, observer=watch)
    moving = np.array(times) > 0.5
    forces, velocity = np.array(total)[moving], np.array(velocities)[moving]
    gained = 0.1 * (velocity[-1] - velocity[0]) / 1e-3
    assert forces[1:].sum(axis=0) / len(forces) == pytest.approx([0, 0, 0.981] + gained / len(forces), abs=0.02)


def test_no_squeeze_drops(scene: Scene, tmp_path: Path) -> None:
    outcome = replay(_write(scene.moved(contact_force=0 * scene.motion.contact_force), tmp_path))
    assert outcome.dropped
    assert outcome.position_max > 0.025


def test_no_friction_drops(folder: Path) -> None:
    assert replay(folder, Perturbation(friction=0.02)).dropped


def test_objects_of_other_masses_hang_elsewhere(folder: Path) -> None:
    light, as_planned, heavy = (replay(folder, Perturbation(mass=mass)).position_mean for mass in (0.5, 1.0, 2.0))
    assert light - as_planned > 1e-5
    assert as_planned - heavy > 1e-5


def test_a_shifted_start_stays_shifted_about_as_much(folder: Path) -> None:
    # Along its own axis nothing pushes the capsule back, and friction holds it where it is.
    low, high = (replay(folder, Perturbation(start_shift=(0.0, 0.0, z))) for z in (0.0, -4e-3))
    assert high.position_mean == pytest.approx(low.position_mean + 4e-3, abs=2.5e-3)


def test_replays_do_not_depend_on_the_processes(folder: Path) -> None:
    alone, together = replay_many(folder, 2, seed=3, jobs=1), replay_many(folder, 2, seed=3, jobs=2)
    assert [asdict(one) for one in alone] == [asdict(one) for one in together]
    assert alone[0].perturbation != alone[1].perturbation


def test_perturbations_are_as_large_as_stated(folder: Path) -> None:
    read = read_folder(folder)
    drawn = [draw_perturbation(read, 0, number) for number in range(60)]
    assert min(each.mass for each in drawn) >= 0.8
    assert max(each.mass for each in drawn) <= 1.2
    assert 0.8 < min(each.friction for each in drawn) < 0.83
    assert {tuple(np.sign(each.push)) for each in drawn} == {tuple(np.sign(row)) for row in [*np.eye(3), *-np.eye(3)]}
    for each in drawn:
        assert np.linalg.norm(each.push) == pytest.approx(0.5 * 0.1 * 9.81)
        assert 0.1 <= each.push_end - each.push_start <= 0.2
        assert each.push_end <= 2.0
        assert np.linalg.norm(each.start_shift) == pytest.approx(2e-3)
        assert np.rad2deg(np.linalg.norm(each.start_turn)) == pytest.approx(2.0)
        assert np.abs(np.rad2deg(each.joint_bias)) == pytest.approx(0.5)
    assert draw_perturbation(read, 0, 7) == drawn[7]


def test_scene_of_another_hand_is_refused(folder: Path, tmp_path: Path, scene: Scene) -> None:
    copy = scene.write(tmp_path)
    (copy / "scene.xml").unlink()
    with pytest.raises(DesignError, match=r"scene\.xml"):
        replay(copy)
    (copy / "scene.xml").write_text((folder / "scene.xml").read_text().replace("finger2_joint1", "finger2_other"))
    with pytest.raises(DesignError, match="lacks the object, a link, a joint or an actuator"):
        replay(copy)


def test_without_mujoco_the_message_says_what_to_install(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(HandsError, match="pip install mujoco"):
        replay(folder)
    assert audit_files(folder).certified


def test_without_imageio_the_message_says_what_to_install(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from casadi_hands.verify.replays.video import film

    monkeypatch.setitem(sys.modules, "imageio", None)
    with pytest.raises(HandsError, match="imageio"):
        film(folder, folder / "film.mp4")


def test_the_support_damps_a_thin_object_about_every_axis_by_its_own_inertia() -> None:
    inertia, frame = np.array([4e-6, 4e-6, 5e-8]), Rotation.from_rotvec([0.3, -0.5, 0.2])
    turn = Rotation.from_rotvec([0.4, 0.1, -0.9])
    spin = turn * frame  # the long axis is the inertial frame's third
    rate_in_body = 3.0 * frame.as_matrix()[:, 2]
    support = Simulation.__new__(Simulation)
    support._mujoco = load_mujoco()
    support.model = SimpleNamespace(
        body_mass=[0.02], body_inertia=[inertia], body_iquat=[frame.as_quat(scalar_first=True)]
    )
    pose = np.concatenate([np.zeros(3), turn.as_quat(scalar_first=True)])
    support.data = SimpleNamespace(qpos=pose, qvel=np.concatenate([np.zeros(3), rate_in_body]))
    support._object = support._pose = support._twist = 0
    support._mounted = None
    support._home = np.zeros(3), turn.inv().as_quat(scalar_first=True)
    force, torque = support._support(0.5)
    np.testing.assert_allclose(force, 0, atol=1e-15)
    np.testing.assert_allclose(torque, -0.5 * 5e-8 * 2 * SUPPORT * 3.0 * spin.as_matrix()[:, 2], rtol=1e-9)
