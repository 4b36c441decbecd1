"""What `solve` says while it works: the time left, nothing, or a line of JSON an event."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

from casadi_hands.cli.history import Solve, kind_of, remember, remembered
from casadi_hands.errors import ELSEWHERE, DesignError, SolveError
from tests.cli.test_app import run, solve_gives
from tests.export.example import example_design, example_task


def remember_three(seconds: float, **changes: Any) -> None:
    settings = {"version": version("casadi-hands"), "until": "refine", "seeds": 1, "jobs": 2, "warm": False} | changes
    kind = kind_of(example_task(), **settings)
    for _ in range(3):
        remember(Solve(kind, seconds, {"": 0.0, "floating": 0.0, "synthesis": 0.1}))


def events(output: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in output.splitlines()]


def test_the_time_left_is_told_where_it_is_known(
    task_file: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    solve_gives(monkeypatch, example_design())
    assert " left)" not in run("solve", task_file, "--jobs", 1).stderr
    remember_three(1200.0)
    assert "(about 20 min left)" in run("solve", task_file, "--jobs", 2).stderr
    assert " left)" not in run("solve", task_file, "--jobs", 1).stderr


def test_a_solve_is_remembered_with_when_its_stages_began(
    task_file: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    solve_gives(monkeypatch, example_design())
    run("solve", task_file, "--jobs", 2)
    (kept,) = remembered()
    assert kept.began == {"": 0.0, "floating": 0.0, "synthesis": 6.5}
    assert (kept.kind.jobs, kept.kind.version) == (2, version("casadi-hands"))


def test_quiet_prints_the_verdict_alone(
    task_file: Path,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    solve_gives(monkeypatch, replace(example_design(), status="feasible", reason="a limit is missed"))
    found = run("solve", task_file, "--quiet", "--out", tmp_path / "out")
    assert (found.stdout, found.stderr) == (f"{example_task().name}: feasible ({tmp_path / 'out'})\n", "")


def test_json_is_a_line_an_event(
    task_file: Path,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    remember_three(1200.0)
    design = replace(example_design(), status="failed", reason="nothing holds", seconds={"total": 12.3456})
    solve_gives(monkeypatch, design)
    found = run("solve", task_file, "--json", "--jobs", 2, "--out", tmp_path / "out")
    told = events(found.stdout)
    assert (found.exit_code, found.stderr) == (1, "")
    assert [each["event"] for each in told] == ["progress"] * 4 + ["result"]
    assert told[0] | {"left": None} == {
        "event": "progress",
        "stage": "floating",
        "text": "first",
        "seconds": 0.0,
        "left": None,
    }
    assert told[0]["left"] == pytest.approx([1200, 1200], abs=5)
    assert told[-1] == {
        "event": "result",
        "status": "failed",
        "reason": "nothing holds",
        "missed": sorted(design.missed),
        "seconds": 12.346,
        "folder": str(tmp_path / "out"),
        "exit": 1,
    }


def test_json_asks_the_questions_about_the_file(
    task_file: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    solve_gives(monkeypatch, example_design())
    text = task_file.read_text()
    task_file.write_text(text.replace("degrees: 90", "degrees: 1.5708"))
    told = events(run("solve", task_file, "--json").stdout)
    asked = [each["text"] for each in told if each["event"] == "question"]
    assert len(asked) == ("degrees: 90" in text)


@pytest.mark.parametrize("name", ["no.yaml", None])
def test_json_tells_errors_too(
    name: str | None,
    task_file: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    solve_gives(monkeypatch, SolveError("the task allows no hand"))
    found = run("solve", name or task_file, "--json")
    assert isinstance(found.exception, Exception)
    last = events(found.stdout)[-1]
    assert last["event"] == "error"
    assert last["text"].startswith("no.yaml: no such file" if name else "the task allows no hand")


def test_json_tells_what_to_do_about_an_error_too(
    task_file: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    solve_gives(monkeypatch, DesignError("out: cannot write the design here", ELSEWHERE))
    (*_, last) = events(run("solve", task_file, "--json").stdout)
    assert last == {"event": "error", "text": f"out: cannot write the design here\n{ELSEWHERE}"}


def test_quiet_and_json_do_not_go_together(task_file: Path) -> None:
    assert run("solve", task_file, "--json", "--quiet").exit_code == 2
