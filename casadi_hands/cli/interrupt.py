"""Ctrl-C during a solve, and other signals that ask a program to end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from casadi_hands.lifetime import end_children, remove_scratch

STOPPED = 130
"""Exit status of a program that SIGINT ended, as shells have it."""

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_GUARD = """
import os, select, signal, sys, time
if os.read(0, 1):
    last = time.monotonic() + 1.5
    while (left := last - time.monotonic()) > 0:
        if select.select([0], [], [], left)[0] and not os.read(0, 99):
            sys.exit()
    os.kill(int(sys.argv[1]), signal.SIGKILL)
"""


@contextmanager
def leave_on_interrupt(last_words: Callable[[], None]) -> Iterator[None]:
    """End the program, the processes it started and its temporary folders as soon as somebody asks for it.

    A KeyboardInterrupt would be late: on its way out it waits for what other processes are at. It is left to programs
    that use the package (`Solver.solve` raises what CasADi swallows while IPOPT runs).

    Args:
        last_words: called before the end.
    """

    def leave(number: int, _frame: FrameType | None) -> None:
        # A second Ctrl-C shall not interrupt the leaving.
        for each in _SIGNALS:
            signal.signal(each, signal.SIG_IGN)
        try:
            end_children()
            remove_scratch()
            last_words()
        finally:
            # An exception would not leave IPOPT as itself, and would wait like the other one.
            os._exit(128 + number)

    # Leaving at once leaves semaphores to Python's resource tracker, which clears them away, but complains.
    os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker:UserWarning")
    before = {each: signal.getsignal(each) for each in _SIGNALS}
    with _guarded():
        for each in _SIGNALS:
            # What a shell runs in the background, or under nohup, ignores some of them.
            if each == signal.SIGINT or before[each] is not signal.SIG_IGN:
                signal.signal(each, leave)
        try:
            yield
        finally:
            for each, handler in before.items():
                signal.signal(each, handler)


@contextmanager
def _guarded() -> Iterator[None]:
    """Have another process end this one where it does not heed a signal in 1.5 s.

    Python runs its handlers between two of its own instructions: never while CasADi builds a large function. What comes
    at once is a byte in a pipe. The pipe's end says that this process has ended.
    """
    pipe, signals = os.pipe()
    os.set_blocking(signals, False)
    command = [sys.executable, "-I", "-S", "-c", _GUARD, str(os.getpid())]
    # In a session of its own, for a terminal interrupts all processes of one.
    with subprocess.Popen(command, stdin=pipe, start_new_session=True):
        os.close(pipe)
        before = signal.set_wakeup_fd(signals, warn_on_full_buffer=False)
        try:
            yield
        finally:
            signal.set_wakeup_fd(before)
            os.close(signals)
