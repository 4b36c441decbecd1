"""From a task file to a task."""

from __future__ import annotations

from pathlib import Path as FilePath

from pydantic import ValidationError

from casadi_hands.errors import TaskError
from casadi_hands.task import yamlfile
from casadi_hands.task.checks import check
from casadi_hands.task.mesh import FOLDER, WITHIN
from casadi_hands.task.messages import explain
from casadi_hands.task.normalise import normalise
from casadi_hands.task.problem import Problem
from casadi_hands.task.task import Task


def load_task(path: str | FilePath, within: bool = False) -> Task:
    """Read a task file.

    Args:
        path: the YAML file.
        within: whether files that it names have to be in its folder, as for one that others may have written.

    Returns:
        The task with every default filled in, contacts on the object's surface, and the object frame's origin at the
        centre of mass.

    Raises:
        TaskError: the file cannot be read or used; a line for each thing that is wrong.
    """
    path = FilePath(path)
    return parse_task(yamlfile.read(path), str(path), path.stem, path.parent, within)


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
    file = yamlfile.TaskFile(text, source)
    try:
        task = Task.model_validate({"name": name, **file.data}, context={FOLDER: folder, WITHIN: within})
    except ValidationError as error:
        raise _refusal(explain(error.errors(include_url=False)), file) from None
    problems = check(task)
    if not problems:
        task, problems = normalise(task)
    if problems:
        raise _refusal(problems, file)
    return task


def _refusal(problems: list[Problem], file: yamlfile.TaskFile) -> TaskError:
    lines = sorted((file.line(problem.path), str(problem)) for problem in problems)
    return TaskError("\n".join(f"{file.source}:{line}: {text}" for line, text in lines))
