"""Processes, and work that runs in them."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from typing import Any, TypeVar

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
    try:
        context = multiprocessing.get_context("spawn")
        # An interrupt is the parent's to handle: workers end with it, silently.
        with ProcessPoolExecutor(
            jobs, mp_context=context, initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN)
        ) as executor:
            yield executor
    finally:
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
) -> list[Result]:
    """Call a function on every tuple of arguments; results in that order, ``done(index, result)`` as they come.

    An error, also an interruption, cancels what has not begun.
    """
    if executor is None:
        results = []
        for index, args in enumerate(arguments):
            results.append(function(*args))
            done(index, results[-1])
        return results
    futures: dict[Future[bytes], int] = {}
    collected: dict[int, Result] = {}
    try:
        for index, args in enumerate(arguments):
            futures[executor.submit(_called, pickle.dumps((function, args)))] = index
        for future in as_completed(futures):
            index = futures[future]
            collected[index] = pickle.loads(future.result())
            done(index, collected[index])
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    return [collected[index] for index in range(len(arguments))]
