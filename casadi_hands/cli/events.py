"""What a solve does, a line of JSON an event, for programs that start this one."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from casadi_hands.cli.history import Clock
    from casadi_hands.export.design import Design
    from casadi_hands.pipeline import Progress


class Events:
    """Writes what `progress.Reporter` tells; docs/how-to/progress.md names the events and their fields."""

    def __init__(self, questions: Sequence[str] = (), clock: Clock | None = None, stream: TextIO | None = None) -> None:
        """Write to ``stream``, the standard output by default, first the questions about the task's file."""
        self._questions, self._clock, self._stream = questions, clock, stream or sys.stdout

    def __enter__(self) -> Events:
        """Ask."""
        for question in self._questions:
            self.write("question", text=question)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Nothing is to be given back."""

    def stop(self) -> None:
        """Nothing is to be ended."""

    def note(self, text: str) -> None:
        """Say something of the program's own."""
        self.write("note", text=text)

    def progress(self, news: Progress) -> None:
        """Take the news of the solve."""
        left = None
        if self._clock is not None:
            self._clock.hear(news.stage, news.elapsed)
            left = self._clock.left()
        told = None if left is None else [round(each, 1) for each in left]
        self.write("progress", stage=news.stage, text=news.text, seconds=round(news.elapsed, 3), left=told)

    def result(self, design: Design, folder: Path, status: int) -> None:
        """The last event: the verdict, and where all else is."""
        seconds = round(design.seconds.get("total", 0.0), 3)
        missed = sorted(design.missed)
        told = {"status": design.status, "reason": design.reason, "missed": missed, "seconds": seconds}
        self.write("result", **told, folder=str(folder), exit=status)

    def write(self, event: str, **fields: Any) -> None:
        """One event, on its way at once."""
        line = json.dumps({"event": event, **fields}, ensure_ascii=False, allow_nan=False)
        self._stream.write(f"{line}\n")
        self._stream.flush()
