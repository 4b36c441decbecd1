"""What a task's sections must be to each other."""

from __future__ import annotations

from casadi_hands.task.problem import Problem
from casadi_hands.task.task import Task


def check(task: Task) -> list[Problem]:
    """Find what contradicts itself in a task whose fields are each valid."""
    return []
