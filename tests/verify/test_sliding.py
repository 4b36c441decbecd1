"""Friction of contacts that slide, on made-up folders: a ball dragged over the ground."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.verify.figures.contact import slip_figure
from casadi_hands.verify.figures.dynamics import shoot
from casadi_hands.verify.figures.sliding import CREEP, sliding_figure
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.report import Figure
from casadi_hands.verify.trajectory import build_trajectory, sample_placements
from tests.verify.fixture import SPHERE, plain, read_task

TIME = np.linspace(0.0, 1.0, 11)
GROUND = (
    SPHERE.replace("[0, 0, -0.5], facing: [0, 0, 1]", "[0, 0, 0.5], facing: [0, 0, -1]")
    + "ground: {height: -0.03, friction: 0.4}\nlimits: {slip: 0.1}\n"
)
WEIGHT, FRICTION = 0.2 * 9.81, 0.4


def _dragged(directory: Path, travel: float, force: tuple[float, float], rolled: float = 0.0) -> Folder:
    """A ball that goes along x by ``travel`` m, and the ground's force across, over its weight."""
    task = read_task(directory, GROUND)
    way = travel * TIME
    position, turn = np.outer(way, [1.0, 0, 0]), Rotation.from_rotvec(np.outer(rolled * way / 0.03, [0, 1.0, 0]))
    at = turn.apply([0, 0, -0.03], inverse=True)
    scene = plain(
        task,
        TIME,
        object_position=position,
        object_orientation=turn.as_quat(scalar_first=True),
        contact_names=("left", "right", "ground"),
        contact_link=("finger0_link0", "finger1_link0", "ground"),
        contact_active=np.tile([False, False, True], (11, 1)),
        contact_force=WEIGHT * np.tile([[0, 0, 0], [0, 0, 0], [*force, 1.0]], (11, 1, 1)),
        contact_point_object=np.stack([0 * at, 0 * at, at], axis=1),
        contact_point_link=np.stack([0 * at, 0 * at, position - np.array([0, 0, 0.03])], axis=1),
    )
    return read_folder(scene.write(directory / "result"))


def _figure(folder: Folder) -> Figure:
    return sliding_figure(folder, sample_placements(folder), build_trajectory(folder, shoot(folder)))


@pytest.mark.parametrize("way", [1, -1])
def test_friction_on_the_cone_against_the_slip_holds(tmp_path: Path, way: int) -> None:
    found = _figure(_dragged(tmp_path, way * 0.05, (-way * FRICTION, 0.0)))
    assert found.value < 1e-9
    assert found.holds


@pytest.mark.parametrize(
    ("force", "off"),
    [((-0.5 * FRICTION, 0.0), 0.5), ((0.0, 0.0), 1.0), ((FRICTION, 0.0), 2.0), ((0.0, FRICTION), np.sqrt(2))],
)
def test_friction_off_its_cone_or_another_way_is_refused(
    tmp_path: Path, force: tuple[float, float], off: float
) -> None:
    folder = _dragged(tmp_path, 0.05, force)
    found = _figure(folder)
    assert found.value == pytest.approx(off, rel=1e-6)
    assert not found.holds
    assert found.text.startswith("contact 'ground' slides at 0 s with friction ")
    assert found.text.endswith(" off its cone against the slip")
    assert slip_figure(folder, build_trajectory(folder, shoot(folder))).holds


def test_what_rolls_creeps_or_hardly_slips_may_have_any_force(tmp_path: Path) -> None:
    for i, (travel, rolled) in enumerate(((0.05, 1.0), (0.9e-3, 0.0), (0.9 * CREEP, 0.0))):
        found = _figure(_dragged(tmp_path / str(i), travel, (0.0, 0.1), rolled))
        assert found.value == 0.0
        assert found.text == "no contact slides"
