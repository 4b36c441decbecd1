"""Call a function in a process of its own: one thread of linear algebra, a limit of time, memory measured."""

from __future__ import annotations

import multiprocessing
import os
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Generic, TypeVar

Value = TypeVar("Value")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Outcome(Generic[Value]):
    """What a call in a process of its own gave.

    Attributes:
        value: that the function returned; None where it did not.
        failure: why it did not, else empty.
        megabytes: largest resident memory of the process, 2^20 bytes; 0 where it did not end by itself.
        seconds: wall time, the process's start included.
    """

    value: Value | None
    failure: str
    megabytes: float
    seconds: float


def isolated(function: Callable[..., Value], *arguments: Any, limit: float) -> Outcome[Value]:
    """Call a function in a fresh process; it is stopped after ``limit`` seconds.

    Args:
        function: of a module, so that the other process finds it.
        arguments: of the function; they and the result are pickled.
        limit: s.
    """
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(theirs, function, arguments))
    began = time.perf_counter()
    process.start()
    theirs.close()
    value, failure, megabytes = None, f"stopped after {limit:g} s", 0.0
    try:
        if ours.poll(limit):
            value, failure, megabytes = ours.recv()
    except EOFError:
        failure = "the process died"
    finally:
        process.kill()
        process.join()
        ours.close()
    return Outcome(value, failure, megabytes, time.perf_counter() - began)


def _answer(pipe: Connection, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    value, failure = None, ""
    try:
        value = function(*arguments)
    except Exception as error:
        failure = f"{type(error).__name__}: {error}"
    pipe.send((value, failure, largest_memory()))
    pipe.close()


def largest_memory() -> float:
    """Largest resident memory of this process until now, in 2^20 bytes."""
    status = Path("/proc/self/status")
    if status.exists():
        # What getrusage says of a fresh process is at least what its parent had.
        lines = dict(line.split(":", 1) for line in status.read_text(encoding="utf-8").splitlines())
        return int(lines["VmHWM"].split()[0]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 1024)
