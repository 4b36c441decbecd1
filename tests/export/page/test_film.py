"""Pictures and GIFs are of the motion at its times, and what is missing is told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from casadi_hands.cli.app import app
from casadi_hands.errors import HandsError
from casadi_hands.export.page.film import FRAME, GIF_SIZE, PICTURE_SIZE, write_gif, write_png
from tests.export.browser import needs_browser
from tests.export.example import example_design, example_motion


def yellow_middle(picture):
    """Mean column of the object's dark patches, in shares of the width."""
    pixels = np.asarray(picture.convert("RGB"), float)
    _, columns = np.nonzero((pixels[..., 0] > pixels[..., 1]) & (pixels[..., 1] > pixels[..., 2] + 50))
    assert len(columns) > 100
    return columns.mean() / picture.width


@needs_browser
def test_a_gif_shows_the_motion_in_its_time_and_a_picture_one_moment(tmp_path):
    motion = example_motion()
    short = replace(example_design(), motion=replace(motion, time=0.205 * motion.time))  # there and back in 0.41 s
    short.save(tmp_path / "design")
    files = [tmp_path / "a.gif", tmp_path / "there.png"]
    wanted = ["view", str(tmp_path / "design"), "--gif", str(files[0]), "--png", str(files[1]), "--at", "0.205"]
    result = CliRunner().invoke(app, wanted)
    assert result.exit_code == 0, result.output
    assert set(result.output.split()) == {str(file) for file in files}
    gif, there = (Image.open(file) for file in files)
    assert (gif.size, there.size) == (GIF_SIZE, PICTURE_SIZE)
    assert gif.info["loop"] == 0
    places, seconds = [], []
    for k in range(gif.n_frames):
        gif.seek(k)
        places.append(yellow_middle(gif))
        seconds.append(gif.info["duration"] / 1e3)
    assert sum(seconds[:-1]) == pytest.approx(0.41, abs=FRAME / 2)
    assert len(places) == round(0.41 / FRAME) + 1
    # There and back: the frame nearest to the middle is where the picture is, the last where the first is.
    away = np.abs(np.array(places) - places[0])
    assert away[-1] < 0.01
    assert away.argmax() == 3
    assert abs(yellow_middle(there) - places[0]) == pytest.approx(away.max(), rel=0.2)
    assert away.max() > 0.02


def test_a_moment_outside_of_the_motion_is_refused(tmp_path):
    with pytest.raises(HandsError, match="no picture at 3 s; allowed: 0 to 2 s"):
        write_png(example_design(), tmp_path / "a.png", 3.0)


def test_without_a_motion_there_is_no_gif(tmp_path):
    with pytest.raises(HandsError, match="no motion"):
        write_gif(replace(example_design(), motion=None), tmp_path / "a.gif")


def test_without_pillow_the_message_says_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "PIL.Image", None)
    with pytest.raises(HandsError, match=r"pip install 'casadi-hands\[video\]'"):
        write_gif(example_design(), tmp_path / "a.gif")


def run(*arguments):
    return CliRunner().invoke(app, ["view", *map(str, arguments)])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["b", "--png", "x.png"], "draw one design, and two folders are given"),
        (["--at", "1"], "--at is for --png"),
        (["--out", "x.html"], "--out is for the page of two"),
    ],
)
def test_options_that_do_not_go_together_are_told(options, words, tmp_path):
    example_design().save(tmp_path / "a")
    found = run(tmp_path / "a", *options)
    assert found.exit_code != 0
    assert words in str(found.exception)


def test_without_a_browser_the_message_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr("shutil.which", lambda name: None)
    example_design().save(tmp_path / "a")
    found = run(tmp_path / "a", "--png", tmp_path / "x.png")
    assert "there is none of chromium" in str(found.exception)
    assert "apt-get install chromium" in str(found.exception)
    assert not Path(tmp_path / "x.png").exists()
