"""From a task file to a task."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path as FilePath
from typing import Any

from pydantic import ValidationError

from casadi_hands.errors import TaskError
from casadi_hands.task.bounds import bound, bound_together
from casadi_hands.task.checks import check
from casadi_hands.task.given import Given, TaskData, plain
from casadi_hands.task.mesh import FOLDER, WITHIN
from casadi_hands.task.messages import explain
from casadi_hands.task.normalise import normalise
from casadi_hands.task.palm_place import stand
from casadi_hands.task.problem import Problem, Question
from casadi_hands.task.quaternion_order import wrong_order
from casadi_hands.task.shown import joined, printable
from casadi_hands.task.task import Task
from casadi_hands.task.textfile import file_name, read
from casadi_hands.task.units import doubtful_units
from casadi_hands.task.yamlfile import TaskFile

_MOST = 50  # mistakes that are looked at; a message has room for fewer


def load_task(path: str | FilePath | Mapping[str, Any], within: bool = False) -> Task:
    """Read a task file, or take a task's fields from a mapping.

    Args:
        path: the YAML file; or its fields, as it would give them, in which lists may be arrays.
        within: whether files that it names have to be in its folder, as for one that others may have written.

    Returns:
        The task with every default filled in, contacts on the object's surface, and the object frame's origin at the
        centre of mass.

    Raises:
        TaskError: the file cannot be read or used; a line for each thing that is wrong.
    """
    if isinstance(path, Mapping):
        return _taken(plain(path), within=within)
    return load_questioned(path, within)[0]


def load_questioned(path: str | FilePath, within: bool = False) -> tuple[Task, list[str]]:
    """Read a task file, like `load_task`, and ask about what it may mean otherwise: a line for each question."""
    path = FilePath(path)
    return parse_questioned(read(path), file_name(path), printable(path.stem), path.parent, within)


def parse_task(
    text: str, source: str = "task", name: str = "task", folder: FilePath | None = None, within: bool = False
) -> Task:
    """Build a task from the text of a task file, like `load_task`.

    Args:
        text: YAML.
        source: what messages call the file.
        name: the task's name if the text gives none.
        folder: where paths in it start; by default the current one.
        within: see `load_task`.

    Raises:
        TaskError: as `load_task`.
    """
    return parse_questioned(text, source, name, folder, within)[0]


def parse_questioned(
    text: str, source: str = "task", name: str = "task", folder: FilePath | None = None, within: bool = False
) -> tuple[Task, list[str]]:
    """Build a task from the text of a task file, like `load_questioned`."""
    return _build(TaskFile(text, source), name, folder, within)


def _taken(data: dict[str, Any], name: str = "task", folder: FilePath | None = None, within: bool = False) -> Task:
    """Build a task from fields."""
    return _build(TaskData(data), name, folder, within)[0]


def _build(file: TaskFile | TaskData, name: str, folder: FilePath | None, within: bool) -> tuple[Task, list[str]]:
    problems = bound(file.data)
    if problems:
        raise _refusal(problems, file)
    context = {FOLDER: folder, WITHIN: within}
    task = _validated({"name": name, **file.data}, file, context)
    if task.palm.auto:
        task = _validated({"name": name, **file.data, "palm": _stood(task, file)}, file, context)
    order = list(wrong_order(file.data))
    problems = bound_together(task) or check(task) + [each for each in order if isinstance(each, Problem)]
    questions = [*doubtful_units(task), *(each for each in order if isinstance(each, Question))]
    if not problems:
        task, problems = normalise(task)
    # What follows from large numbers is larger; a task that is written must be one again.
    problems = problems or bound(task.model_dump(by_alias=True, exclude_none=True))
    if problems:
        raise _refusal(problems, file)
    task.was_given(Given(file.data, partial(_taken, name=name, folder=folder, within=within)))
    return task, _lines(questions, file)


def _validated(data: dict[str, Any], file: TaskFile | TaskData, context: dict[str, Any]) -> Task:
    """The task of some fields, each valid."""
    try:
        return Task.model_validate(data, context=context)
    except ValidationError as error:
        errors = sorted(error.errors(include_url=False), key=lambda each: file.line(each["loc"]))
        raise _refusal(explain(errors[:_MOST]), file, len(errors[_MOST:])) from None


def _stood(task: Task, file: TaskFile | TaskData) -> dict[str, Any]:
    """The palm's fields, with a place that the program finds; ``task`` is all else."""
    problems = bound_together(task) or check(task)
    if not problems:
        task, problems = normalise(task)
    if problems:
        raise _refusal(problems, file)
    given = file.data["palm"] if isinstance(file.data["palm"], dict) else {}
    hand = file.data.get("hand")
    # The usual length of links follows from the palm's place.
    fixed = isinstance(hand, dict) and "link_length" in hand
    reach = task.search.max_joints * task.hand.link_length[1] + task.fingertip.radius
    palm = stand(task, given.get("facing") is not None, reach if fixed else math.inf)
    if isinstance(palm, Problem):
        raise _refusal([palm], file)
    placed = {"position": list(palm.position), "facing": list(palm.facing), "placed": True}
    return {name: value for name, value in given.items() if name != "auto"} | placed


def _refusal(problems: list[Problem], file: TaskFile | TaskData, more: int = 0) -> TaskError:
    return TaskError(joined(_lines(problems, file), more))


def _lines(found: Sequence[Problem | Question], file: TaskFile | TaskData) -> list[str]:
    lines = sorted((file.line(each.path), str(each)) for each in found)
    return [f"{file.source}:{line}: {text}" if line else f"{file.source}: {text}" for line, text in lines]
