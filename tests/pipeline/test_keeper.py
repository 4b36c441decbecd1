"""What stands in a folder makes way for a better result, or where that is forced."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from casadi_hands.errors import DesignError
from casadi_hands.export.design import Design
from casadi_hands.pipeline.keeper import Keeper, rival_in
from casadi_hands.task import Task, parse_task
from tests.export.example import TASK, example_design, example_task


def judged(status: str, *missed: str, reason: str = "") -> Design:
    figures = {name: {"value": 1.0, "limit": 1.0, "holds": name not in missed} for name in ("slip", "gap", "speed")}
    return replace(example_design(), status=status, reason=reason, certificate=figures)


def other_task() -> Task:
    return parse_task(TASK.replace("mass: 0.1", "mass: 0.2"))


def searched_otherwise() -> Task:
    return parse_task(TASK + "search: {seed: 7, trials: 3}\n")


def test_a_certified_result_is_not_replaced_unasked(tmp_path: Path) -> None:
    judged("certified").save(tmp_path)
    for task, words in ((example_task(), "this task"), (searched_otherwise(), "this task"), (other_task(), "another ")):
        with pytest.raises(DesignError, match=f"holds a certified result of {words}.*already\n--force replaces it"):
            rival_in(tmp_path, task)
        assert rival_in(tmp_path, task, force=True) is not None


@pytest.mark.parametrize(
    ("status", "task", "refused"),
    [
        ("feasible", example_task(), False),
        ("feasible", searched_otherwise(), False),
        ("feasible", other_task(), True),
        ("failed", example_task(), False),
        ("failed", other_task(), False),
    ],
)
def test_what_is_not_certified_is_replaced_by_a_result_of_its_own_task(
    status: str, task: Task, refused: bool, tmp_path: Path
) -> None:
    judged(status, "slip").save(tmp_path)
    if refused:
        with pytest.raises(DesignError, match="holds a feasible result of another task"):
            rival_in(tmp_path, task)
    else:
        rival_in(tmp_path, task)


def test_what_cannot_be_read_is_not_replaced_unasked(tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text("{")
    with pytest.raises(DesignError, match=r"cannot be read \(.*\)\n--force"):
        rival_in(tmp_path, example_task())
    assert rival_in(tmp_path, example_task(), force=True) is None
    assert rival_in(tmp_path / "nothing", example_task()) is None


def test_only_what_is_no_worse_takes_its_place(tmp_path: Path) -> None:
    judged("feasible", "slip", reason="before").save(tmp_path)
    keeper = Keeper(tmp_path, rival_in(tmp_path, example_task()))
    unjudged = replace(judged("failed"), certificate={})
    for worse in (unjudged, judged("failed", "slip"), judged("feasible", "slip", "gap")):
        keeper.keep(worse)
        assert Design.load(tmp_path).reason == "before"
    keeper.keep(judged("failed"), last=True)
    assert keeper.outdone
    assert Design.load(tmp_path).reason == "before"
    keeper.keep(judged("feasible", "gap", reason="as good"), last=True)
    assert not keeper.outdone
    assert Design.load(tmp_path).reason == "as good"


def test_where_it_is_forced_the_last_one_does(tmp_path: Path) -> None:
    judged("certified", reason="before").save(tmp_path)
    keeper = Keeper(tmp_path, rival_in(tmp_path, example_task(), force=True), replaces=True)
    keeper.keep(judged("feasible", "slip", reason="on the way"))
    assert Design.load(tmp_path).reason == "before"
    keeper.keep(judged("failed", "slip", reason="in the end"), last=True)
    assert Design.load(tmp_path).reason == "in the end"


def test_a_result_that_was_not_judged_stands_in_nobody_s_way(tmp_path: Path) -> None:
    replace(judged("feasible", reason="stopped after the stage floating, as asked"), certificate={}).save(tmp_path)
    keeper = Keeper(tmp_path, rival_in(tmp_path, example_task()))
    keeper.keep(judged("failed", "slip", "gap", reason="in the end"), last=True)
    assert Design.load(tmp_path).reason == "in the end"
