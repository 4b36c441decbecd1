"""The figures and the record of replays, against hand-made ones."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from casadi_hands.verify import Perturbation, Replay, Replays
from casadi_hands.verify.replays.replay import GoalError
from tests.export.example import example_task

TASK = example_task()  # three goals, half an extent of 60 mm: 3 mm and 5 degrees are allowed


def played(*goals: tuple[float, float], dropped: bool = False) -> Replay:
    errors = tuple(GoalError(position, angle) for position, angle in goals)
    return Replay(1e-3, 2e-3, 3e-3, 0.1, 0.2, 0.3, dropped, (), Perturbation(), errors)


NEAR = played((1e-3, 1.0), (2e-3, 4.0), (1e-3, 2.0))


def test_the_worst_goal_is_named_with_its_time() -> None:
    seen = Replays("drake", TASK, 1e-3, 0, played((1e-3, 1.0), (2e-3, 6.0), (4e-3, 2.0)), {})
    position, angle = seen.figures()
    assert (position.value, position.limit, position.holds) == (4e-3, pytest.approx(3e-3), False)
    assert position.text == "in Drake the object is 4 mm from goal 3 at 2 s"
    assert (angle.value, angle.holds) == (6.0, False)
    assert angle.text == "in Drake the object is turned 6 deg from goal 2 at 1 s"


@pytest.mark.parametrize(("drops", "holds"), [(0, True), (1, True), (2, False)])
def test_one_in_twenty_perturbed_replays_may_drop_the_object(drops: int, holds: bool) -> None:
    perturbed = {f"number {k}": played(dropped=k < drops) for k in range(20)}
    seen = Replays("mujoco", TASK, 1e-3, 0, NEAR, perturbed)
    *_, dropped = seen.figures()
    assert (dropped.name, dropped.value, dropped.holds) == ("replay_dropped", drops / 20, holds)
    assert seen.drops == drops
    assert seen.dropping == ("number 0", "number 1")[:drops]
    assert seen.dropped_before() is None
    record = json.loads(json.dumps(seen.record(), allow_nan=False))
    assert (record["dropped"], record["of"], record["dropped_as_planned"]) == (drops, 20, False)
    assert record["goals"][1] == {"mm": 2.0, "degrees": 4.0}
    assert (record["mean"], record["largest"]) == ({"mm": 1.0, "degrees": 0.1}, {"mm": 2.0, "degrees": 0.2})


def test_an_object_dropped_as_planned_counts_as_dropped_always() -> None:
    lost = played((1e-3, 1.0), (0.3, 90.0), (0.3, 90.0), dropped=True)
    seen = Replays("mujoco", TASK, 1e-3, 0, lost, {f"number {k}": NEAR for k in range(12)})
    *_, dropped = seen.figures()
    assert (dropped.value, dropped.holds, seen.drops) == (1.0, False, 12)
    assert seen.dropped_before() == "in MuJoCo the object is dropped before goal 2 at 1 s"


@pytest.mark.parametrize(
    ("drops", "words"),
    [(0, ""), (1, " (number 0)"), (3, " (number 0, number 1, number 2)"), (4, " (number 0, number 1, number 2, …)")],
)
def test_some_of_the_replays_that_drop_the_object_are_named(drops: int, words: str) -> None:
    perturbed = {f"number {k}": played(dropped=k < drops) for k in range(40)}
    *_, dropped = Replays("mujoco", TASK, 1e-3, 0, NEAR, perturbed).figures()
    assert dropped.text == f"in MuJoCo {drops} of 40 perturbed replays drop the object{words}, {2.5 * drops:.3g} %"


def test_the_record_says_what_was_perturbed() -> None:
    change = Perturbation(stiffness=0.5, joint_bias=(0.01, -0.01))
    seen = Replays("mujoco", TASK, 1e-3, 0, NEAR, {"both": replace(NEAR, perturbation=change), "nothing": NEAR})
    settings = json.loads(json.dumps(seen.record()))["settings"]
    assert settings["suite"] == {"both": {"stiffness": 0.5, "joint_bias": [0.01, -0.01]}, "nothing": {}}
