"""Ctrl-C during a solve."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

STOPPED = 130
"""Exit status of a program that SIGINT ended, as shells have it."""


@contextmanager
def leave_on_interrupt(last_words: Callable[[], None]) -> Iterator[None]:
    """End the program, and the processes it started, as soon as the user asks for it.

    A KeyboardInterrupt would be late: on its way out it waits for what other processes are at. It is left to programs
    that use the package (`Solver.solve` raises what CasADi swallows while IPOPT runs).

    Args:
        last_words: called before the end.
    """

    def leave(_signal: int, _frame: FrameType | None) -> None:
        # A second Ctrl-C shall not interrupt the leaving.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        for child in multiprocessing.active_children():
            child.terminate()
        last_words()
        # An exception would not leave IPOPT as itself, and would wait like the other one.
        os._exit(STOPPED)

    # Leaving at once leaves semaphores to Python's resource tracker, which clears them away, but complains.
    os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker:UserWarning")
    before = signal.signal(signal.SIGINT, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
