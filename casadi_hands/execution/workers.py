"""Processes that run calls: one that dies is replaced and its call run again, one that hangs is ended."""

from __future__ import annotations

import multiprocessing
import queue
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from casadi_hands.errors import SolveError
from casadi_hands.lifetime import PATIENCE, follow_parent, leaving

ATTEMPTS = 3
"""Processes that a call may take with it before it is given up."""

LONGEST = 1800.0
"""s that a call may take. Solves end by their iterations, in seconds: what takes this long never ends."""

_TICK = 1.0
_Call = tuple[Future[Any], Callable[..., Any], tuple[Any, ...]]


class LostCallError(SolveError):
    """A call that no process has brought to an end; the message says how it went, not which it was."""


class Workers(Executor):
    """Processes of this machine, each of which runs one call at a time.

    Args:
        jobs: how many.
        longest: s that a call may take; counted while this process runs, so that a night's sleep is none of them.
    """

    def __init__(self, jobs: int, longest: float = LONGEST) -> None:
        self._jobs, self._longest = jobs, longest
        self._calls: queue.SimpleQueue[_Call | None] = queue.SimpleQueue()
        self._workers: list[_Worker] = []
        self._threads: list[threading.Thread] = []
        self._closed = False

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Have a call run by the next process that is free, which is started if there are fewer than asked for.

        Raises:
            RuntimeError: after `shutdown`.
            SolveError: the process cannot be started.
        """
        if self._closed:
            raise RuntimeError("no calls are taken after the shutdown")
        if kwargs:
            raise TypeError("calls have no named arguments here")
        future: Future[Any] = Future()
        self._calls.put((future, function, args))
        if len(self._workers) < self._jobs:
            self._workers.append(_Worker())
            thread = threading.Thread(target=self._serve, args=(self._workers[-1],), daemon=True)
            self._threads.append(thread)
            thread.start()
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Take no more calls; those that were taken are run, or cancelled, where they have not begun, if so asked."""
        self._closed = True
        if cancel_futures:
            self._cancel()
        for _ in self._threads:
            self._calls.put(None)
        if wait:
            for thread in self._threads:
                thread.join()

    def stop(self) -> None:
        """End all processes at once, whatever they are at."""
        self._closed = True
        self._cancel()
        for worker in self._workers:
            worker.ask()
        self.shutdown()

    def _cancel(self) -> None:
        with suppress(queue.Empty):
            while True:
                if (call := self._calls.get_nowait()) is not None:
                    call[0].cancel()

    def _serve(self, worker: _Worker) -> None:
        """Have one process run calls until there are no more."""
        while (call := self._calls.get()) is not None:
            future, function, arguments = call
            if not future.set_running_or_notify_cancel():
                continue
            try:
                result = self._run(worker, function, arguments)
            except BaseException as error:
                future.set_exception(error)
            else:
                future.set_result(result)
        worker.stop()

    def _run(self, worker: _Worker, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        ends: list[str] = []
        while len(ends) < ATTEMPTS and not self._closed:
            ended = worker.run(function, arguments, self._longest)
            if ended is None:
                return worker.answer()
            ends.append(ended)
            if self._closed:
                break
            worker.start()
            if ended == _HANGING:
                raise LostCallError(f"it did not end in {self._longest / 60:.3g} min and was stopped")
        times = f" each of {ATTEMPTS} times" if len(ends) == ATTEMPTS else ""
        raise LostCallError(f"the process that ran it ended{times}: {ends[-1] if ends else 'stopped'}")


_HANGING = "hangs"


class _Worker:
    """One process and the pipe to it."""

    def __init__(self) -> None:
        self._stopped = False
        self._lock = threading.Lock()
        self._answer: tuple[bool, Any] = (True, None)
        self.start()

    def start(self) -> None:
        """Start the process, or another in the place of one that has ended."""
        with self._lock:
            if self._stopped or leaving.is_set():
                return
            context = multiprocessing.get_context("spawn")
            try:
                self._pipe, theirs = context.Pipe()
                self._process: BaseProcess = context.Process(target=_work, args=(theirs,), daemon=True)
                self._process.start()
            except OSError as error:
                raise SolveError(f"no process can be started for the trials: {error}; give --jobs 1") from error
            theirs.close()

    def run(self, function: Callable[..., Any], arguments: tuple[Any, ...], longest: float) -> str | None:
        """Have the process run a call; how the process ended where it did, else None, and there is an answer."""
        try:
            self._pipe.send((function, arguments))
            for _ in range(max(1, round(longest / _TICK))):
                if wait([self._pipe, self._process.sentinel], timeout=_TICK):
                    self._answer = self._pipe.recv()
                    return None
        except (EOFError, OSError):
            self._process.join(PATIENCE)
            return _how_ended(self._process.exitcode)
        self._process.kill()
        self._process.join()
        return _HANGING

    def answer(self) -> Any:
        """What the call gave; what it raised is raised."""
        good, value = self._answer
        if good:
            return value
        raise value

    def ask(self) -> None:
        """Ask the process to end; there will be no other."""
        with self._lock:
            self._stopped = True
            self._process.terminate()

    def stop(self) -> None:
        """End the process; it has no more to do."""
        self.ask()
        with self._lock:
            self._process.join(PATIENCE)
            if self._process.is_alive():
                self._process.kill()
                self._process.join()


def _how_ended(status: int | None) -> str:
    if status is not None and status < 0:
        return f"signal {-status} ({signal.Signals(-status).name})"
    return f"exit status {status}"


def _work(pipe: Connection) -> None:
    """Run calls as they come, until there are no more."""
    follow_parent()
    while True:
        try:
            function, arguments = pipe.recv()
        except EOFError:
            return
        answer: tuple[bool, Any]
        try:
            answer = (True, function(*arguments))
        except Exception as error:
            answer = (False, error)
        try:
            pipe.send(answer)
        except Exception as error:  # what cannot be pickled
            pipe.send((False, RuntimeError(f"what a call gave cannot be sent: {error}")))
