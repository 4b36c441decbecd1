"""Processes that die, hang, or lose the one that started them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from casadi_hands.execution.journal import Journal
from casadi_hands.execution.processes import processes, run_all
from casadi_hands.execution.workers import ATTEMPTS, LostCallError, Workers


def dying(folder: Path, value: int, times: int) -> int:
    """The value, unless this is one of the first so many attempts, which end the process."""
    attempt = len(list(folder.glob(f"{value}-*")))
    (folder / f"{value}-{attempt}").touch()
    if attempt < times:
        os.kill(os.getpid(), signal.SIGKILL)
    return value


def endless(value: int) -> int:
    while value == 1:
        pass
    return value


def test_a_call_whose_process_dies_is_run_again(tmp_path: Path) -> None:
    with processes(2) as executor:
        found = run_all(executor, dying, [(tmp_path, value, value % ATTEMPTS) for value in range(6)], lambda *_: None)
    assert found == list(range(6))
    assert [len(list(tmp_path.glob(f"{value}-*"))) for value in range(6)] == [1, 2, 3, 1, 2, 3]


def test_one_that_always_takes_its_process_with_it_is_named(tmp_path: Path) -> None:
    with (
        processes(2) as executor,
        pytest.raises(LostCallError, match=r"^trial 3: the process that ran it ended each of 3 times: signal 9 \(SIGK"),
    ):
        run_all(executor, dying, [(tmp_path, 7, 99)], lambda *_: None, name=lambda _: "trial 3")
    assert len(list(tmp_path.iterdir())) == ATTEMPTS


def test_one_that_hangs_is_ended_and_the_others_are_not_held_up() -> None:
    workers = Workers(2, longest=6.0)
    try:
        for idle in [workers.submit(endless, 0) for _ in range(4)]:  # so that they have started
            idle.result()
        futures = [workers.submit(endless, value) for value in (1, 2, 3, 4)]
        assert [future.result() for future in futures[1:]] == [2, 3, 4]
        with pytest.raises(LostCallError, match=r"it did not end in 0.1 min and was stopped"):
            futures[0].result()
        assert workers.submit(endless, 5).result() == 5
    finally:
        workers.stop()


def test_results_that_are_kept_are_not_computed_again(tmp_path: Path) -> None:
    (tmp_path / "calls").mkdir()
    work = [(tmp_path / "calls", value, 0) for value in range(4)]
    with processes(2) as executor:
        heard: list[int] = []
        for _ in range(2):
            kept = Journal(tmp_path / "units").section("calls")
            assert run_all(executor, dying, work, lambda _, value: heard.append(value), kept) == [0, 1, 2, 3]
    assert sorted(heard[:4]) == sorted(heard[4:]) == [0, 1, 2, 3]
    assert len(list((tmp_path / "calls").iterdir())) == 4


PARENT = """
import ctypes, os, sys, time
from pathlib import Path
from casadi_hands.execution.workers import Workers

def hold(folder):
    Path(folder, str(os.getpid())).touch()
    ctypes.PyDLL(None).sleep(60)  # as a solver does, it holds the interpreter

if __name__ == "__main__":
    workers = Workers(2)
    for _ in range(2):
        workers.submit(hold, sys.argv[1])
    time.sleep(60)
"""


def alive(pid: int) -> bool:
    state = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True, check=False).stdout
    return bool(state.strip()) and not state.startswith("Z")


def test_processes_end_with_the_one_that_started_them_however_that_ends(tmp_path: Path) -> None:
    (tmp_path / "pids").mkdir()
    script = tmp_path / "parent.py"
    script.write_text(PARENT)
    with subprocess.Popen([sys.executable, str(script), str(tmp_path / "pids")]) as parent:
        last = time.monotonic() + 60
        while len(list((tmp_path / "pids").iterdir())) < 2 and time.monotonic() < last:
            time.sleep(0.05)
        pids = [int(each.name) for each in (tmp_path / "pids").iterdir()]
        assert len(pids) == 2
        assert all(alive(pid) for pid in pids)
        parent.kill()
        parent.wait()
    last = time.monotonic() + 2
    while any(alive(pid) for pid in pids) and time.monotonic() < last:
        time.sleep(0.02)
    assert not any(alive(pid) for pid in pids)
