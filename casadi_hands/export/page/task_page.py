"""A page of a task that nothing was solved for: palm, object, contacts by name, goals as ghosts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from casadi_hands.errors import DesignError
from casadi_hands.export.page.page import write_page
from casadi_hands.problem.result import Result
from casadi_hands.task import Task


def write_task_page(task: Task, path: Path, words: str, sets: Sequence[Mapping[str, Sequence[float]]] = ()) -> None:
    """Write the page of a task, which opens without a server and without a network.

    Args:
        task: as loaded.
        path: the file to write.
        words: what stands below the task's name.
        sets: of contacts that were found, m, object frame, by finger, of which the task has the first.

    Raises:
        DesignError: the file cannot be written.
    """
    placement = {"sets": [{"points": dict(each)} for each in sets]} if sets else {}
    try:
        write_page(Result(task=task, status=words, placement=placement), path)
    except OSError as error:
        raise DesignError(f"{path}: cannot be written: {error.strerror}") from None
