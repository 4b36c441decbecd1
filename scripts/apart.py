"""A solve in a process of its own, so that a crash or a time limit ends that solve and nothing else."""

from __future__ import annotations

import json
import multiprocessing
import os
import shutil
import signal
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from casadi_hands.errors import DesignError
from casadi_hands.export.design import Design
from casadi_hands.export.place import beside, owned
from casadi_hands.lifetime import follow_parent
from casadi_hands.task import Task, task_to_yaml

if TYPE_CHECKING:
    from casadi_hands.pipeline import Stage

ENDED = "ended.json"
"""Written into a folder whose solve did not end by itself: ``{"how": sentence, "minutes": limit or null}``."""
STOPPED = "stopped after"
"""What the sentence on a solve that took too long begins with."""
LOG = "solve.log"


def solve_apart(task: Task, folder: Path, until: Stage, jobs: int | None, limit: float | None) -> Design:
    """Solve a task and write its result folder, whatever becomes of the solve.

    The work is done beside ``folder`` and moved there at the end, so that a folder with this name is never half of one.

    Args:
        task: with the seed to use.
        folder: the result's; what it held before is removed.
        until: the last stage.
        jobs: processes of the solve; all cores if None.
        limit: minutes after which the solve is ended and what it has written is kept; None for no limit.

    Returns:
        The design as `read_apart` has it.
    """
    part = folder.with_name(folder.name + ".part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    (part / "task.yaml").write_text(task_to_yaml(task), encoding="utf-8")
    # A spawned process shares no state with this one, and none with the solve before it.
    process = multiprocessing.get_context("spawn").Process(target=_work, args=(task, part, until, jobs))
    process.start()
    try:
        process.join(None if limit is None else 60 * limit)
        how = _how(process.exitcode, part / LOG, limit)
    finally:
        _end_group(process)
        _clear(part)
    # Saving replaces a folder's own files; these are not among them, and would be old.
    if how:
        ended = {"how": how, "minutes": limit}
        (part / ENDED).write_text(json.dumps(ended), encoding="utf-8")
    shutil.rmtree(folder, ignore_errors=True)
    part.rename(folder)
    return read_apart(folder, task)


def read_apart(folder: Path, task: Task) -> Design:
    """What a solve left: its design; if it did not end by itself, with the reason for that first.

    Args:
        folder: that `solve_apart` wrote.
        task: for a design that says only why there is none.
    """
    how = str(ended(folder).get("how", ""))
    try:
        design = Design.load(folder)
    except DesignError as error:
        return Design(task=task, status="failed", reason=how or str(error))
    return replace(design, reason="; ".join(filter(None, [how, design.reason]))) if how else design


def ended(folder: Path) -> dict[str, Any]:
    """How a solve was ended and its limit in minutes; empty if it ended by itself."""
    file = folder / ENDED
    known: dict[str, Any] = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    return known


def _work(task: Task, folder: Path, until: Stage, jobs: int | None) -> None:
    """The solve, in its own process and session: its workers can be ended with it, and it ends with its parent."""
    os.setsid()
    follow_parent()
    log = (folder / LOG).open("w", buffering=1, encoding="utf-8")
    # What crashes below Python writes to the file descriptors.
    for stream in (1, 2):
        os.dup2(log.fileno(), stream)
    sys.stdout = sys.stderr = log
    # Here, so that the parent, which does not solve, need not load the solver.
    from casadi_hands.pipeline import solve

    solve(
        task,
        until=until,
        jobs=jobs,
        out=folder,
        progress=lambda news: print(f"{news.elapsed:7.1f} {news.stage:10} {news.text}"),
    )


def _how(code: int | None, log: Path, limit: float | None) -> str:
    """A sentence on a process that has not ended, or not well; else empty."""
    if code is None:
        return f"{STOPPED} {limit:g} min"
    if code == 0:
        return ""
    if code < 0:
        return f"the solver crashed ({signal.Signals(-code).name})"
    lines = log.read_text(encoding="utf-8", errors="replace").split("\n") if log.is_file() else []
    return f"the solver crashed: {next((line for line in reversed(lines) if line.strip()), f'exit status {code}')}"


def _clear(folder: Path) -> None:
    """Bring back into a folder what an ended solve had beside it, and remove that: solves are not gone on with here."""
    with suppress(DesignError), owned(folder):
        pass
    shutil.rmtree(beside(folder), ignore_errors=True)


def _end_group(process: Any) -> None:
    """End a process and the workers it has started."""
    # Its session is named by its process number; a process that ended before it made one has none.
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    process.join()
