"""The examples, run as somebody else runs them: in a process of its own that cannot import this package."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.metadata import distribution, files
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement
from scipy.spatial.transform import Rotation

from casadi_hands.export.arrays import save_motion
from casadi_hands.export.commands import commanded
from casadi_hands.export.mjcf import scene_mjcf
from casadi_hands.verify import replay
from tests.verify.fixture import carried

PLAYER = Path(__file__).parents[1] / "examples" / "play.py"


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of a Python that has numpy and mujoco, with what they need, and nothing else."""
    place, seen = tmp_path_factory.mktemp("packages"), set()
    wanted = [Requirement("numpy"), Requirement("mujoco")]
    while wanted:
        want = wanted.pop()
        if str(want) in seen:
            continue
        seen.add(str(want))
        name = want.name
        for each in map(Requirement, distribution(name).requires or []):
            if each.marker is None or any(each.marker.evaluate({"extra": extra}) for extra in ("", *want.extras)):
                wanted.append(each)
        for file in files(name) or []:
            top, root = file.parts[0], Path(str(file.locate())).parents[len(file.parts) - 1]
            if top not in ("..", "__pycache__") and not (place / top).exists():
                (place / top).symlink_to(root / top)
    return {**{k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}, "PYTHONPATH": str(place)}


def run(code: list[str], environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-P", "-S", *code], env=environment, capture_output=True, text=True, check=False
    )


def test_the_player_has_no_access_to_this_package(elsewhere: dict[str, str]) -> None:
    found = run(["-c", "import mujoco, casadi_hands"], elsewhere)
    assert "No module named 'casadi_hands'" in found.stderr


def test_the_player_is_short_and_stands_in_the_documents() -> None:
    code = PLAYER.read_text().partition("import sys")[2]
    lines = [line for line in code.splitlines() if line.strip()]
    assert len(lines) <= 20
    assert "casadi_hands" not in code
    assert f"import sys{code}" in (PLAYER.parents[1] / "docs" / "play.md").read_text()


def test_the_player_does_what_the_replay_does(elsewhere: dict[str, str], tmp_path: Path) -> None:
    scene = carried(tmp_path / "task")  # its palm moves
    motion = commanded(scene.task, scene.hand, scene.motion)
    folder = scene.write(tmp_path / "result")
    save_motion(motion, folder / "motion.npz")
    (folder / "scene.xml").write_text(scene_mjcf(scene.task, scene.hand, motion))
    found = run([str(PLAYER), str(folder)], elsewhere)
    assert found.returncode == 0, found.stderr
    pose = np.array([float(word) for word in found.stdout.split()[1:8]])
    expected = replay(folder)
    away = np.linalg.norm(pose[:3] - motion.object_position[-1])
    planned, turned = (Rotation.from_quat(q, scalar_first=True) for q in (motion.object_orientation[-1], pose[3:]))
    assert away == pytest.approx(expected.position_final, abs=2e-4)
    assert np.rad2deg((planned.inv() * turned).magnitude()) == pytest.approx(expected.angle_final, abs=0.5)
    assert away < 2e-3
