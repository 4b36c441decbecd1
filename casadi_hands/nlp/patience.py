"""Programs that are waited for, but not for ever, and not once nobody needs what they make."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
from collections.abc import Sequence
from pathlib import Path

_running: set[int] = set()


def run(arguments: Sequence[str], folder: Path | None, seconds: float) -> str:
    """Run a program and return what it prints.

    Args:
        arguments: the program and its arguments.
        folder: where it runs; None for here.
        seconds: after which it is ended, with all that it has started.

    Raises:
        OSError: it cannot be started.
        subprocess.CalledProcessError: it failed.
        subprocess.TimeoutExpired: it did not return in time.
    """
    with subprocess.Popen(
        arguments,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        start_new_session=True,
    ) as process:
        _running.add(process.pid)
        try:
            out, words = process.communicate(timeout=seconds)
        finally:
            # A compiler's driver leaves the compiler itself running when it is ended.
            _end(process.pid, process.poll() is None)
            _running.discard(process.pid)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, list(arguments), out, words)
    return out


def end_all() -> None:
    """End every program that is still waited for."""
    for group in list(_running):
        _end(group, True)


def _end(group: int, running: bool) -> None:
    if running:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(group, signal.SIGKILL)
