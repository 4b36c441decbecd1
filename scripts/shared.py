"""What the measuring scripts have in common: solves that are kept and not repeated, and Markdown tables."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from casadi_hands import Design, load_task, solve
from casadi_hands.task import Task, task_to_yaml

SEEDS = (0, 1, 2, 3, 4)


def kept_solve(task_file: Path, seed: int, until: str, root: Path, jobs: int | None) -> tuple[Design, Path]:
    """Solve a task, or read the result if ``root`` already has one of the same task and seed.

    A result says nothing of the program that made it: after a change of the program, delete the folder.

    Args:
        task_file: a task file; its stem names the result's folder.
        seed: of the search, in place of the task's.
        until: the last stage.
        root: folder of result folders.
        jobs: processes; all cores if None.

    Returns:
        The design and its folder.

    Raises:
        TaskError: the task file cannot be used.
        DesignError: the folder cannot be written.
    """
    task = _with_seed(load_task(task_file), seed)
    folder = root / f"{task_file.stem}-{seed}-{until}"
    if (folder / "result.json").is_file() and (folder / "task.yaml").read_text(encoding="utf-8") == task_to_yaml(task):
        return Design.load(folder), folder
    print(f"solving {task.name}, seed {seed}", file=sys.stderr, flush=True)
    design = solve(task, until=until, jobs=jobs)
    # Only whole results are written, so that one that was interrupted is solved again; and nothing of an old one stays.
    shutil.rmtree(folder, ignore_errors=True)
    design.save(folder)
    return design, folder


def _with_seed(task: Task, seed: int) -> Task:
    return task.model_copy(update={"search": task.search.model_copy(update={"seed": seed})})


def joints_of(design: Design) -> str:
    """Joints of each finger, as in ``2+2+2``."""
    return "+".join(str(len(finger.links)) for finger in design.hand.fingers) if design.hand else "–"


def write_table(head: Sequence[str], rows: Sequence[Sequence[str]], file: Path | None = None) -> None:
    """Print a Markdown table and, where a file is given, write it there."""
    lines = [head, ["---"] * len(head), *rows]
    text = "".join(f"| {' | '.join(line)} |\n" for line in lines)
    print(text, flush=True)
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
