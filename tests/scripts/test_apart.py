from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import apart
import pretended_solves
import pytest
from shared import is_kept, with_seed

from casadi_hands.export.design import Design
from casadi_hands.task import task_to_yaml
from tests.export.example import example_task

TASK = example_task()


def solved(monkeypatch: pytest.MonkeyPatch, folder: Path, how: str, limit: float | None = None) -> Design:
    monkeypatch.setattr(apart, "_work", getattr(pretended_solves, how))
    return apart.solve_apart(TASK, folder, "refine", 1, limit)


def alive(pid: int) -> bool:
    """Whether a process runs; one that has ended and waits for its parent does not."""
    status = Path(f"/proc/{pid}/status")
    return status.exists() and "State:\tZ" not in status.read_text()


def test_solve_that_ends_is_kept_under_its_name_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "one" / "old").write_text("")
    design = solved(monkeypatch, tmp_path / "one", "ends", 1.0)
    assert design.reason == "made by hand"
    assert [each.name for each in tmp_path.iterdir()] == ["one"]
    assert not (tmp_path / "one" / "old").exists()
    assert is_kept(TASK, tmp_path / "one", None)
    assert not is_kept(with_seed(TASK, 7), tmp_path / "one", None)


def test_solve_beyond_its_limit_leaves_what_it_wrote_and_no_process(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    began = time.monotonic()
    design = solved(monkeypatch, tmp_path / "one", "hangs", 0.1)
    assert time.monotonic() - began < 30
    assert design.reason == "stopped after 0.1 min; made by hand"
    assert design.hand is not None
    helper = int((tmp_path / "one" / "helper").read_text())
    deadline = time.monotonic() + 5
    while alive(helper) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not alive(helper)
    # It is only worth another try with more time.
    assert [is_kept(TASK, tmp_path / "one", limit) for limit in (0.05, 0.1, 0.2, None)] == [True, True, False, False]


def test_a_solve_ends_with_the_script_that_began_it(tmp_path: Path) -> None:
    """However that ends: what it has begun would go on for as long as it takes."""
    task = task_to_yaml(TASK)
    program = (
        "import apart; from pathlib import Path; from casadi_hands.task import parse_task\n"
        f"if __name__ == '__main__': apart.solve_apart(parse_task({task!r}), Path('one'), 'refine', 1, None)"
    )
    (tmp_path / "script.py").write_text(program, encoding="utf-8")
    paths = os.pathsep.join([str(Path(apart.__file__).parent), *sys.path])
    script = subprocess.Popen([sys.executable, "script.py"], cwd=tmp_path, env={**os.environ, "PYTHONPATH": paths})
    log, deadline = tmp_path / "one.part" / apart.LOG, time.monotonic() + 60
    while not (log.is_file() and log.read_text(encoding="utf-8")) and time.monotonic() < deadline:
        time.sleep(0.05)
    solves = [int(each) for each in Path(f"/proc/{script.pid}/task/{script.pid}/children").read_text().split()]
    script.kill()
    script.wait()
    assert solves
    deadline = time.monotonic() + 5
    while any(map(alive, solves)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(map(alive, solves))


def test_solve_that_crashes_leaves_what_it_wrote(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    design = solved(monkeypatch, tmp_path / "one", "crashes")
    assert design.reason == "the solver crashed (SIGSEGV); made by hand"
    assert design.motion is not None
    assert not is_kept(TASK, tmp_path / "one", 1.0)


def test_solve_that_raises_before_anything_is_written(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    design = solved(monkeypatch, tmp_path / "one", "raises")
    assert (design.status, design.hand) == ("failed", None)
    assert design.reason == "the solver crashed: ArithmeticError: no numbers left"
