"""From a task to a task file."""

from __future__ import annotations

import io
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from casadi_hands.task.task import Task


def task_to_yaml(task: Task) -> str:
    """Write a task as a task file with every default filled in; loading it gives an equal task."""
    yaml = YAML(typ="rt")
    yaml.width = 120
    stream = io.StringIO()
    yaml.dump(_styled(task.model_dump(by_alias=True, exclude_none=True)), stream)
    return stream.getvalue()


def _styled(value: Any) -> Any:
    """Copy for the writer: whatever holds only scalars, or lists of them, goes on one line."""
    if isinstance(value, dict):
        mapping = CommentedMap((name, _styled(item)) for name, item in value.items())
        if len(value) <= 4 and not any(isinstance(item, dict) for item in value.values()):
            mapping.fa.set_flow_style()
        return mapping
    if isinstance(value, list | tuple):
        sequence = CommentedSeq(_styled(item) for item in value)
        if not any(isinstance(item, dict) for item in value):
            sequence.fa.set_flow_style()
        return sequence
    return value
