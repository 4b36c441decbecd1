"""Torques, supplied forces and the disturbance radius against independent computations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from casadi_hands.verify.figures.wrench import (
    disturbance_figure,
    disturbance_radius,
    planned_torques,
    torque_figure,
    unsupplied_figure,
)
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.trajectory import place_links, sample_placements
from tests.verify.fixture import SPHERE, carried, plain, read_task

TIME = np.linspace(0.0, 1.0, 11)


@pytest.fixture(scope="module")
def held(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    directory = tmp_path_factory.mktemp("held")
    return read_folder(carried(directory).write(directory / "result"))


def test_torques_do_the_work_of_the_contact_forces(held: Folder) -> None:
    """Virtual work: torque · dq = force · displacement of the contact point, by differences of forward kinematics."""
    motion, torques = held.motion, planned_torques(held)
    base = sample_placements(held)["palm"]
    for joint in range(6):
        work = np.zeros(len(motion.time))
        for sign in (1.0, -1.0):
            angles = motion.joint_angles.copy()
            angles[:, joint] += sign * 1e-5
            placed = place_links(held, angles, base[0], base[1])
            for c, link in enumerate(motion.contact_link):
                rotation, position = placed[link]
                at = np.einsum("sij,sj->si", rotation, motion.contact_point_link[:, c]) + position
                work += sign * np.sum(at * motion.contact_force[:, c], axis=1) / 2e-5
        assert torques[:, joint] == pytest.approx(work, abs=1e-9)
    assert torque_figure(held).value == pytest.approx(np.abs(torques).max() / 0.5)


def _pressed(directory: Path, force: list[float], point: list[float]) -> Folder:
    """One-joint fingers along z that turn about y; the left one presses with a force at a point of its link."""
    task = read_task(directory, SPHERE)
    to_world = np.asarray(task.palm.rotation)
    forces, points = np.zeros((11, 2, 3)), np.zeros((11, 2, 3))
    forces[:, 0], points[:, 0] = to_world @ force, point
    active = np.tile([True, False], (11, 1))
    scene = plain(task, TIME, contact_active=active, contact_force=forces, contact_point_link=points)
    return read_folder(scene.write(directory / "result"))


def test_a_joint_supplies_only_what_it_has_a_lever_for(tmp_path: Path) -> None:
    # About y a point on the z axis moves along x: the joint supplies the force's x and none of y or z.
    folder = _pressed(tmp_path / "a", [1.0, 0.3, 0.4], [0, 0, 0.04])
    weight = 0.2 * 9.81
    assert unsupplied_figure(folder).value == pytest.approx(0.5 / weight)
    assert planned_torques(folder)[:, 0] == pytest.approx(0.04 * np.ones(11))


@pytest.mark.parametrize(("lever", "supplied"), [(0.0016, True), (0.0014, False)])
def test_a_lever_under_five_percent_supplies_nothing(tmp_path: Path, lever: float, supplied: bool) -> None:
    folder = _pressed(tmp_path, [1.0, 0.0, 0.0], [0, 0, lever])
    assert unsupplied_figure(folder).value == pytest.approx(0.0 if supplied else 1.0 / (0.2 * 9.81), abs=1e-12)


def test_radius_of_a_cross_polytope() -> None:
    edges = 2.0 * np.vstack([np.eye(6), -np.eye(6)])
    assert disturbance_radius(edges, np.zeros(6)) == pytest.approx(2.0 / np.sqrt(6))
    shifted = np.array([0.5, 0, 0, 0, 0, 0])
    assert disturbance_radius(edges, shifted) == pytest.approx(1.5 / np.sqrt(6))
    assert disturbance_radius(edges, 3 * np.eye(6)[0]) == 0.0


def test_two_point_contacts_resist_no_spin_about_their_line(tmp_path: Path) -> None:
    force = np.tile([[3.0, 0, 0.981], [-3.0, 0, 0.981]], (11, 1, 1))
    points = np.tile([[-0.03, 0, 0], [0.03, 0, 0]], (11, 1, 1))
    arrays = {"contact_active": np.ones((11, 2), dtype=bool), "contact_force": force, "contact_point_object": points}
    hard = read_task(tmp_path, SPHERE + "fingertip: {torsion: 0}\n")
    folder = read_folder(plain(hard, TIME, **arrays).write(tmp_path / "result"))
    assert disturbance_figure(folder, sample_placements(folder)).value == 0.0


def test_no_sampled_push_inside_the_radius_is_beyond_the_grasp(held: Folder) -> None:
    """A linear program finds friction-feasible forces for wrenches just inside the radius, and misses some beyond."""
    from scipy.optimize import linprog

    from casadi_hands.verify.figures.wrench import RESERVE, _cones, surface_normals

    placed = sample_placements(held)
    figure = disturbance_figure(held, placed)
    k = round(float(figure.text.split(" at ")[1].split(" s ")[0]) * 10)
    normals = [
        -held.motion.contact_force[i, c] @ surface_normals(held, placed, i, c)[0] for i in range(21) for c in range(3)
    ]
    budget = RESERVE * np.reshape(normals, (21, 3)).sum(axis=1).max() / held.weight
    edges, exerted = _cones(held, placed, k, budget)
    pushes = np.random.default_rng(0).normal(size=(200, 6))
    pushes /= np.linalg.norm(pushes, axis=1, keepdims=True)

    def resisted(push: np.ndarray) -> bool:
        shares = np.ones((1, len(edges)))
        return bool(linprog(np.zeros(len(edges)), shares, [1.0], edges.T, exerted + push, method="highs").success)

    assert all(resisted(0.999 * figure.value * push) for push in pushes)
    assert not all(resisted(4.0 * figure.value * push) for push in pushes)
