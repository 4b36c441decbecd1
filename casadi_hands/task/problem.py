"""One thing that is wrong with a task file, or may be."""

from __future__ import annotations

from dataclasses import dataclass

from casadi_hands.task.shown import escaped


@dataclass(frozen=True)
class Problem:
    """What a field was given, and what it allows.

    Attributes:
        path: names of fields and numbers in lists, from the top of the file.
        given: the value, as the message shows it.
        allowed: what the field accepts.
    """

    path: tuple[str | int, ...]
    given: str
    allowed: str

    def __str__(self) -> str:
        """The message without file and line."""
        return f"{_name(self.path)}: given {self.given}; allowed: {self.allowed}"


@dataclass(frozen=True)
class Question:
    """What a file may mean otherwise than it is read; it is taken as it stands.

    Attributes:
        path: names of fields and numbers in lists, from the top of the file.
        text: what it is taken for, and what is asked.
    """

    path: tuple[str | int, ...]
    text: str

    def __str__(self) -> str:
        """The message without file and line."""
        return f"{_name(self.path)}: {self.text}"


def _name(path: tuple[str | int, ...]) -> str:
    name = ""
    for step in (each if isinstance(each, int) else escaped(each) for each in path):
        name += f"[{step}]" if isinstance(step, int) else f".{step}" if name else step
    return name or "task"
