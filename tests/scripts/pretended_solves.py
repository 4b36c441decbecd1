"""What stands in for a solve: the same arguments, run in the same way in a process of its own."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import time
from pathlib import Path

from casadi_hands.task import Task
from tests.export.example import example_design


def ends(task: object, folder: Path, until: str, jobs: int | None) -> None:
    example_design().save(folder)


def hangs(task: object, folder: Path, until: str, jobs: int | None) -> None:
    os.setsid()
    helper = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(300)"])
    (folder / "helper").write_text(str(helper.pid), encoding="utf-8")
    example_design().save(folder)
    time.sleep(300)


def crashes(task: object, folder: Path, until: str, jobs: int | None) -> None:
    example_design().save(folder)
    ctypes.string_at(0)


def crashes_with_seed_0(task: Task, folder: Path, until: str, jobs: int | None) -> None:
    (crashes if task.search.seed == 0 else ends)(task, folder, until, jobs)


def raises(task: object, folder: Path, until: str, jobs: int | None) -> None:
    os.setsid()
    log = (folder / "solve.log").open("w")
    os.dup2(log.fileno(), 2)
    sys.stderr = log
    raise ArithmeticError("no numbers left")
