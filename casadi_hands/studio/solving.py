"""A solve in a process of its own: the command `casadi-hands solve`, what it says, and the folder that it writes."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

_PATIENCE = 10.0  # s, after which a process that was asked to stop is ended


class Solve:
    """One solve.

    Args:
        command: to run; what it prints on its error stream is told as it comes.
        told: called with each line, from another thread.
        ended: called with the exit status and the rest that was printed, from another thread.
    """

    def __init__(self, command: Sequence[str], told: Callable[[str], None], ended: Callable[[int, str], None]) -> None:
        # A session of its own: Ctrl-C in the terminal is for the studio, which stops the solve.
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            errors="replace",
            env={**os.environ, "COLUMNS": "200"},
            start_new_session=True,
        )
        self._told, self._ended = told, ended
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    @property
    def running(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    def stop(self) -> None:
        """End it as Ctrl-C does, with what was computed in its folder; wait until it has ended."""
        if self.running:
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(_PATIENCE)
            except subprocess.TimeoutExpired:
                os.killpg(self._process.pid, signal.SIGKILL)  # with the processes that it started
        self._thread.join(_PATIENCE)

    def _listen(self) -> None:
        assert self._process.stderr is not None
        assert self._process.stdout is not None
        for line in self._process.stderr:
            if line.strip():
                self._told(line.rstrip())
        rest = self._process.stdout.read()
        self._ended(self._process.wait(), rest)


class Watched:
    """A result folder that is written from time to time.

    Args:
        folder: need not exist.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._seen: tuple[int, int] | None = self._stamp()

    def changed(self) -> bool:
        """Whether a complete result was written since this was asked last."""
        stamp = self._stamp()
        new = stamp is not None and stamp != self._seen
        self._seen = stamp
        return new

    def _stamp(self) -> tuple[int, int] | None:
        """Of what is written last, so that a folder that has it is complete."""
        try:
            found = (self.folder / "result.json").stat()
        except OSError:
            return None
        return found.st_mtime_ns, found.st_ino
