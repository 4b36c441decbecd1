"""A task being made: its text, what was before, and the file that it is kept in."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from pathlib import Path

from casadi_hands.errors import TaskError
from casadi_hands.export.moving import replace_file
from casadi_hands.studio.understood import understand
from casadi_hands.task.starter import Idea, starter
from casadi_hands.task.textfile import read

_MOST_STEPS = 200  # back


class Session:
    """One task file under edits.

    Args:
        path: the file; where there is none, a new task begins as that of `casadi-hands new`, which the first `save`
            writes.

    Attributes:
        path: of the file.
        text: as it is now.
        understood: what the text says.
        last: what the last text that could be drawn says.

    Raises:
        TaskError: the file cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._saved = read(path) if path.exists() else None
        self.text = starter(Idea(path.stem)) if self._saved is None else self._saved
        self._before: list[str] = []
        self.understood = self.last = understand(self.text, path)

    @property
    def unsaved(self) -> bool:
        """Whether the file does not have the text."""
        return self.text != self._saved

    @property
    def can_undo(self) -> bool:
        """Whether there is a text before this one."""
        return bool(self._before)

    def edit(self, change: Callable[[str], str]) -> None:
        """Change the text.

        Args:
            change: of the text; what it raises is raised, and nothing has changed then.
        """
        self._take(change(self.text))

    def undo(self) -> None:
        """Go back to the text before the last change."""
        if self._before:
            self.text = self._before.pop()
            self._understand()

    def save(self) -> None:
        """Write the file.

        Raises:
            TaskError: it cannot be written, or somebody else has changed it; the next `save` then replaces it.
        """
        there = read(self.path) if self.path.exists() else None
        if there is not None and there not in (self._saved, self.text):
            self._saved = there
            raise TaskError(
                f"{self.path} was changed by another program; try reload to see it, or save again to replace it"
            )
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if self.path.exists() and not os.access(self.path, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
            replace_file(
                Path(os.path.realpath(self.path)),
                lambda path: path.write_text(self.text, encoding="utf-8", newline="\n"),
            )
        except OSError as error:
            raise TaskError(f"{self.path}: cannot be written: {error.strerror}; give a path that can") from None
        self._saved = self.text

    def reload(self) -> None:
        """Take the file's text, as a change that can be undone.

        Raises:
            TaskError: it cannot be read.
        """
        text = read(self.path)
        self._saved = text
        self._take(text)

    def _take(self, text: str) -> None:
        if text != self.text:
            self._before = [*self._before, self.text][-_MOST_STEPS:]
            self.text = text
            self._understand()

    def _understand(self) -> None:
        self.understood = understand(self.text, self.path)
        if self.understood.written is not None:
            self.last = self.understood
