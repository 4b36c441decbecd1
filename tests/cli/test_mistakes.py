"""Files with one mistake each: what `check` says of it, how it exits, and that `solve` says it too."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from casadi_hands import solve
from casadi_hands.cli.app import app
from casadi_hands.export.design import Design
from casadi_hands.pipeline import Progress, run
from casadi_hands.pipeline.record import Record
from casadi_hands.task import load_task, parse_task

PROBLEMS = Path(__file__).parents[2] / "problems"
BALL = """\
name: ball below
object: {mass: 0.06, shapes: [{sphere: {center: [0, 0, 0], radius: 0.022}}]}
palm: {position: [0, 0, 0.3], facing: [0, 0, -1]}
motion:
  - {at: 0, position: [0, 0, 0.2]}
  - {at: 3, position: [0, 0, 0.19]}
fingers:
  a: {touches: [0.022, 0, 0]}
  b: {touches: [-0.011, 0.019, 0]}
  c: {touches: [-0.011, -0.019, 0]}
"""
# What is replaced in BALL, by what; the exit code of `check`, and what it says.
MISTAKES = {
    "millimetres": (
        [("0.022", "22"), ("0.011", "11"), ("0.019", "19"), ("0.3]", "300]"), ("0.2]", "200]"), ("0.19]", "190]")],
        2,
        "2: object.shapes: given an object 44 m long of 0.06 kg, 1.3e-06 kg/m³; allowed: lengths in m, masses in kg, "
        "of 0.1 kg/m³ and more; is the file in millimetres?",
    ),
    "faces away": (
        [("[0, 0, -1]", "[0, 0, 1]")],
        1,
        "no hand can do this: the object is behind the palm at every goal, by 78 mm or more: fingers point to [0, 0, "
        "1] (palm.facing), and it is on the other side; try palm.facing [0, 0, -1]",
    ),
    "too far": (
        [("0.3]", "2.4]"), ("fingers:", "hand: {link_length: [0.02, 0.2]}\nfingers:")],
        1,
        "it is 2188 mm from the palm's centre, and a finger of 3 links of at most 200 mm each, on the palm's rim, "
        "reaches 637.4 mm",
    ),
    "far away with links to match": (
        [("0.3]", "2.4]")],
        0,
        "3: palm.position: the palm is 2.21 m from the object, 50 times its length; is the file in millimetres",
    ),
    "real part last": (
        [
            ("0.2]", "0.2], rotation: {quaternion: [0, 0, 0, 1]}"),
            ("0.19]", "0.19], rotation: {quaternion: [0, 0, 0, 1]}"),
        ],
        2,
        "5: motion[0].rotation.quaternion: given [0, 0, 0, 1]; allowed: [w, x, y, z]; is the order of this one x, y, "
        "z, w, a turn by 0°? Then write [1, 0, 0, 0]",
    ),
    "a bound on forces": (
        [("fingers:", "perturbations: [{from: 0, to: 2, torque: [0, 0, -0.3]}]\nhand: {contact_force: 15}\nfingers:")],
        1,
        "to withstand the task's torque of 0.3 N·m at friction 0.5 (friction); hand.contact_force allows 15 (8.83 N); "
        "try hand.contact_force: 69",
    ),
    "much force": (
        [("fingers:", "perturbations: [{from: 0, to: 2, torque: [0, 0, -0.3]}]\nfingers:")],
        0,
        "may fail: contact 'b' must bear at least 17.2 weights (10.1 N) along an axis of the object",
    ),
    "weak motors": (
        [("fingers:", "actuator: {torque: 0.005}\nfingers:")],
        0,
        "motors give 0.005 N·m (actuator.torque)",
    ),
    "one finger": (
        [("  b: {touches: [-0.011, 0.019, 0]}\n  c: {touches: [-0.011, -0.019, 0]}\n", "gravity: [0, 0, 0]\n")],
        1,
        "finger 'a' is the only contact, a finger can only push, and the object must start and end at rest",
    ),
}


def spoilt(kind: str) -> str:
    text = BALL
    for old, new in MISTAKES[kind][0]:
        assert old in text
        text = text.replace(old, new)
    return text


def checked(path: Path) -> tuple[int, str]:
    found = CliRunner().invoke(app, ["check", str(path)])
    return found.exit_code, " ".join(f"{found.exception or ''} {found.output}".split())


@pytest.mark.parametrize("kind", MISTAKES)
def test_check_names_the_mistake(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "spoilt.yaml"
    path.write_text(spoilt(kind))
    _, exits, says = MISTAKES[kind]
    code, text = checked(path)
    assert says in text
    # What cannot be used is raised, and exits 2 by the command's own handler.
    assert code == (1 if exits == 2 else exits)


@pytest.mark.parametrize(
    "path", [BALL, *sorted(PROBLEMS.rglob("*.yaml"))], ids=lambda each: getattr(each, "stem", "ball")
)
def test_of_what_is_right_nothing_is_asked(path: Path | str, tmp_path: Path) -> None:
    if isinstance(path, str):
        (tmp_path / "ball.yaml").write_text(path)
        path = tmp_path / "ball.yaml"
    code, text = checked(path)
    assert code == 0
    assert not any(words in text for words in ("is this meant?", "may fail:", "no hand can do this:"))


def stages_give(monkeypatch: pytest.MonkeyPatch, status: Any) -> None:
    def all_stages(record: Record, *_: Any) -> Design:
        return replace(record.design, status=status, reason="" if status == "certified" else "it slips")

    monkeypatch.setattr(run, "_run", all_stages)


def test_solve_says_what_may_fail_first_and_again_where_it_does(monkeypatch: pytest.MonkeyPatch) -> None:
    news: list[Progress] = []
    stages_give(monkeypatch, "feasible")
    design = solve(parse_task(spoilt("much force")), jobs=1, progress=news.append)
    assert [word.stage for word in news] == ["check"]
    assert "must bear at least 17.2 weights" in news[0].text
    assert design.reason.startswith(
        "it slips. The task alone says that contact 'b' must bear at least 17.2 weights (10.1"
    )
    stages_give(monkeypatch, "certified")
    assert solve(parse_task(spoilt("much force")), jobs=1).reason == ""


def test_solve_says_no_more_than_the_stages_where_nothing_is_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    stages_give(monkeypatch, "failed")
    assert solve(load_task(PROBLEMS / "pill_turn.yaml"), jobs=1).reason == "it slips"


def test_solve_asks_about_the_file(tmp_path: Path) -> None:
    path = tmp_path / "far.yaml"
    path.write_text(spoilt("too far"))
    found = CliRunner().invoke(app, ["solve", str(path), "--out", str(tmp_path / "out"), "--jobs", "1"])
    assert found.exit_code == 1
    text = " ".join(found.output.split())
    assert "is this meant?" in text
    assert "why: the object is out of reach at goal 2 (3 s)" in text
