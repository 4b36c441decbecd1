"""`casadi-hands formulate`: what it is asked for, what it prints, and how it exits."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from casadi_hands.cli import main
from casadi_hands.cli.app import app
from casadi_hands.pipeline import Progress


def run(*arguments: Any) -> Any:
    return CliRunner().invoke(app, ["formulate", *map(str, arguments)])


def test_it_writes_a_folder_and_prints_where_its_page_is(ball_file: Path, tmp_path: Path) -> None:
    done = run(ball_file, "--stage", "floating", "--out", tmp_path / "program")
    assert (done.exit_code, done.stdout) == (0, f"{tmp_path / 'program' / 'index.html'}\n")
    assert "object's motion with 2 floating contacts" in done.stderr
    record = json.loads((tmp_path / "program" / "program.json").read_text(encoding="utf-8"))
    assert (record["stage"], record["step"], record["seed"]) == ("floating", "free", 0)


def test_options_are_handed_on(ball_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[tuple[Any, ...]] = []

    class Saved:
        def save(self, folder: Path) -> Path:
            return folder / "page"

    def formulate(task: Any, stage: str, seed: int | None, *, jobs: int | None, progress: Any) -> Saved:
        calls.append((task.fingers.keys(), stage, seed, jobs))
        progress(Progress(stage, "thinking", 0.0))
        return Saved()

    monkeypatch.setattr("casadi_hands.pipeline.formulate.formulate", formulate)
    done = run(ball_file, "--out", tmp_path)
    assert done.stdout == f"{tmp_path / 'page'}\n"
    assert "thinking" in done.stderr
    run(ball_file, "--out", tmp_path, "--stage", "whole_hand", "--seed", 4, "--jobs", 2)
    assert [call[1:] for call in calls] == [("refine", None, None), ("whole_hand", 4, 2)]
    assert set(calls[0][0]) == {"left", "right"}


@pytest.mark.parametrize("wrong", [["--stage", "refined", "--out", "d"], ["--seed", "-1", "--out", "d"], []])
def test_a_wrong_option_exits_2_and_runs_nothing(
    wrong: list[str], ball_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("casadi_hands.task.load_task", lambda _: pytest.fail("loaded"))
    assert run(ball_file, *wrong).exit_code == 2


def test_a_task_that_is_none_and_a_file_in_the_way_are_one_message(
    ball_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PYTHONWARNINGS", "default")  # which the command changes for what it starts
    for task, message in ((tmp_path / "no.yaml", "no such file"), (ball_file, "cannot write the program here")):
        arguments = ["formulate", str(task), "--stage", "floating", "--out", str(ball_file)]
        monkeypatch.setattr(sys, "argv", ["casadi-hands", *arguments])
        with pytest.raises(SystemExit) as exit_:
            main()
        out, err = capsys.readouterr()
        assert (exit_.value.code, out) == (2, "")
        assert message in err
        assert "Traceback" not in err
