"""Goal errors against poses shifted by known amounts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.verify.figures.goals import goal_figures
from casadi_hands.verify.reading.folder import read_folder
from tests.verify.fixture import SPHERE, plain, read_task

TIME = np.linspace(0.0, 1.0, 11)


def test_goal_errors_are_distance_and_angle(tmp_path: Path) -> None:
    position = np.zeros((11, 3))
    position[-1] = [3e-4, 4e-4, 0]
    turn = Rotation.from_rotvec(np.outer(TIME == 1.0, np.deg2rad([0.6, 0, 0.8]))).as_quat(scalar_first=True)
    scene = plain(read_task(tmp_path, SPHERE), TIME, object_position=position, object_orientation=turn)
    distance, angle = goal_figures(read_folder(scene.write(tmp_path / "result")))
    assert distance.value == pytest.approx(5e-4)
    assert angle.value == pytest.approx(1.0)
    assert distance.text == "the object is 0.5 mm from goal 2 at 1 s"
    assert angle.reason == "the object is turned 1 deg from goal 2 at 1 s; limit 0.5 deg"


def test_a_motion_that_ends_early_misses_its_goal(tmp_path: Path) -> None:
    scene = plain(read_task(tmp_path, SPHERE), 0.9 * TIME)
    distance, _ = goal_figures(read_folder(scene.write(tmp_path / "result")))
    assert not distance.holds
    assert "does not reach the time of goal 2" in distance.text


def test_a_drawing_is_judged_by_its_tool(tmp_path: Path) -> None:
    # A quarter turn about y takes the tool from below the ball's centre to its left.
    text = SPHERE.replace("at: 0, position: [0, 0, 0]", "at: 0, tool_at: [0, 0, -0.03]")
    text = text.replace("at: 1, position: [0, 0, 0]", "at: 1, tool_at: [-0.03, 0, 0]") + "tool: [0, 0, -0.03]\n"
    task = read_task(tmp_path, text)
    turn = Rotation.from_rotvec(np.outer(TIME, [0, np.pi / 2, 0])).as_quat(scalar_first=True)
    stood = np.tile([0.0, 0.0, 1e-4], (11, 1))
    scene = plain(task, TIME, object_position=stood, object_orientation=turn)
    (distance,) = goal_figures(read_folder(scene.write(tmp_path / "result")))
    assert distance.value == pytest.approx(1e-4)
    assert distance.text.startswith("the tool is 0.1 mm from goal")
