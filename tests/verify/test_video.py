"""A film of a replay: what it shows, and one line where it cannot be made."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from casadi_hands.errors import HandsError
from casadi_hands.export.mjcf import scene_mjcf
from casadi_hands.verify.replays.video import FRAMES, SIZE, film
from tests.verify.fixture import carried

ROOT = Path(__file__).parents[2]
PROGRAM = """
import sys
from types import SimpleNamespace
from casadi_hands.errors import HandsError
from casadi_hands.verify import replay
from casadi_hands.verify.replays.video import film
sys.modules["imageio"] = SimpleNamespace()
for play in (replay, lambda folder: film(folder, "film.gif")):
    try:
        play(sys.argv[1])
    except HandsError as error:
        print(error)
"""


class Blank:
    """Draws nothing, so that a replay can be filmed where there is no graphics context."""

    def __init__(self, *_: object) -> None: ...

    def update_scene(self, *_: object) -> None: ...

    def render(self) -> np.ndarray:
        return np.zeros((*SIZE, 3), np.uint8)

    def close(self) -> None: ...


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scene = carried(tmp_path_factory.mktemp("task"))
    folder = scene.write(tmp_path_factory.mktemp("result"))
    (folder / "scene.xml").write_text(scene_mjcf(scene.task, scene.hand, scene.motion))
    return folder


def test_without_mujoco_the_message_is_one_line(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.setitem(sys.modules, "imageio", SimpleNamespace())
    with pytest.raises(HandsError) as raised:
        film(folder, tmp_path / "film.gif")
    assert str(raised.value) == "replay needs MuJoCo: pip install mujoco"


def test_without_imageio_the_message_is_one_line(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "imageio", None)
    with pytest.raises(HandsError, match=r"^a video needs imageio: pip install 'casadi-hands\[video\]'; replay works"):
        film(folder, tmp_path / "film.gif")


def test_an_opengl_that_mujoco_cannot_load_is_named_in_one_line_filmed_or_not(folder: Path) -> None:
    # MuJoCo reads MUJOCO_GL once, as it is imported.
    environment = {**os.environ, "MUJOCO_GL": "abacus", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(folder)], capture_output=True, text=True, env=environment, timeout=60
    )
    assert done.stderr == ""
    plain, filmed = done.stdout.splitlines()
    assert plain == filmed
    assert re.fullmatch(
        r"MuJoCo cannot be loaded \(.*MUJOCO_GL: abacus\); try MUJOCO_GL=egl or MUJOCO_GL=osmesa, .*", plain
    )


def test_the_advice_to_replay_without_opengl_works(folder: Path) -> None:
    program = "import sys; from casadi_hands.verify import replay; print(replay(sys.argv[1]).dropped)"
    environment = {**os.environ, "MUJOCO_GL": "disable", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", program, str(folder)], capture_output=True, text=True, env=environment, timeout=60
    )
    assert (done.stdout, done.stderr) == ("False\n", "")


def test_what_cannot_be_drawn_or_written_is_one_line(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:

    def refuse(*_: object, **__: object) -> None:
        raise OSError("no such\nplace")

    monkeypatch.setitem(sys.modules, "imageio", SimpleNamespace(mimsave=refuse))
    monkeypatch.setattr(mujoco, "Renderer", refuse)
    with pytest.raises(HandsError, match=r"^MuJoCo cannot draw here \(no such place\); try [^\n]*$"):
        film(folder, "film.gif")
    monkeypatch.setattr(mujoco, "Renderer", Blank)
    with pytest.raises(HandsError, match=r"^film\.gif: cannot be written as a video: no such place; try "):
        film(folder, "film.gif")


def test_a_film_shows_the_whole_replay_and_something_that_moves(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    try:
        mujoco.Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 8, 8).close()
    except Exception as error:  # whatever a missing OpenGL raises
        pytest.skip(f"MuJoCo cannot draw here: {error}")
    written: dict[str, list[np.ndarray]] = {}
    monkeypatch.setitem(
        sys.modules,
        "imageio",
        SimpleNamespace(mimsave=lambda file, frames, fps: written.update({f"{file}@{fps}": frames})),
    )
    film(folder, "film.gif")
    frames = written[f"film.gif@{FRAMES}"]
    # Half a second to settle and the two seconds of the motion.
    assert len(frames) == pytest.approx(2.5 * FRAMES, abs=2)
    assert all(frame.shape == (*SIZE, 3) for frame in frames)
    # The motion ends where it began.
    assert np.abs(frames[0].astype(int) - frames[len(frames) // 2]).mean() > 0.5
