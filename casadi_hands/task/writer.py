"""From a task to a task file."""

from __future__ import annotations

import io
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from casadi_hands.task.task import Task

_LONGEST_LINE = 100
_last = ("", "")  # the fields written last, and their text: a solve writes the same task many times


def task_to_yaml(task: Task) -> str:
    """Write a task as a task file with every default filled in; loading it gives an equal task."""
    global _last
    fields = task.model_dump(by_alias=True, exclude_none=True)
    if repr(fields) != _last[0]:
        _last = repr(fields), _text(fields)
    return _last[1]


def _text(fields: dict[str, Any]) -> str:
    yaml = YAML(typ="rt")
    # Broken flow collections read badly, and none is longer than this once the long ones are blocks.
    yaml.width = 10 * _LONGEST_LINE
    stream = io.StringIO()
    yaml.dump(_styled(fields), stream)
    return stream.getvalue()


def _styled(value: Any) -> Any:
    """Copy for the writer: what is short goes on one line."""
    if not isinstance(value, dict | list | tuple):
        return value
    styled: CommentedMap | CommentedSeq
    if isinstance(value, dict):
        styled = CommentedMap((name, _styled(item)) for name, item in value.items())
    else:
        styled = CommentedSeq(_styled(item) for item in value)
    if len(str(value)) <= _LONGEST_LINE:
        styled.fa.set_flow_style()
    return styled
