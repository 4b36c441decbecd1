"""What perturbations change in MuJoCo's model and commands, and what the suite of them holds."""

from __future__ import annotations

import re
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from casadi_hands.errors import HandsError
from casadi_hands.verify import Perturbation, replay, run_replays
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.replays import replay as replay_module
from casadi_hands.verify.replays import series
from casadi_hands.verify.replays.perturb import draw_perturbation, suite
from casadi_hands.verify.replays.plan import Plan
from casadi_hands.verify.replays.replay import ATTEMPTS, Replay, replay_each
from casadi_hands.verify.replays.simulation import Simulation
from tests.verify.fixture import SPHERE, carried, plain, read_task

FIELDS = (
    *("body_mass", "body_inertia", "body_gravcomp", "geom_friction", "actuator_gainprm", "actuator_biasprm"),
    *("actuator_forcerange", "dof_armature", "geom_solref", "geom_size"),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    return read_folder(carried(tmp_path_factory.mktemp("task")).write(tmp_path_factory.mktemp("result")))


@pytest.fixture(scope="module")
def bead(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    """A ball of 3 mm radius."""
    directory = tmp_path_factory.mktemp("bead")
    task = read_task(directory, SPHERE.replace("0.03", "0.003").replace("mass: 0.2", "mass: 0.001"))
    return read_folder(plain(task, np.linspace(0.0, 1.0, 5)).write(directory))


def changed(folder: Folder, **changes: float) -> tuple[mujoco.MjModel, dict[str, np.ndarray]]:
    """Return the perturbed model and, the quotients of fields that differ from ``scene.xml``; 0 / 0 is 1."""
    model = Simulation(folder, Perturbation(**changes)).model
    plan = mujoco.MjModel.from_xml_path(str(folder.path / "scene.xml"))
    quotients = {}
    for name in FIELDS:
        old, new = getattr(plan, name), getattr(model, name)
        if not np.array_equal(old, new):
            quotients[name] = np.divide(new, old, out=np.ones_like(old), where=old != 0)
    return model, quotients


def links(model: mujoco.MjModel) -> np.ndarray:
    """Return which bodies are links of fingers, (bodies,)."""
    return np.array(["_link" in model.body(k).name for k in range(model.nbody)])


def test_links_are_heavier_and_their_planned_weight_is_carried(folder: Folder) -> None:
    model, quotients = changed(folder, link_mass=1.2)
    assert set(quotients) == {"body_mass", "body_inertia", "body_gravcomp"}
    assert links(model).sum() == 6
    expected = np.where(links(model), 1.2, 1.0)
    assert quotients["body_mass"] == pytest.approx(expected)
    assert quotients["body_inertia"] == pytest.approx(np.tile(expected[:, None], 3))
    assert quotients["body_gravcomp"] == pytest.approx(1 / expected)


def test_heavier_links_are_borne_by_the_motors(folder: Folder) -> None:
    """Of the weight, what is beyond the plan is left to joints: at rest the rest of it is their bias."""
    forces = []
    for factor in (1.0, 1.2):
        scene = Simulation(folder, Perturbation(link_mass=factor))
        mujoco.mj_forward(scene.model, scene.data)
        forces.append(scene.data.qfrc_bias - scene.data.qfrc_passive)
    weight = mujoco.MjModel.from_xml_path(str(folder.path / "scene.xml"))
    weight.body_gravcomp[:] = 0.0
    data = mujoco.MjData(weight)
    mujoco.mj_resetDataKeyframe(weight, data, 0)
    mujoco.mj_forward(weight, data)
    joints = [weight.joint(name).dofadr[0] for name in folder.motion.joint_names]
    assert forces[0][joints] == pytest.approx(np.zeros(6), abs=1e-12)
    assert forces[1][joints] == pytest.approx(0.2 * data.qfrc_bias[joints], abs=1e-12)


@pytest.mark.parametrize("factor", [0.0, 0.5, 4.0])
def test_torsion_scales_the_second_coefficient_alone(folder: Folder, factor: float) -> None:
    _, quotients = changed(folder, torsion=factor)
    assert set(quotients) == {"geom_friction"}
    assert quotients["geom_friction"][:, [0, 2]] == pytest.approx(1.0)
    twists = mujoco.MjModel.from_xml_path(str(folder.path / "scene.xml")).geom_friction[:, 1] > 0
    assert twists.any()
    assert quotients["geom_friction"][twists, 1] == pytest.approx(factor)


def test_friction_scales_sliding_and_torsion(folder: Folder) -> None:
    _, quotients = changed(folder, friction=0.8)
    assert set(quotients) == {"geom_friction"}
    assert quotients["geom_friction"][:, :2] == pytest.approx(0.8)


def test_mass_scales_the_object_alone(folder: Folder) -> None:
    model, quotients = changed(folder, mass=1.2)
    assert set(quotients) == {"body_mass", "body_inertia"}
    which = np.array([model.body(k).name == "object" for k in range(model.nbody)])
    assert quotients["body_mass"] == pytest.approx(np.where(which, 1.2, 1.0))


def test_motors_have_another_stiffness_and_press_as_planned(folder: Folder) -> None:
    _, quotients = changed(folder, stiffness=0.5)
    assert set(quotients) == {"actuator_gainprm", "actuator_biasprm"}
    assert quotients["actuator_gainprm"][:, 0] == pytest.approx(0.5)
    assert quotients["actuator_biasprm"][:, 1] == pytest.approx(0.5)
    assert quotients["actuator_biasprm"][:, 2] == pytest.approx(0.5**0.5)
    torques = []
    for factor in (1.0, 0.5):
        scene = Simulation(folder, Perturbation(stiffness=factor))
        ahead = commands(folder, stiffness=factor)[0] - folder.motion.joint_angles[0]
        torques.append(scene.model.actuator_gainprm[:, 0] * ahead)
    assert torques[1] == pytest.approx(torques[0])


@pytest.mark.parametrize("factor", [0.04, 0.5, 1.0, 4.0])
def test_motors_of_another_stiffness_press_as_planned_while_joints_move(tmp_path: Path, factor: float) -> None:
    """Their dampers are as much of critical as before, so they hold back by so much less than springs give."""
    scene = carried(tmp_path / "task")
    waves = 0.2 * np.sin(np.pi * scene.motion.time / scene.motion.time[-1]) ** 2
    moving = scene.moved(joint_angles=scene.motion.joint_angles + waves[:, None])
    folder = read_folder(moving.write(tmp_path / "result"))
    motion, model = folder.motion, Simulation(folder, Perturbation(stiffness=factor)).model
    assert motion.joint_torques is not None
    assert motion.joint_velocities is not None
    stiffness, damping = model.actuator_gainprm[:, 0], -model.actuator_biasprm[:, 2]
    steps = np.round(motion.time / 1e-3).astype(int)
    held_back = damping * motion.joint_velocities
    assert np.abs(held_back).max() > 0.005 * np.abs(motion.joint_torques).max()
    pressing = stiffness * Plan(folder, 1e-3).ahead(steps, Perturbation(stiffness=factor)) - held_back
    assert pressing == pytest.approx(motion.joint_torques, abs=1e-6 * np.abs(motion.joint_torques).max())


def commands(folder: Folder, **changes: float) -> np.ndarray:
    """Return what MuJoCo's motors are told at every step of the motion, (T - 1, J) rad."""
    told = []
    replay(folder.path, Perturbation(**changes), lambda model, data: told.append(data.ctrl.copy()))
    return np.array(told)[round((series.SQUEEZE + series.RELEASE) / 1e-3) :]


def test_a_delay_shifts_commands(folder: Folder) -> None:
    on_time, late = commands(folder), commands(folder, delay=0.01)
    assert np.abs(on_time[10:] - on_time[:-10]).max() > 1e-5
    assert np.array_equal(late[10:], on_time[:-10])
    assert np.array_equal(late[:10], np.tile(on_time[0], (10, 1)))


def test_a_delay_leaves_palm_and_external_forces_in_time(folder: Folder) -> None:
    scene, plan = Simulation(folder, Perturbation(delay=0.01)), Plan(folder, 1e-3)
    plan.external_force = np.outer(np.arange(len(plan)), [1e-6, 0.0, 0.0])
    scene.settle(plan, None)
    scene.play(plan, 500, np.zeros(3), None)
    assert scene.data.xfrc_applied[scene.model.body("object").id, 0] == pytest.approx(500e-6)
    target = scene.model.body("palm_target").mocapid[0]
    assert scene.data.mocap_pos[target] == pytest.approx(plan.palm_position[500])


def test_the_suite_changes_one_thing_at_a_time(folder: Folder) -> None:
    tried = suite(folder, 0, 4)
    assert len(tried) == 31
    changes = [each.changes for each in tried.values()]
    assert len({repr(each) for each in changes}) == 31
    alone = {name: set(each.changes) - {"push_start", "push_end"} for name, each in tried.items()}
    assert {name for name, each in alone.items() if len(each) > 1} == {
        f"everything at once, number {k}" for k in range(4)
    }
    assert {name for each in alone.values() for name in each} == {
        *("mass", "friction", "torsion", "joint_bias", "push", "start_shift", "start_turn", "stiffness", "link_mass"),
        "delay",
    }


def test_names_of_the_suite_say_what_it_changes(folder: Folder) -> None:
    tried, weight = suite(folder, 3, 1), 0.1 * 9.81
    assert tried["stiffness doubled"] == Perturbation(stiffness=2.0)
    assert tried["mass -20 %"] == Perturbation(mass=0.8)
    assert tried["friction +20 %"] == Perturbation(friction=1.2)
    assert tried["link mass -20 %"] == Perturbation(link_mass=0.8)
    assert tried["torsional friction of 0"] == Perturbation(torsion=0.0)
    assert tried["torsional friction times 4"] == Perturbation(torsion=4.0)
    assert tried["commands 10 ms late"] == Perturbation(delay=0.01)
    assert tried["everything at once, number 0"] == draw_perturbation(folder, 3, 0)
    for k, axis in enumerate("xyz"):
        for sign, words in ((1.0, "+"), (-1.0, "-")):
            push = tried[f"pushed along {words}{axis}"]
            assert push.push == pytest.approx(0.5 * weight * sign * np.eye(3)[k])
            assert push.push_end - push.push_start == pytest.approx(0.15)
            assert 0.0 <= push.push_start < push.push_end <= folder.motion.time[-1]
    for words, degrees in (("0.5 degrees", 0.5), ("1 degree", 1.0)):
        first, second = (tried[f"joints off by {words}, number {k}"].joint_bias for k in range(2))
        assert np.abs(np.rad2deg([first, second])) == pytest.approx(degrees)
        assert first != second
    for k in range(2):
        assert np.rad2deg(np.linalg.norm(tried[f"start turned by 2 degrees, number {k}"].start_turn)) == pytest.approx(
            2
        )


def test_starts_are_off_by_what_the_object_bears(folder: Folder, bead: Folder) -> None:
    for read, expected in ((folder, 2e-3), (bead, 0.05 * 3e-3)):
        shifts = [each.start_shift for each in suite(read, 0, 3).values() if any(each.start_shift)]
        assert len(shifts) == 5
        assert np.linalg.norm(shifts, axis=1) == pytest.approx(expected)


def test_without_torsion_no_factor_of_it_is_tried(folder: Folder, tmp_path: Path) -> None:
    for name in ("task.yaml", "hand.urdf", "object.urdf", "motion.npz", "result.json"):
        (tmp_path / name).write_bytes((folder.path / name).read_bytes())
    scene = (folder.path / "scene.xml").read_text()
    (tmp_path / "scene.xml").write_text(re.sub(r'friction="(\S+) \S+ (\S+)"', r'friction="\1 0 \2"', scene))
    left = set(suite(folder, 0, 4)) - set(suite(read_folder(tmp_path), 0, 4))
    assert len(left) == 4
    assert all(name.startswith("torsional friction") for name in left)


def test_the_seed_fixes_the_suite(folder: Folder) -> None:
    assert suite(folder, 5, 2) == suite(folder, 5, 2)
    differing = {name for name, each in suite(folder, 5, 2).items() if each != suite(folder, 6, 2)[name]}
    assert all(name.startswith(("pushed", "joints", "start", "everything")) for name in differing)
    assert {name.split()[0] for name in differing} == {"pushed", "joints", "start", "everything"}


def test_replays_of_the_suite_do_not_depend_on_the_processes(folder: Folder, monkeypatch: pytest.MonkeyPatch) -> None:
    few = ("mass +20 %", "pushed along -y", "everything at once, number 0")

    def shorter(*arguments: Any) -> dict[str, Perturbation]:
        return {name: each for name, each in suite(*arguments).items() if name in few}

    monkeypatch.setattr(series, "suite", shorter)
    monkeypatch.setattr(series, "ENOUGH_STEPS", 0)
    alone, together = (run_replays(folder.path, 1, seed=3, jobs=jobs) for jobs in (1, 2))
    assert tuple(alone.perturbed) == few
    assert [asdict(each) for each in alone.perturbed.values()] == [asdict(each) for each in together.perturbed.values()]
    assert all(each.perturbation == suite(folder, 3, 1)[name] for name, each in together.perturbed.items())


@pytest.mark.parametrize("deaths", [ATTEMPTS - 1, ATTEMPTS])
def test_replays_whose_processes_die_are_played_again(
    deaths: int, folder: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[int] = []

    class Dying(ThreadPoolExecutor):
        """Threads in place of processes, that die the first times."""

        def __init__(self, jobs: int, **_: Any) -> None:
            super().__init__(1)
            begun.append(jobs)

        def map(self, *arguments: Any, **named: Any) -> Any:
            if len(begun) <= deaths:
                raise BrokenProcessPool("a process died")
            return super().map(*arguments, **named)

    monkeypatch.setattr(replay_module, "ProcessPoolExecutor", Dying)
    changes = [Perturbation(), Perturbation(mass=1.2)]
    if deaths == ATTEMPTS:
        with pytest.raises(HandsError, match="processes that replay this died each of 3 times"):
            replay_each(folder.path, changes, jobs=2)
    else:
        assert [each.perturbation for each in replay_each(folder.path, changes, jobs=2)] == changes
    assert len(begun) == ATTEMPTS


def test_none_at_once_is_none_at_all(folder: Folder) -> None:
    seen = run_replays(folder.path, 0)
    assert isinstance(seen.nominal, Replay)
    assert seen.perturbed == {}
