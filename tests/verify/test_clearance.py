"""Overlap and joint figures against closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from casadi_hands.verify.figures.clearance import body_pairs, joint_figure, penetration_figure, speed_figure
from casadi_hands.verify.figures.dynamics import shoot
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.trajectory import build_trajectory
from tests.verify.fixture import SPHERE, TIP, plain, read_task

TIME = np.linspace(0.0, 1.0, 11)


def _read(directory: Path, links: int = 1, text: str = SPHERE, **arrays: np.ndarray) -> Folder:
    return read_folder(plain(read_task(directory, text), TIME, links, **arrays).write(directory / "result"))


def _names(folder: Folder) -> set[frozenset[str]]:
    return {frozenset((first.name, second.name)) for first, second in body_pairs(folder)}


def test_neighbours_may_touch_and_others_not(tmp_path: Path) -> None:
    pairs = _names(_read(tmp_path, links=3, text=SPHERE + "ground: {height: -1}\n"))
    assert {"finger0_link0", "finger0_link1"} not in pairs
    for pair in (
        {"palm", "finger0_link0"},
        {"palm", "finger0_link1"},
        {"finger0_link0", "finger0_link2"},
        {"finger0_link0", "finger1_link0"},
        {"object", "palm"},
        {"object", "finger1_link2"},
        {"ground", "object"},
        {"ground", "palm"},
    ):
        assert frozenset(pair) in pairs
    assert len(pairs) == 8 * 7 // 2 - 2 * 2 + 8


def test_overlap_with_a_finger_is_the_segments_distance_less_the_radii(tmp_path: Path) -> None:
    # The left finger stands at x = 40 mm from the palm's centre; the ball passes it at half its height, where the
    # distance of its centre from the finger's axis is closest in the middle of the motion, between two samples.
    folder = _read(tmp_path)
    post = folder.links["finger0_link0"].capsules[0]
    rotation = np.asarray(folder.task.palm.rotation)
    foot = np.asarray(folder.task.palm.position) + rotation @ [0.04, 0.0, 0.02]
    side = rotation @ [0.0, 1.0, 0.0]
    passing = foot + rotation @ [0.035, 0.0, 0.0] + np.outer(0.1 * (TIME - 0.45 - 0.0), side)
    folder = _read(tmp_path / "pass", object_position=passing)
    found = penetration_figure(folder, build_trajectory(folder, shoot(folder)))
    assert post.radius == TIP
    assert found.value == pytest.approx(0.03 + TIP - 0.035, abs=2e-6)
    assert "the object and finger 'left' (link 0)" in found.text
    assert found.text.endswith("at 0.45 s")
    assert found.by_interval is not None
    assert found.by_interval.max() == found.by_interval[4] == found.value
    assert found.by_interval[0] < 0.5 * found.value


def test_overlap_with_palm_and_ground(tmp_path: Path) -> None:
    above_palm = np.tile([0.0, 0.0, -0.5 + 0.028], (11, 1))
    folder = _read(tmp_path / "palm", object_position=above_palm)
    found = penetration_figure(folder, build_trajectory(folder, shoot(folder)))
    assert found.value == pytest.approx(0.002, abs=1e-6)
    assert "the object and the palm" in found.text
    sunk = np.tile([0.5, 0.0, -0.9 + 0.027], (11, 1))
    folder = _read(tmp_path / "ground", text=SPHERE + "ground: {height: -0.9}\n", object_position=sunk)
    found = penetration_figure(folder, build_trajectory(folder, shoot(folder)))
    assert found.value == pytest.approx(0.003, abs=1e-6)
    assert "the ground and the object" in found.text


def test_joint_beyond_its_limit_and_its_speed(tmp_path: Path) -> None:
    angles = np.zeros((11, 2))
    angles[:, 1] = 2.8 * np.sin(np.pi * TIME / 2)
    text = SPHERE + "actuator: {torque: 1, speed: 8}\n"
    folder = _read(tmp_path, text=text, joint_angles=angles)
    path = build_trajectory(folder, shoot(folder))
    beyond, speed = joint_figure(folder, path), speed_figure(folder, path)
    assert beyond.value == pytest.approx(np.rad2deg(2.8) - 150.0, abs=1e-6)
    assert "finger1_joint0 of finger 'right'" in beyond.text
    assert beyond.by_interval is not None
    assert beyond.by_interval.max() == beyond.by_interval[-1] == beyond.value
    assert beyond.by_interval[0] == 0
    assert speed.value == pytest.approx(2.8 * np.pi / 2 / 8, rel=1e-3)
    assert speed.holds
