"""What the scripts have in common: solves that are kept and not repeated, replays, figures, Markdown tables."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentDefaultsHelpFormatter, ArgumentParser
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from apart import ended, read_apart, solve_apart

from casadi_hands.errors import TaskError
from casadi_hands.export.design import Design
from casadi_hands.pipeline.placing import placed_like, stood_like
from casadi_hands.task import Task, load_task, parse_task, task_to_yaml
from casadi_hands.verify import replay, replay_many

if TYPE_CHECKING:
    from casadi_hands.pipeline import Stage

SEEDS = (0, 1, 2, 3, 4)
NOTHING = "–"


def kept_solve(
    task_file: Path, seed: int, until: Stage, root: Path, jobs: int | None, limit: float | None = None
) -> tuple[Design, Path]:
    """Solve a task, or read the result if ``root`` already has one of the same task and seed.

    A result says nothing of the program that made it: after a change of the program, delete the folder. A solve that
    was stopped at its limit is repeated if it may now take longer, one that crashed in any case.

    Args:
        task_file: a task file; its stem names the result's folder.
        seed: of the search, in place of the task's.
        until: the last stage.
        root: folder of result folders.
        jobs: processes; all cores if None.
        limit: minutes that the solve may take; None for any.

    Returns:
        The design and its folder; a solve that crashed or was stopped gives what there is, and says so as the reason.

    Raises:
        TaskError: the task file cannot be used.
    """
    task = with_seed(load_task(task_file), seed)
    folder = result_folder(task_file, seed, until, root)
    if is_kept(task, folder, limit):
        return read_apart(folder, task), folder
    print(f"solving {task.name}, seed {seed}", file=sys.stderr, flush=True)
    return solve_apart(task, folder, until, jobs, limit), folder


def result_folder(task_file: Path, seed: int, until: Stage, root: Path) -> Path:
    """Where `kept_solve` keeps a result."""
    return root / f"{task_file.stem}-{seed}-{until}"


def is_kept(task: Task, folder: Path, limit: float | None) -> bool:
    """Whether a folder holds this task's result, so that solving it again would give no more."""
    if not is_of(task, folder):
        return False
    end = ended(folder)
    if not end:
        return (folder / "result.json").is_file()
    stopped_at = end["minutes"] if end["how"].startswith("stopped") else None
    return limit is not None and stopped_at is not None and limit <= stopped_at


def is_of(task: Task, folder: Path) -> bool:
    """Whether a folder is of this very task, seed included, with what the program placed of it."""
    file = folder / "task.yaml"
    if not file.is_file():
        return False
    text = file.read_text(encoding="utf-8")
    if text == task_to_yaml(task):
        return True
    try:
        earlier = parse_task(text)
    except TaskError:
        return False
    return text == task_to_yaml(placed_like(stood_like(task, earlier), earlier))


def with_seed(task: Task, seed: int) -> Task:
    """The task with another seed of the search."""
    return task.model_copy(update={"search": task.search.model_copy(update={"seed": seed})})


def replays_of(folder: Path, count: int, jobs: int) -> dict[str, Any]:
    """The nominal replay and at least ``count`` perturbed ones, read from ``replays.json`` if they are there.

    Returns:
        ``{"nominal": replay, "perturbed": [replay, …]}`` with a replay's fields; empty where there is no scene to play.
    """
    file = folder / "replays.json"
    if file.is_file():
        known: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        if len(known["perturbed"]) >= count:
            return known
    if not (folder / "scene.xml").is_file():
        return {}
    played = {
        "nominal": asdict(replay(folder)),
        "perturbed": [asdict(each) for each in replay_many(folder, count, jobs=jobs)],
    }
    file.write_text(json.dumps(played, indent=1), encoding="utf-8")
    return played


def options_of(doc: str) -> ArgumentParser:
    """A parser for a script: its help is the first line of the script's docstring, with every option's default."""
    return ArgumentParser(description=doc.partition("\n")[0], formatter_class=ArgumentDefaultsHelpFormatter)


def joints_of(design: Design) -> str:
    """Joints of each finger, as in ``2+2+2``."""
    return "+".join(str(len(finger.links)) for finger in design.hand.fingers) if design.hand else NOTHING


def write_table(head: Sequence[str], rows: Sequence[Sequence[str]], file: Path | None = None) -> None:
    """Print a Markdown table and, where a file is given, write it there."""
    text = table_text(head, rows)
    print(text, flush=True)
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")


def table_text(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table; a bar within a cell does not end it."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |\n" for line in lines)
