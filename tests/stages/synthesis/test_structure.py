"""The structures that figures 3.6a and 3.6b must give, from the defaults; slow."""

from __future__ import annotations

from concurrent.futures import Executor
from pathlib import Path

import numpy as np
import pytest

from casadi_hands.execution.processes import processes
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.stage import FloatingStage
from casadi_hands.stages.synthesis.algorithm import Found, Search
from casadi_hands.stages.synthesis.target import Target, target_of
from casadi_hands.task import Task, load_task

PROBLEMS = Path(__file__).parents[3] / "problems"
FIGURES = {"horizontal_translation_no_gravity": 1, "horizontal_translation": 2}
pytestmark = pytest.mark.slow


def prepared(name: str) -> tuple[Task, Target]:
    task = load_task(PROBLEMS / f"{name}.yaml")
    model = build_model(task)
    return task, target_of(model, FloatingStage(model).solve(dict(task.weights.floating)))


def found(task: Task, target: Target, seed: int, executor: Executor | None, trials: int | None = None) -> Found:
    settings = task.search
    return Search(
        target,
        dict(task.weights.synthesis),
        trials=trials or settings.trials,
        recombinations=settings.recombinations,
        max_joints=settings.max_joints,
        threshold=settings.threshold,
        seed=seed,
        executor=executor,
        progress=lambda _: None,
    ).run()


@pytest.mark.parametrize("name", FIGURES)
def test_joints_a_finger(name: str) -> None:
    task, target = prepared(name)
    with processes(None) as executor:
        joints = [found(task, target, seed, executor).candidates[0].joints for seed in range(5)]
    wanted = (FIGURES[name],) * len(task.fingers)
    assert joints.count(wanted) >= 4, joints


def test_two_jobs_find_what_one_finds() -> None:
    task, target = prepared("horizontal_translation")
    alone = found(task, target, 0, None, trials=4)
    with processes(2) as executor:
        shared = found(task, target, 0, executor, trials=4)
    assert [c.trial for c in alone.candidates] == [c.trial for c in shared.candidates]
    for one, other in zip(alone.candidates, shared.candidates, strict=True):
        assert one.scores == other.scores
        assert one.hand.solution.objective == other.hand.solution.objective
        for a, b in zip(one.hand.fingers, other.hand.fingers, strict=True):
            for name in ("base", "lengths", "axes", "bends", "angles", "tips"):
                np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
