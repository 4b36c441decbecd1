"""A task that nothing was solved for is drawn with its contacts and goals, each by its name."""

from __future__ import annotations

import json
import re
from base64 import b64decode

import numpy as np
import pytest
import umsgpack
from PIL import Image
from typer.testing import CliRunner

from casadi_hands.cli.app import app
from casadi_hands.errors import HandsError
from casadi_hands.export.page.film import PICTURE_SIZE
from casadi_hands.export.page.task_page import write_task_page
from casadi_hands.task import load_task
from casadi_hands.task.keep_out import KeepOut
from tests.documents import ROOT
from tests.export.browser import Browser, needs_browser
from tests.export.example import example_design, example_task


def page_data(path):
    text = path.read_text(encoding="utf-8")
    return json.loads(re.search(r'<script id="design" type="application/json">(.*?)</script>', text)[1])


def placed(data):
    """World positions (3,), m times the page's scale, of all nodes by path."""
    local = {}
    for command in (umsgpack.unpackb(b64decode(each)) for each in data["commands"]):
        if command["type"] == "set_transform":
            local[command["path"].strip("/")] = np.reshape(command["matrix"], (4, 4), order="F")
    found = {}
    for path in local:
        steps, pose = path.split("/"), np.eye(4)
        for end in range(1, len(steps) + 1):
            pose = pose @ local.get("/".join(steps[:end]), np.eye(4))
        found[path] = pose
    return found


def test_contacts_and_goals_stand_where_the_task_has_them(tmp_path):
    task = example_task()
    write_task_page(task, tmp_path / "task.html", "not solved")
    data = page_data(tmp_path / "task.html")
    poses = placed(data)
    assert [label["text"] for label in data["labels"]] == [*task.fingers, "start, 2 s", "1 s"]
    by_text = {label["text"]: poses["/".join(label["path"])] for label in data["labels"]}
    scale = np.linalg.norm(poses["design"][:3, 0])
    start, other = by_text["start, 2 s"][:3, 3], by_text["1 s"]
    # What the example's text says, in millimetres from the first goal.
    expected = {"thumb": [0, 20, -10], "index": [0, -20, 20], "middle": [0, -20, -30]}
    for name, place in expected.items():
        assert 1e3 / scale * (by_text[name][:3, 3] - start) == pytest.approx(place, abs=1e-3)
    assert 1e3 / scale * (other[:3, 3] - start) == pytest.approx([40, 0, 0], abs=1e-3)
    assert other[:2, 0] / scale == pytest.approx([np.cos(np.radians(30)), np.sin(np.radians(30))], abs=1e-6)


def test_a_design_with_a_hand_has_no_such_names(tmp_path):
    example_design().save(tmp_path)
    assert page_data(tmp_path / "viewer.html")["labels"] == []


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    with pytest.raises(HandsError, match=r"none/task\.html: cannot be written: No such file"):
        write_task_page(example_task(), tmp_path / "none" / "task.html", "")


def test_check_shows_a_drawing_task(tmp_path):
    file, page = ROOT / "problems/draw_box.yaml", tmp_path / "task.html"
    result = CliRunner().invoke(app, ["check", str(file), "--show", str(page)])
    assert result.exit_code == 0
    assert result.output.splitlines()[-1] == str(page)
    texts = [label["text"] for label in page_data(page)["labels"]]
    assert texts == [*load_task(file).fingers, "start", "2 s", "4 s", "6 s", "8 s"]


@needs_browser
def test_a_browser_puts_the_names_beside_what_they_name(tmp_path):
    write_task_page(example_task(), tmp_path / "task.html", "not solved")
    # Where the browser's own library puts the dots.
    probe = """[...document.querySelectorAll(".label")].map((label) => {
      const entry = design.labels.find((each) => each.text === label.textContent);
      const at = viewer.scene_tree.find(entry.path).object.getWorldPosition(viewer.camera.position.clone());
      at.project(viewer.camera);
      const box = label.getBoundingClientRect();
      return [label.textContent, box.left - (at.x + 1) / 2 * innerWidth, box.top - (1 - at.y) / 2 * innerHeight,
        box.width, at.x, at.y];
    })"""
    with Browser() as browser:
        browser.open(tmp_path / "task.html")
        browser.wait("document.querySelectorAll('.label[style*=visible]').length === 5")
        told = browser.evaluate(probe)
    assert {name for name, *_ in told} == {"thumb", "index", "middle", "start, 2 s", "1 s"}
    for _, right, below, width, x, y in told:
        assert right == pytest.approx(9, abs=1)
        assert -10 < below < 60
        assert width > 20
        assert abs(x) < 1
        assert abs(y) < 1


def test_boxes_that_the_palm_keeps_off_stand_where_the_task_has_them(tmp_path):
    turn = {"axis": [0, 0, 1], "degrees": 30}
    box = {"center": [0.1, -0.2, 0.3], "size": [0.02, 0.04, 0.06], "rotation": turn}
    task = example_task()
    task = task.model_copy(update={"keep_out": (KeepOut.model_validate({"box": box}),)})
    write_task_page(task, tmp_path / "task.html", "not solved")
    data = page_data(tmp_path / "task.html")
    poses = placed(data)
    scale = np.linalg.norm(poses["design"][:3, 0])
    (path,) = (path for path in poses if path.endswith("keep out/box 1"))
    start = np.array(task.goal_poses()[0][1])
    first = poses["design/object"][:3, 3]
    assert (poses[path][:3, 3] - first) / scale + start == pytest.approx(box["center"], abs=1e-6)
    assert poses[path][:2, 0] / scale == pytest.approx([np.cos(np.radians(30)), np.sin(np.radians(30))], abs=1e-6)


@needs_browser
def test_check_draws_a_picture_of_the_page(tmp_path):
    file, picture = ROOT / "problems/draw_box.yaml", tmp_path / "task.png"
    result = CliRunner().invoke(app, ["check", str(file), "--show", str(picture)])
    assert result.exit_code == 0, result.output
    drawn = Image.open(picture)
    assert drawn.size == PICTURE_SIZE
    assert len(np.unique(np.asarray(drawn.convert("RGB")).reshape(-1, 3), axis=0)) > 1000  # not a blank page


@pytest.mark.parametrize(("name", "words"), [("task.gif", "ends in .html or .png"), ("no/task.html", "another folder")])
def test_where_check_cannot_draw_is_told(tmp_path, name, words):
    result = CliRunner().invoke(app, ["check", str(ROOT / "problems/draw_box.yaml"), "--show", str(tmp_path / name)])
    assert words in str(result.exception)
