"""Call a function in a process of its own: one thread of linear algebra, a limit of time, memory measured."""

from __future__ import annotations

import multiprocessing
import os
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
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
    value, failure, kilobytes = None, f"stopped after {limit:g} s", 0
    try:
        if ours.poll(limit):
            value, failure, kilobytes = ours.recv()
    except EOFError:
        failure = "the process died"
    finally:
        process.kill()
        process.join()
        ours.close()
    return Outcome(value, failure, kilobytes / 1024, time.perf_counter() - began)


def _answer(pipe: Connection, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    value, failure = None, ""
    try:
        value = function(*arguments)
    except Exception as error:
        failure = f"{type(error).__name__}: {error}"
    pipe.send((value, failure, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss))
    pipe.close()
