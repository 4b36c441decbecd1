"""Processes, and work that runs in them."""

from __future__ import annotations

import os
import pickle
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, as_completed
from contextlib import contextmanager
from typing import Any, TypeVar

from casadi_hands.execution.journal import Section
from casadi_hands.execution.workers import LostCallError, Workers

Result = TypeVar("Result")
_alone = threading.Lock()
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@contextmanager
def processes(jobs: int) -> Iterator[Executor | None]:
    """An executor of ``jobs`` processes, one thread of linear algebra each; None for one."""
    if jobs == 1:
        yield None
        return
    saved = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    workers = Workers(jobs)
    try:
        yield workers
    finally:
        workers.stop()
        for name, value in saved.items():
            os.environ.pop(name, None) if value is None else os.environ.update({name: value})


def start_up(executor: Executor, jobs: int) -> None:
    """Let ``processes`` start and import what they need, so that they have done so when work comes."""
    for _ in range(jobs):
        executor.submit(_called, pickle.dumps((int, ())))


def _called(packed: bytes) -> bytes:
    """A function's result, both pickled; one at a time in a process, because IPOPT crashes when two threads run it.

    Pickled here, arrays lie in memory as Python puts them: NumPy may round otherwise where an executor's own transport
    lays them elsewhere.
    """
    function, arguments = pickle.loads(packed)
    with _alone:
        return pickle.dumps(function(*arguments))


def run_all(
    executor: Executor | None,
    function: Callable[..., Result],
    arguments: Sequence[tuple[Any, ...]],
    done: Callable[[int, Result], None],
    kept: Section | None = None,
    name: Callable[[int], str] = "call {}".format,
) -> list[Result]:
    """Call a function on every tuple of arguments; results in that order, ``done(index, result)`` as they come.

    An error, also an interruption, cancels what has not begun.

    Args:
        executor: where they run; None for here.
        function: what is called.
        arguments: of each call.
        done: told of each result.
        kept: where results are kept as they come, and taken from where they are.
        name: what a call is, by its index.

    Raises:
        LostCallError: the processes that ran a call ended with it; the message names it.
    """
    collected: dict[int, Result] = {}

    def collect(index: int, result: Result) -> None:
        collected[index] = result
        done(index, result)

    for index in range(len(arguments)):
        if kept is not None and kept.has(index):
            collect(index, kept.get(index))
    left = [index for index in range(len(arguments)) if index not in collected]
    if executor is None:
        for index in left:
            result = function(*arguments[index])
            collect(index, result if kept is None else kept.put(index, result))
        return [collected[index] for index in range(len(arguments))]
    futures: dict[Future[bytes], int] = {}
    try:
        for index in left:
            futures[executor.submit(_called, pickle.dumps((function, arguments[index])))] = index
        for future in as_completed(futures):
            index = futures[future]
            try:
                result = pickle.loads(future.result())
            except LostCallError as error:
                raise LostCallError(f"{name(index)}: {error}") from error
            collect(index, result if kept is None else kept.put(index, result))
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    return [collected[index] for index in range(len(arguments))]
