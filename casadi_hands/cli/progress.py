"""What a solve is doing right now: a line that moves on a terminal, lines at a modest rate elsewhere."""

from __future__ import annotations

import time
from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING

from rich.console import Console
from rich.live import Live
from rich.spinner import Spinner
from rich.text import Text

from casadi_hands.cli.history import Clock, words

if TYPE_CHECKING:
    from casadi_hands.pipeline import Progress

_EVERY = 5.0
"""Seconds between lines where there is no terminal; a new stage is always told."""


class Reporter:
    """Tells the user how a solve comes along; a context manager, because the terminal must be given back."""

    def __init__(self, console: Console, questions: Sequence[str] = (), clock: Clock | None = None) -> None:
        """Write to ``console``, first the questions about the task's file; with a clock also the time that is left."""
        self._console, self._questions, self._clock = console, questions, clock
        self._start = time.monotonic()
        self._stage, self._text, self._told = "", "loading", -_EVERY
        self._live = Live(self, console=console, transient=True, refresh_per_second=8)
        self._spinner = Spinner("dots")

    def __enter__(self) -> Reporter:
        """Ask, then start the moving line, if there is a terminal to move it on."""
        for question in self._questions:
            self.note(f"is this meant? {question}")
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the terminal back."""
        self.stop()

    def stop(self) -> None:
        """End the moving line."""
        self._live.stop()

    def __rich__(self) -> Spinner:
        """The moving line as it is now."""
        self._spinner.update(text=self._line(self._elapsed, self._stage, self._text, self._left))
        return self._spinner

    def note(self, text: str) -> None:
        """Say something of the program's own, which stays on the screen."""
        self._console.print(self._line(self._elapsed, "", text), soft_wrap=True)  # paths are to be copied

    def progress(self, news: Progress) -> None:
        """Take the news of the solve."""
        if self._clock is not None:
            self._clock.hear(news.stage, news.elapsed)
        if news.stage != self._stage and self._stage and self._live.is_started:
            # What the stage ended with would be overwritten by the next stage's news.
            self._console.print(self._line(news.elapsed, self._stage, self._text))
        due = news.stage != self._stage or news.elapsed - self._told >= _EVERY
        self._stage, self._text = news.stage, news.text
        if due and not self._live.is_started:
            self._console.print(self._line(news.elapsed, news.stage, news.text, self._left), soft_wrap=True)
            self._told = news.elapsed

    @property
    def _elapsed(self) -> float:
        return time.monotonic() - self._start

    @property
    def _left(self) -> str:
        """The time left in words, empty where it is not known."""
        return "" if self._clock is None else words(self._clock.left())

    @staticmethod
    def _line(elapsed: float, stage: str, text: str, left: str = "") -> Text:
        minutes, seconds = divmod(int(elapsed), 60)
        line = Text(f"{minutes:3d}:{seconds:02d}  ")
        if stage:
            line.append(f"{stage.replace('_', ' '):<11} ", style="bold")
        line.append(text)
        return line.append(f"  ({left})", style="dim") if left else line
