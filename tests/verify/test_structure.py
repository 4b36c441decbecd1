"""Loads on bearings and links against closed forms, a frame of finite elements, and Pinocchio's inverse dynamics."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.problem.hand import Finger, Link
from casadi_hands.verify.audit import audit_files
from casadi_hands.verify.figures.structure import (
    bearing_loads,
    finger_bars,
    finger_loads,
    link_stress,
    structure_figures,
    tip_deflection,
)
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.report import Figure
from casadi_hands.verify.trajectory import sample_placements
from tests.verify.fixture import SPHERE, TIP, carried, plain, read_task

TIME = np.linspace(0.0, 1.0, 11)
LENGTH, YOUNG, DENSITY = 0.04, 2.5e9, 1240.0
AREA, INERTIA = np.pi * TIP**2, np.pi * TIP**4 / 4
FREE = "gravity: [0, 0, 0]" + SPHERE


def pressed(directory: Path, force: Any, point: Any, moment: Any = (0, 0, 0), text: str = FREE) -> dict[str, Figure]:
    """Straight fingers along the palm's normal; the left one bears a force (3,) N and a moment (3,) N·m, palm frame."""
    task = read_task(directory, text)
    turn = np.asarray(task.palm.rotation)
    forces, moments, points = np.zeros((3, 11, 2, 3))
    forces[:, 0], moments[:, 0], points[:, 0] = -turn @ force, -turn @ moment, point
    scene = plain(
        task,
        TIME,
        contact_active=np.tile([True, False], (11, 1)),
        contact_force=forces,
        contact_moment=moments,
        contact_point_link=points,
    )
    folder = read_folder(scene.write(directory / "result"))
    return {figure.name: figure for figure in structure_figures(folder, sample_placements(folder))}


def values(figures: dict[str, Figure]) -> list[float]:
    return [figures[name].value for name in ("bearing_force", "bearing_moment", "link_stress", "tip_deflection")]


@pytest.mark.parametrize(("across", "turned"), [((0.0, 2.0, 0.0), 1.0), ((2.0, 0.0, 0.0), 0.0)])
def test_a_cantilever_with_a_load_at_its_end(tmp_path: Path, across: tuple[float, ...], turned: float) -> None:
    # The joint turns about y: what turns about that, its motor bears.
    bent = 2.0 * LENGTH
    due = [2.0, turned * bent, bent * TIP / INERTIA, 2.0 * LENGTH**3 / (3 * YOUNG * INERTIA)]
    found = pressed(tmp_path, across, [0, 0, LENGTH])
    assert values(found) == pytest.approx(due)
    assert found["bearing_force"].text.startswith("the bearing of joint finger0_joint0 is pushed with 2 N at ")
    assert "finger 'left' (link 0) has a stress of " in found["link_stress"].text


def test_a_load_part_way_along_bends_the_rest_of_the_link_away(tmp_path: Path) -> None:
    at = 0.7 * LENGTH
    away = 2.0 * at**2 * (3 * LENGTH - at) / (6 * YOUNG * INERTIA)
    due = [2.0, 2.0 * at, 2.0 * at * TIP / INERTIA, away]
    assert values(pressed(tmp_path, [0, 2.0, 0], [0, 0, at])) == pytest.approx(due)


def test_pulling_off_the_axis_stretches_and_bends(tmp_path: Path) -> None:
    moment = 30.0 * TIP
    stretch, bend = 30.0 * LENGTH / (YOUNG * AREA), moment * LENGTH**2 / (2 * YOUNG * INERTIA)
    due = [30.0, moment, 30.0 / AREA + moment * TIP / INERTIA, np.hypot(stretch, bend)]
    assert values(pressed(tmp_path, [0, 0, 30.0], [0, TIP, LENGTH])) == pytest.approx(due)


def test_a_twist_shears_and_turns_the_tip_about_itself(tmp_path: Path) -> None:
    due = [0.0, 0.01, np.sqrt(3) * 0.01 * TIP / (2 * INERTIA), 0.0]
    assert values(pressed(tmp_path, [0, 0, 0], [0, 0, LENGTH], [0, 0, 0.01])) == pytest.approx(due)


def test_a_link_bears_its_weight(tmp_path: Path) -> None:
    # Half a metre below, the palm points up; here it points to the side.
    text = SPHERE.replace("facing: [0, 0, 1]", "facing: [1, 0, 0]")
    weight = 9.81 * DENSITY * np.pi * TIP**2 * (LENGTH + 4 / 3 * TIP)
    found = pressed(tmp_path, [0, 0, 0], [0, 0, 0], text=text)
    assert found["bearing_force"].value == pytest.approx(weight)
    assert found["link_stress"].value == pytest.approx(weight * LENGTH / 2 * TIP / INERTIA)
    half = LENGTH / 2
    assert found["tip_deflection"].value == pytest.approx(
        weight * half**2 * (3 * LENGTH - half) / (6 * YOUNG * INERTIA)
    )


def test_materials_and_limits_are_the_task_s(tmp_path: Path) -> None:
    given = "{material: {density: 1000, stiffness: 1.25e9, strength: 4.0e7}, safety_factor: 4, "
    soft, pla = (
        pressed(tmp_path / name, [0, 2.0, 0], [0, 0, LENGTH], text=text)
        for name, text in (("soft", FREE.replace("hand: {", f"hand: {given}")), ("pla", FREE))
    )
    assert soft["tip_deflection"].value == pytest.approx(2 * pla["tip_deflection"].value)
    assert soft["link_stress"].limit == 1e7
    assert pla["link_stress"].limit == 13e6
    assert pla["tip_deflection"].limit == pytest.approx(0.02 * 0.03)
    assert soft["bearing_moment"].limit == pytest.approx(2 / 15 * 1e7 * TIP**3)
    assert soft["bearing_force"].limit == pytest.approx(1e7 * TIP**2 / 25)
    assert all(figure.holds for figure in soft.values())
    narrow = FREE + "limits: {bearing_moment: 0.07, link_stress: 1.0e+5, tip_deflection: 1.0e-6, bearing_force: 1.9}\n"
    missed = pressed(tmp_path / "narrow", [0, 2.0, 0], [0, 0, LENGTH], text=narrow)
    assert not any(figure.holds for figure in missed.values())
    assert missed["link_stress"].reason.endswith(" MPa at 0 s; limit 0.1 MPa")


# A bent finger, against finite elements.

AXES = [(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.6, 0.0, 0.8)]
LENGTHS = [0.05, 0.03, 0.04]
ANGLES = [0.7, -0.9, 1.1]
POISSON = 0.35


def bent_finger(directory: Path, text: str, force: Any, moment: Any, point: Any) -> Folder:
    """A finger of three bent links with a force (3,) N and a moment (3,) N·m, world, at a point (3,) m of its last."""
    scene = plain(read_task(directory, text), TIME, links=3)
    links = tuple(Link(length, TIP, axis) for length, axis in zip(LENGTHS, AXES, strict=True))
    fingers = (Finger("left", scene.hand.fingers[0].base, links), *scene.hand.fingers[1:])
    angles = np.zeros((11, 6))
    angles[:, :3] = ANGLES
    forces, moments, points = np.zeros((3, 11, 2, 3))
    forces[:, 0], moments[:, 0], points[:, 0] = -np.asarray(force), -np.asarray(moment), point
    scene = replace(scene, hand=replace(scene.hand, fingers=fingers)).moved(
        joint_angles=angles,
        contact_active=np.tile([True, False], (11, 1)),
        contact_force=forces,
        contact_moment=moments,
        contact_point_link=points,
    )
    return read_folder(scene.write(directory / "result"))


def element(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Stiffness (12, 12) of a round beam, of the displacements and rotations of both nodes, world axes."""
    length = float(np.linalg.norm(end - start))
    x = (end - start) / length
    y, z = np.linalg.svd(x[None])[2][1:]
    turn = np.kron(np.eye(4), np.array([x, y, np.cross(x, y) if np.cross(x, y) @ z < 0 else z]))
    local = np.zeros((12, 12))
    for i, each in ((0, YOUNG * AREA / length), (3, YOUNG * INERTIA / (1 + POISSON) / length)):
        local[np.ix_([i, i + 6], [i, i + 6])] = each * np.array([[1, -1], [-1, 1]])
    for shift, turned, sign in ((1, 5, 1), (2, 4, -1)):
        a, b = 6 * sign * length, length**2
        at = [shift, turned, shift + 6, turned + 6]
        rows = [[12, a, -12, a], [a, 4 * b, -a, 2 * b], [-12, -a, 12, -a], [a, 2 * b, -a, 4 * b]]
        local[np.ix_(at, at)] = YOUNG * INERTIA / length**3 * np.array(rows)
    stiffness: np.ndarray = turn.T @ local @ turn
    return stiffness


def von_mises(force: np.ndarray, moment: np.ndarray, x: np.ndarray) -> float:
    """Largest stress of a section with normal x, found by going round its rim."""
    y, z = np.linalg.svd(x[None])[2][1:]
    rim = [np.cos(a) * y + np.sin(a) * z for a in np.linspace(0, 2 * np.pi, 3601)]
    normal = np.array([force @ x / AREA + np.cross(moment, TIP * out) @ x / INERTIA for out in rim])
    shear = (moment @ x) * TIP / (2 * INERTIA)
    return float(np.sqrt(normal**2 + 3 * shear**2).max())


@pytest.mark.parametrize("gravity", [False, True])
def test_a_bent_finger_bends_as_a_frame_of_finite_elements(tmp_path: Path, gravity: bool) -> None:
    force, moment, point = np.array([0.7, -1.1, 0.4]), np.array([0.003, 0.001, -0.002]), np.array([0.0, TIP, 0.025])
    folder = bent_finger(tmp_path, SPHERE if gravity else FREE, force, moment, point)
    placed = sample_placements(folder)
    base, turn = placed["palm"][1][0] + placed["palm"][0][0] @ [0.04, 0, 1.05 * TIP], placed["palm"][0][0]
    nodes, loads, sections = [base], {}, []
    for length, axis, angle, link in zip(LENGTHS, AXES, ANGLES, range(3), strict=True):
        turn = turn @ Rotation.from_rotvec(angle * np.array(axis)).as_matrix()
        stations = sorted({0.0, length / 2, length, *([0.025] if link == 2 else [])})
        weight = 9.81 * DENSITY * np.pi * TIP**2 * (length + 4 / 3 * TIP) * gravity
        root = nodes[-1]
        for low, high in pairwise(stations):
            for part in range(1, 4):
                nodes.append(root + turn @ [0, 0, low + part / 3 * (high - low)])
                sections.append((link, turn @ [0, 0, 1.0]))
            if high == length / 2:
                loads[len(nodes) - 1] = np.array([0, 0, -weight, 0, 0, 0])
            if link == 2 and high == 0.025:
                arm = turn @ point + root - nodes[-1]
                loads[len(nodes) - 1] = np.concatenate([force, moment + np.cross(arm, force)])
    stiffness, applied = np.zeros((6 * len(nodes),) * 2), np.zeros(6 * len(nodes))
    for n in range(len(nodes) - 1):
        stiffness[6 * n : 6 * n + 12, 6 * n : 6 * n + 12] += element(nodes[n], nodes[n + 1])
    for n, load in loads.items():
        applied[6 * n : 6 * n + 6] = load
    moved = np.concatenate([np.zeros(6), np.linalg.solve(stiffness[6:, 6:], applied[6:])])
    bars = next(bars for bars in finger_bars(folder, placed) if bars[0].link == "finger0_link0")
    found = finger_loads(folder, placed, bars, folder.motion.contact_force)
    assert tip_deflection(bars, found, YOUNG)[4] == pytest.approx(moved[-6:-3], rel=1e-6, abs=1e-10)
    worst = np.zeros(3)
    for n, (link, along) in enumerate(sections):
        ends = element(nodes[n], nodes[n + 1]) @ moved[6 * n : 6 * n + 12]
        for side in (ends[:6], ends[6:]):
            worst[link] = max(worst[link], von_mises(side[:3], side[3:], along))
    for i in range(3):
        assert link_stress(bars, found, i)[4] == pytest.approx(worst[i], rel=1e-5)


@pytest.mark.parametrize("perturbed", [False, True])
def test_bearings_bear_what_inverse_dynamics_says(tmp_path: Path, perturbed: bool) -> None:
    more = "perturbations: [{from: 0.55, to: 0.75, force: [0.2, 0, 0.1], torque: [0, 0, 0.002]}]" if perturbed else ""
    folder = read_folder(carried(tmp_path, more).write(tmp_path / "result"))
    motion, model, placed = folder.motion, folder.model, sample_placements(folder)
    assert motion.contact_moment is not None
    data, largest = model.createData(), {"bearing_force": 0.0, "bearing_moment": 0.0}
    for name, forces, rows in folder.scenarios():
        found = {}
        for bars in finger_bars(folder, placed):
            loads = finger_loads(folder, placed, bars, forces)
            found |= {bar.joint: bearing_loads(bars, loads, i) for i, bar in enumerate(bars)}
        assert list(found) == list(motion.joint_names)
        for k in np.flatnonzero(rows):
            palm = Rotation.from_quat(motion.base_orientation[k], scalar_first=True)
            configuration = pin.neutral(model)
            configuration[folder.joint_columns()] = motion.joint_angles[k]
            model.gravity.linear = palm.apply(folder.gravity, inverse=True)
            pin.framesForwardKinematics(model, data, configuration)
            pushed = [pin.Force.Zero() for _ in range(model.njoints)]
            for c, link in enumerate(motion.contact_link):
                joint = model.getJointId(link.replace("_link", "_joint"))
                at = data.oMi[joint].rotation @ motion.contact_point_link[k, c] + data.oMi[joint].translation
                force, moment = (palm.apply(-load[k, c], inverse=True) for load in (forces, motion.contact_moment))
                pushed[joint] = data.oMi[joint].actInv(pin.Force(force, np.cross(at, force) + moment))
            zero = np.zeros(model.nv)
            pin.rnea(model, data, configuration, zero, zero, pushed)
            for joint, (force, across) in found.items():
                wrench, axis = data.f[model.getJointId(joint)], folder.joints[joint].axis
                due = float(np.linalg.norm(wrench.linear)), float(np.linalg.norm(np.cross(wrench.angular, axis)))
                assert (force[k], across[k]) == pytest.approx(due, abs=1e-9), (name, k, joint)
                for figure, value in zip(largest, due, strict=True):
                    largest[figure] = max(largest[figure], value)
    figures = audit_files(folder.path).figures
    assert {name: figures[name].value for name in largest} == pytest.approx(largest)


def test_a_load_beyond_a_limit_costs_the_certificate(tmp_path: Path) -> None:
    scene = carried(tmp_path)
    limits = scene.task.limits.model_copy(update={"bearing_moment": 1e-3})
    task = scene.task.model_copy(update={"limits": limits})
    found = audit_files(replace(scene, task=task).write(tmp_path / "result"))
    assert [name for name, figure in found.figures.items() if not figure.holds] == ["bearing_moment"]
    assert re.match(r"the bearing of joint finger\d_joint0 is bent across its axis with ", found.reasons[0])
    assert found.reasons[0].endswith("; limit 0.001 N·m")
