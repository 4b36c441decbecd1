"""The command `solve` where it is stopped, goes on, is refused, or finds no room."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from casadi_hands.cli.app import app
from casadi_hands.errors import DesignError
from casadi_hands.export.design import Design
from casadi_hands.export.place import beside
from casadi_hands.pipeline.unfinished import Request
from casadi_hands.task import parse_task
from tests.export.example import TASK, example_design

MAIN = [sys.executable, "-c", "from casadi_hands.cli import main; main()", "solve"]


def run(*arguments: Any) -> Any:
    return CliRunner().invoke(app, ["solve", *(str(argument) for argument in arguments)])


def started(ball_file: Path, out: Path, temporary: Path) -> subprocess.Popen[str]:
    """A solve with two workers, that has finished a unit of its search."""
    temporary.mkdir()
    process = subprocess.Popen(
        [*MAIN, str(ball_file), "--out", str(out), "--jobs", "2"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(temporary)},
        start_new_session=True,
    )
    last = time.monotonic() + 120
    while len(list(beside(out).glob("units/*.npz"))) < 2:
        assert process.poll() is None
        assert time.monotonic() < last
        time.sleep(0.02)
    return process


def left_of(session: int) -> list[str]:
    listed = subprocess.run(["ps", "-eo", "sess=,stat=,args="], capture_output=True, text=True, check=True).stdout
    rows = [line.split(maxsplit=2) for line in listed.splitlines()]
    return [row[2] for row in rows if int(row[0]) == session and not row[1].startswith("Z")]


@pytest.mark.parametrize("sign", [signal.SIGTERM, signal.SIGKILL])
def test_all_its_processes_end_with_it_and_nothing_temporary_stays(
    sign: signal.Signals, ball_file: Path, tmp_path: Path
) -> None:
    out, temporary = tmp_path / "out", tmp_path / "tmp"
    process = started(ball_file, out, temporary)
    assert len(left_of(process.pid)) >= 3
    process.send_signal(sign)
    last = time.monotonic() + 2
    while left_of(process.pid) and time.monotonic() < last:
        process.poll()
        time.sleep(0.02)
    assert left_of(process.pid) == []
    _, err = process.communicate(timeout=10)
    if sign == signal.SIGTERM:
        assert process.returncode == 143
        assert f"casadi-hands solve --resume {out}" in err
        assert {each.name for each in beside(out).iterdir()} == {
            "lock",
            "request.json",
            "task.yaml",
            "units",
            "written",
        }
    assert list(temporary.iterdir()) == []
    # It ended before a hand was designed, and left what there was, whole.
    assert Design.load(out).motion is not None
    # Who comes next clears the rest away.
    assert run(ball_file, "--out", out, "--jobs", 1, "--until", "floating").exit_code == 0
    assert {each.name for each in tmp_path.iterdir()} == {"ball.yaml", "out", "tmp"}


BUSY = """
import sys
import casadi_hands.pipeline
from casadi_hands.cli import main

def solve(task, **settings):
    print("solving", flush=True)
    sum(range(10**12))  # lets no handler of Python's run, as CasADi does while it builds a function

casadi_hands.pipeline.solve = solve
sys.argv = ["casadi-hands", "solve", *sys.argv[1:]]
main()
"""


def test_one_that_cannot_heed_a_signal_is_ended_all_the_same(ball_file: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-c", BUSY, str(ball_file), "--out", str(tmp_path / "out")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        assert process.stdout.readline() == "solving\n"
        time.sleep(1.0)
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=10) == -signal.SIGKILL


def test_a_full_disk_is_one_message_and_leaves_no_empty_files(ball_file: Path, tmp_path: Path) -> None:
    def small_files() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))  # the page is larger

    found = subprocess.run(
        [*MAIN, str(ball_file), "--out", str(tmp_path / "out"), "--jobs", "1", "--until", "floating"],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=small_files,
    )
    assert found.returncode == 2
    *_, what, remedy = found.stderr.splitlines()
    assert what == f"casadi-hands: {tmp_path}/out: cannot write the design here: File too large"
    assert remedy == "give another folder, which you may write to"
    assert "Traceback" not in found.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("name", "words"),
    [("n" * 300, "File name too long"), ("ball.yaml", "it is a file"), ("ball.yaml/out", "Not a directory")],
)
def test_a_folder_that_cannot_be_is_refused_at_once(
    name: str, words: str, ball_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("casadi_hands.pipeline.run._solve", lambda *_: pytest.fail("it was solved"))
    found = run(ball_file, "--out", ball_file.parent / name)
    assert isinstance(found.exception, DesignError)  # of which `main` makes a message and exit status 2
    assert f"cannot write the design here: {words}" in str(found.exception)
    assert len(str(found.exception)) < 300


def test_a_certified_result_is_named_with_the_way_to_replace_it(ball_file: Path, tmp_path: Path) -> None:
    replace(example_design(), status="certified").save(tmp_path / "out")
    found = run(ball_file, "--out", tmp_path / "out")
    assert isinstance(found.exception, DesignError)
    assert "holds a certified result of another task (move a capsule & back) already" in str(found.exception)
    assert "--force" in found.exception.__notes__[0]


def test_force_and_what_was_asked_for_reach_the_solve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[dict[str, Any]] = []

    def recorded(kind: str, given: Any) -> Callable[..., Any]:
        return lambda task, **settings: (calls.append({"kind": kind, "task": task, **settings}), given)[1]

    monkeypatch.setattr("casadi_hands.pipeline.solve", recorded("solve", example_design()))
    monkeypatch.setattr("casadi_hands.pipeline.alternatives.explore", recorded("explore", []))
    task = parse_task(TASK)
    stopped = Request("hash", "whole_hand", None, "there", force=False, program={})
    monkeypatch.setattr("casadi_hands.pipeline.unfinished.stopped_solve", lambda folder: (task, stopped))
    (tmp_path / "task.yaml").write_text(TASK)
    run(tmp_path / "task.yaml", "--out", tmp_path, "--force")
    run("--resume", tmp_path, "--jobs", 3)
    stopped = replace(stopped, seeds=(4, 5), force=True, start=None)
    run("--resume", tmp_path)
    first, second, third = calls
    assert (first["force"], first["resume"]) == (True, False)
    assert (second["kind"], second["task"], second["out"]) == ("solve", task, tmp_path)
    assert (second["until"], second["start"], second["jobs"]) == ("whole_hand", Path("there"), 3)
    assert (second["force"], second["resume"]) == (False, True)
    assert (third["kind"], third["seeds"], third["force"], third["resume"]) == ("explore", (4, 5), True, True)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "give a task file, or --resume DIR"),
        (["--resume", "there", "--seed", "3", "--seeds", "2"], "leave out --seed, --seeds"),
        (["task.yaml", "--resume", "there", "--until", "floating"], "leave out TASK, --until"),
    ],
)
def test_options_that_do_not_go_with_going_on(arguments: list[str], words: str) -> None:
    found = run(*arguments)
    assert found.exit_code == 2
    assert words in " ".join(found.stderr.replace("│", " ").split())


def test_where_nothing_was_stopped_the_message_says_what_is_there(tmp_path: Path) -> None:
    found = run("--resume", tmp_path / "out")
    assert str(found.exception).endswith("was stopped; nothing was kept for it; leave --resume out")
    example_design().save(tmp_path / "out")
    assert str(run("--resume", tmp_path / "out").exception).endswith("a finished result is there; leave --resume out")
