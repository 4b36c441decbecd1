"""Where the work runs: the same numbers in one process and in two, in the order asked for."""

from __future__ import annotations

import multiprocessing
import os
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from casadi_hands.execution.processes import processes, run_all, start_up
from casadi_hands.stages.synthesis.stage import Synthesised
from casadi_hands.stages.synthesis.trials import combine_fingers, design_finger
from tests.stages.synthesis.example import ball_target, ball_task
from tests.stages.synthesis.test_algorithm import search_ball


def slowly(seconds: float, value: int) -> int:
    time.sleep(seconds)
    return value


def threads(_: int) -> tuple[str | None, int]:
    return os.environ.get("OMP_NUM_THREADS"), os.getpid()


def failing(value: int) -> int:
    if value == 1:
        raise ValueError("one")
    return value


class Recording(Executor):
    """One thread, and what it was given."""

    def __init__(self) -> None:
        self.pool, self.futures = ThreadPoolExecutor(1), list[Future[Any]]()

    def submit(self, function: Any, /, *arguments: Any, **named: Any) -> Future[Any]:
        self.futures.append(self.pool.submit(function, *arguments, **named))
        return self.futures[-1]


def interrupt(*_: object) -> None:
    raise KeyboardInterrupt


class Busy:
    """Counts the threads that are in it."""

    inside = most = 0

    @classmethod
    def enter(cls, value: int) -> int:
        cls.inside += 1
        cls.most = max(cls.most, cls.inside)
        time.sleep(0.02)
        cls.inside -= 1
        return value


def same(one: Synthesised, other: Synthesised) -> None:
    assert one.solution.objective == other.solution.objective
    assert one.solution.terms == other.solution.terms
    for a, b in zip(one.fingers, other.fingers, strict=True):
        for name in ("base", "lengths", "axes", "bends", "angles", "tips", "frames"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def test_two_processes_give_the_numbers_of_one_in_the_same_order() -> None:
    target, weights = ball_target(), dict(ball_task().weights.synthesis)
    trials = [(target, contact, 1, (0, contact, 1, trial), weights) for contact in (0, 1) for trial in (0, 1)]
    heard: list[tuple[int, float]] = []
    here = run_all(None, design_finger, trials, lambda index, result: heard.append((index, result.solution.objective)))
    assert heard == list(enumerate(result.solution.objective for result in here))
    hands = [(target, (0, 1), (here[a].fingers[0], here[b].fingers[0]), weights) for a, b in ((0, 2), (1, 3))]
    combined = run_all(None, combine_fingers, hands, lambda *_: None)
    with processes(2) as executor:
        assert executor is not None
        # The first is the slowest, yet it comes first.
        naps = [(1.0, 0), (0.0, 1), (0.0, 2)]
        order: list[int] = []
        assert run_all(executor, slowly, naps, lambda index, _: order.append(index)) == [0, 1, 2]
        assert sorted(order) == [0, 1, 2]
        assert order[-1] == 0
        away = run_all(executor, design_finger, trials, lambda *_: None)
        recombined = run_all(executor, combine_fingers, hands, lambda *_: None)
        environments = run_all(executor, threads, [(0,)], lambda *_: None)
        with pytest.raises(ValueError, match="one"):
            run_all(executor, failing, [(0,), (1,), (2,)], lambda *_: None)
    for one, other in zip([*here, *combined], [*away, *recombined], strict=True):
        same(one, other)
    assert len({result.solution.objective for result in here}) == len(here)
    assert environments[0][0] == "1"
    assert environments[0][1] != os.getpid()


def test_one_job_is_this_process_and_the_environment_is_left_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    with processes(1) as executor:
        assert executor is None
        assert os.environ["OMP_NUM_THREADS"] == "7"
    with processes(2):
        assert os.environ["OMP_NUM_THREADS"] == "1"
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MKL_NUM_THREADS" not in os.environ


def test_any_executor_serves_and_a_process_runs_one_trial_at_a_time() -> None:
    Busy.inside = Busy.most = 0
    with ThreadPoolExecutor(3) as threads_of_one:
        found = run_all(threads_of_one, Busy.enter, [(value,) for value in range(9)], lambda *_: None)
    assert found == list(range(9))
    assert Busy.most == 1


def test_a_search_in_a_thread_finds_the_hand_that_it_finds_here() -> None:
    words: list[str] = []
    with ThreadPoolExecutor(1) as executor:
        away = search_ball(executor, words.append)
    here = search_ball(None)
    for one, other in zip(away.candidates, here.candidates, strict=True):
        same(one.hand, other.hand)
    assert any("trial 3/3" in word for word in words)


def test_an_interruption_cancels_what_has_not_begun() -> None:
    executor = Recording()
    with executor.pool, pytest.raises(KeyboardInterrupt):
        run_all(executor, slowly, [(0.05, value) for value in range(20)], interrupt)
    assert 1 <= sum(future.done() and not future.cancelled() for future in executor.futures) < 5
    assert all(future.done() for future in executor.futures)


def test_workers_start_before_there_is_work() -> None:
    with processes(2) as executor:
        assert executor is not None
        start_up(executor, 2)
        assert len(multiprocessing.active_children()) == 2
