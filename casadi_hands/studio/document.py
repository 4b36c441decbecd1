"""The text of a task file under edits: what is changed is changed, comments and all else stay as they are."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import YAMLError

from casadi_hands.errors import TaskError
from casadi_hands.task.nodes import compose
from casadi_hands.task.shown import escaped
from casadi_hands.task.yamlfile import TaskFile

Path = tuple[str | int, ...]
"""Names and, in lists, numbers from 0, from the outermost inwards."""
_FLUSH = re.compile(r"^( *)[^\s#-][^\n]*:[ \t]*\n\1- ", re.MULTILINE)
"""A list that stands right under its name, not further in."""


def value_at(text: str, path: Path) -> Any:
    """What a text has at a path, plain or as ruamel keeps it; None where it has nothing.

    Raises:
        TaskError: the text is not YAML.
    """
    found: Any = _loaded(text)
    for step in path:
        if not _has(found, step):
            return None
        found = found[step]
    return found


def shown_at(text: str, path: Path) -> str:
    """What a text has at a path as YAML on one line; empty where it has nothing.

    Raises:
        TaskError: the text is not YAML.
    """
    found = value_at(text, path)
    return "" if found is None else one_line(found)


def one_line(value: Any) -> str:
    """A value as YAML on one line."""
    stream = io.StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style, yaml.width, yaml.allow_unicode = True, 1 << 20, True
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.dump(_plain(value), stream)
    return stream.getvalue().removesuffix("\n").removesuffix("\n...")


def typed(words: str) -> Any:
    """The value that a person typed as YAML, plain; None of nothing.

    Raises:
        TaskError: it is not the YAML of one value.
    """
    data = TaskFile(f"value: {words}", "given").data
    if list(data) != ["value"]:
        raise TaskError(f"given {escaped(words)}; allowed: one value")
    return data["value"]


def with_field(text: str, path: Path, words: str) -> str:
    """The text with what a person typed into a field; without it where that is nothing.

    Raises:
        TaskError: it is not YAML.
    """
    value = typed(words)
    return without(text, path) if value is None else with_value(text, path, value)


def with_value(text: str, path: Path, value: Any) -> str:
    """The text with a value at a path, and with the sections around it where they were missing.

    Args:
        text: YAML.
        path: of the value; a number just beyond a list's end appends to it.
        value: plain data, or as `typed` gives it.

    Raises:
        TaskError: the text is not YAML, or has no place there.
    """
    root = _loaded(text)
    if root is None:
        root = CommentedMap()
    place: Any = root
    for step, following in pairwise(path):
        if not _has(place, step) or place[step] is None:
            _put(place, step, CommentedSeq() if isinstance(following, int) else CommentedMap(), path)
        place = place[step]
    _put(place, path[-1], _flow(value), path)
    return _dumped(root, text)


def without(text: str, path: Path) -> str:
    """The text without what is at a path, and without a section that this leaves empty.

    Raises:
        TaskError: the text is not YAML.
    """
    root = _loaded(text)
    places: list[Any] = [root]
    for step in path[:-1]:
        if not _has(places[-1], step):
            return text
        places.append(places[-1][step])
    if not _has(places[-1], path[-1]):
        return text
    del places[-1][path[-1]]
    for depth in range(len(places) - 1, 0, -1):
        if len(places[depth]) or isinstance(path[depth - 1], int):
            break
        del places[depth - 1][path[depth - 1]]
    return _dumped(root, text)


def _loaded(text: str) -> Any:
    compose(text, "task")  # bounds what is built
    try:
        return _yaml(text).load(text)
    except (YAMLError, ValueError) as error:
        raise TaskError(f"task: not YAML; mend {str(error).splitlines()[0]}") from None


def _dumped(root: Any, before: str) -> str:
    stream = io.StringIO()
    _yaml(before).dump(root, stream)
    return stream.getvalue()


def _yaml(text: str) -> YAML:
    yaml = YAML(typ="rt")
    yaml.preserve_quotes = True
    yaml.width = 1 << 20
    if _FLUSH.search(text):
        yaml.indent(mapping=2, sequence=2, offset=0)
    else:
        yaml.indent(mapping=2, sequence=4, offset=2)
    return yaml


def _has(place: Any, step: str | int) -> bool:
    if isinstance(place, Mapping):
        return step in place
    return isinstance(place, list) and isinstance(step, int) and step < len(place)


def _put(place: Any, step: str | int, value: Any, path: Path) -> None:
    if isinstance(place, list) and isinstance(step, int) and step <= len(place):
        if step == len(place):
            place.append(value)
        else:
            place[step] = value
    elif isinstance(place, Mapping) and isinstance(step, str):
        place[step] = value  # type: ignore[index]
    else:
        raise TaskError(
            f"the task has no place for {'.'.join(map(str, path))}: {step} would not be in a section; give one there"
        )


def _flow(value: Any) -> Any:
    """A copy for the writer, on one line."""
    styled: CommentedMap | CommentedSeq
    if isinstance(value, Mapping):
        styled = CommentedMap((name, _flow(item)) for name, item in value.items())
    elif isinstance(value, Sequence) and not isinstance(value, str):
        styled = CommentedSeq(_flow(item) for item in value)
    else:
        return value
    styled.fa.set_flow_style()
    return styled


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(name): _plain(item) for name, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in value]
    if isinstance(value, bool):
        return value
    for kind in (int, float, str):
        if isinstance(value, kind):
            return kind(value)
    return value
