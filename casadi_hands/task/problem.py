"""One thing that is wrong with a task file."""

from __future__ import annotations

from dataclasses import dataclass


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
        name = ""
        for step in self.path:
            name += f"[{step}]" if isinstance(step, int) else f".{step}" if name else step
        return f"{name or 'task'}: given {self.given}; allowed: {self.allowed}"
