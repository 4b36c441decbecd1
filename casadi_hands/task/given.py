"""What a task was made of: its fields as they were given, without the defaults that follow from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from os import PathLike, fspath
from typing import Any

import numpy as np

from casadi_hands.errors import TaskError
from casadi_hands.task.nodes import MOST_LEVELS, too_deep
from casadi_hands.task.problem import Problem
from casadi_hands.task.shown import shown, unprintable

INDEPENDENT = frozenset(("search", "weights", "limits", "name", "about"))
"""Fields from which no others follow, and which no change of frames touches."""


@dataclass(frozen=True, eq=False)
class Given:
    """How a task came about; two tasks are equal whatever was given for them.

    Attributes:
        data: the fields as given; None where they are not known any more.
        make: a task of such fields.
    """

    data: dict[str, Any] | None = None
    make: Callable[[dict[str, Any]], Any] | None = None

    def __eq__(self, other: object) -> bool:
        """Not what tasks differ in."""
        return isinstance(other, Given)

    __hash__ = None  # type: ignore[assignment]

    def updated(self, fields: dict[str, Any]) -> Given:
        """What is given of a copy in which some fields are others."""
        known = self.data is not None and fields.keys() <= INDEPENDENT
        return Given({**(self.data or {}), **fields} if known else None, self.make)


@dataclass(frozen=True)
class TaskData:
    """Fields that did not come from a file; as `yamlfile.TaskFile`, without lines."""

    data: dict[str, Any]
    source: str = "task"

    def line(self, path: tuple[str | int, ...]) -> int:
        """None."""
        return 0


def plain(value: Any, path: tuple[str | int, ...] = ()) -> Any:
    """Fields as a file would give them: arrays become lists, and numbers of NumPy's numbers.

    Raises:
        TaskError: something that no file can give.
    """
    if len(path) > MOST_LEVELS:
        raise TaskError(f"task: {too_deep()}")
    if isinstance(value, Mapping):
        return {str(name): plain(each, (*path, str(name))) for name, each in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [plain(each, (*path, number)) for number, each in enumerate(value)]
    if isinstance(value, PathLike):
        value = fspath(value)
    if value is None or (isinstance(value, str | bool | int | float) and not unprintable(str(value))):
        return value
    allowed = "mappings, lists, arrays, numbers, true, false and text without control characters"
    raise TaskError(f"task: {Problem(path, shown(value), allowed)}")


def merged(given: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Fields with changes: mappings are merged, None takes a field away, and all else takes its place."""
    result = dict(given)
    for name, value in changes.items():
        if value is None:
            result.pop(name, None)
        elif isinstance(value, Mapping) and isinstance(result.get(name), Mapping):
            result[name] = merged(result[name], value)
        else:
            result[name] = value
    return result
