"""Processes that end with the one that started them, and leave nothing behind."""

from __future__ import annotations

import fcntl
import gc
import multiprocessing
import os
import signal
import tempfile
import threading
import time
from contextlib import suppress
from multiprocessing.connection import wait
from types import FrameType

PATIENCE = 1.0
"""s that other processes may take to end when they are asked to; then they are killed."""

leaving = threading.Event()
"""Set once this process is about to end: no more are started."""


def follow_parent() -> None:
    """Let this process, started by ``multiprocessing``, end when its parent does, however that ends.

    The kernel signals the end of the pipe from the parent (``SIGIO``, which ends a process by default): a thread that
    waits for it would not run while a solver holds the interpreter. An interrupt is the parent's to handle.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _leave)
    parent = multiprocessing.parent_process()
    if parent is None:
        return
    pipe = parent.sentinel
    signal.signal(signal.SIGIO, signal.SIG_DFL)
    fcntl.fcntl(pipe, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(pipe, fcntl.F_SETFL, fcntl.fcntl(pipe, fcntl.F_GETFL) | os.O_ASYNC)
    if wait([pipe], timeout=0):  # it has ended before anybody asked to be told
        os._exit(1)


def end_children() -> None:
    """End the processes that this one has started, those that don't heed by force."""
    leaving.set()
    children = multiprocessing.active_children()
    for child in children:
        child.terminate()
    last = time.monotonic() + PATIENCE
    for child in children:
        child.join(max(0.0, last - time.monotonic()))
        if child.is_alive():
            child.kill()


def remove_scratch() -> None:
    """Remove this process's temporary folders; one that leaves at once has nothing else that would."""
    for each in gc.get_objects():
        if isinstance(each, tempfile.TemporaryDirectory):
            with suppress(OSError):
                each.cleanup()


def _leave(number: int, _frame: FrameType | None) -> None:
    remove_scratch()
    os._exit(128 + number)
