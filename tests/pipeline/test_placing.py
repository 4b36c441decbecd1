"""Contacts placed on the way to a design: sets tried, the best first, written and told; the same however it is run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from casadi_hands import explore
from casadi_hands.errors import DesignError, SolveError
from casadi_hands.execution.processes import processes
from casadi_hands.export.design import Design
from casadi_hands.pipeline import placing, run, solve
from casadi_hands.pipeline.formulate import formulate
from casadi_hands.pipeline.placing import Tried, place, placed_like, stood_like
from casadi_hands.pipeline.record import Record
from casadi_hands.pipeline.unfinished import stopped_solve
from casadi_hands.placement.place import propose
from casadi_hands.task import Task, parse_task
from tests.pipeline.test_resume import StoppedError, content, stopping_at

TASK = """\
name: ball
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {position: [0, 0, 0.3], facing: [0, 0, -1]}
motion: [{at: 0, position: [0, 0, 0.22]}, {at: 2, position: [0, 0, 0.2]}]
friction: 0.8
search: {trials: 1, recombinations: 1, max_joints: 1}
fingers: FINGERS
"""


def ball(fingers: str = "3") -> Task:
    return parse_task(TASK.replace("FINGERS", fingers))


def silent(task: Task) -> Record:
    return Record(task, None, lambda _: None)


def tried_as(monkeypatch: pytest.MonkeyPatch, *outcomes: Tried) -> None:
    """Let the soft stages end so for the sets in turn."""
    left = list(outcomes)
    monkeypatch.setattr(placing, "try_contacts", lambda _: left.pop(0))


def test_fewest_joints_come_first(monkeypatch: pytest.MonkeyPatch) -> None:
    count = len(propose(ball()).sets)
    assert count >= 3
    outcomes = [Tried((2, 2, 2), held=True), Tried((1, 1), idle=1, held=True), Tried((2, 1, 2), held=True)]
    outcomes += [Tried(broke_off="no")] * (count - 3)
    tried_as(monkeypatch, *outcomes)
    tasks, told = place(ball(), silent(ball()), None)
    sets = propose(ball()).sets
    assert [t.fingers for t in tasks[:3]] == [sets[k].in_task(ball()).fingers for k in (2, 0, 1)]
    assert told["sets"][0]["joints"] == [2, 1, 2]
    assert told["why"].startswith(
        f"of {count} sets it takes the least: 2+1+2 joints (the others: 2+2+2 joints, 1+1 joints, 1 idle"
    )
    assert told["asked"] == dict.fromkeys(("finger1", "finger2", "finger3"), "anywhere")


def test_the_same_in_other_processes() -> None:
    here = place(ball(), silent(ball()), None)
    with processes(2) as workers:
        there = place(ball(), silent(ball()), workers)
    assert here == there


def solved_as(monkeypatch: pytest.MonkeyPatch, *statuses: str) -> list[Task]:
    """Let designs end so, in turn; the tasks they are of."""
    left, tasks = list(statuses), []

    def design(record: Record, *_: Any) -> Design:
        tasks.append(record.task)
        number, status = record.journal.once("design", lambda: (len(statuses) - len(left), left.pop(0)))
        with record.stage("refine", f"design {number + 1}"):
            record.add_runs([{"stage": "refine", "what": f"design {number + 1}", "seconds": 0.0}])
        return replace(record.design, status=status, reason="")

    monkeypatch.setattr(run, "_design", design)
    monkeypatch.setattr(placing, "try_contacts", lambda _: Tried((1, 1, 1), held=True))
    return tasks


def test_the_placed_contacts_are_written(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    tasks = solved_as(monkeypatch, "certified")
    design = solve(ball(), jobs=1, out=tmp_path)
    again = Design.load(tmp_path)
    assert again.task.fingers == design.task.fingers == tasks[0].fingers
    assert again.task.is_placed
    assert again.placement == design.placement
    assert again.placement["chosen"] == 0
    assert again.seconds["placement"] > 0
    first = again.placement["sets"][0]["points"]
    assert {name: list(finger.point) for name, finger in again.task.fingers.items()} == first


@pytest.mark.parametrize(("statuses", "chosen"), [(("feasible", "certified"), 1), (("feasible", "failed"), 0)])
def test_the_next_set_where_the_first_is_not_certified(
    statuses: tuple[str, str], chosen: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    tasks = solved_as(monkeypatch, *statuses)
    design = solve(ball(), jobs=1, out=tmp_path)
    assert len(tasks) == 2
    assert design.task.fingers == tasks[chosen].fingers
    assert Design.load(tmp_path).placement["chosen"] == chosen


@pytest.mark.parametrize("statuses", [("feasible", "certified"), ("feasible", "failed")])
def test_both_designs_runs_and_times_are_told_whichever_is_taken(
    statuses: tuple[str, str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    began: list[float] = []
    solved_as(monkeypatch, *statuses)
    design = solve(ball(), jobs=1, out=tmp_path, progress=lambda news: began.append(news.elapsed))
    assert [run["what"] for run in design.stages] == ["design 1", "design 2"]
    assert Design.load(tmp_path).stages == design.stages
    assert design.seconds["total"] >= began[-1]


NEAR = "{touches: {near: [0, 0.03, 0], within: 0.02}}"


@pytest.mark.parametrize("fingers", ["3", "{count: [2, 6]}", f"{{a: {NEAR}, b: {{touches: anywhere}}}}"])
def test_a_certified_result_is_of_the_task_that_asked_for_its_contacts(
    fingers: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    solved_as(monkeypatch, "certified")
    kept = solve(ball(fingers), jobs=1, out=tmp_path).task
    assert len(kept.fingers) < 6
    for same in (ball(fingers), kept):
        with pytest.raises(DesignError, match=r"holds a certified result of this task already\n--force"):
            solve(same, jobs=1, out=tmp_path)
    for other in ("5", f"{{finger1: {NEAR}, b: {{touches: anywhere}}}}"):
        with pytest.raises(DesignError, match="holds a certified result of another task"):
            solve(ball(other), jobs=1, out=tmp_path)


@pytest.mark.parametrize("words", ["set 2, 2 of", "design 1", "design 2"])
def test_a_stopped_solve_goes_on_to_the_same_files(words: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def pretend() -> list[Task]:
        """What is done twice finds no outcome left."""
        designed = solved_as(monkeypatch, "feasible", "certified")
        joints = range(len(propose(ball()).sets), 0, -1)
        tried_as(monkeypatch, *[Tried((n, 1, 1), held=True) for n in joints])
        return designed

    whole, out = tmp_path / "whole", tmp_path / "out"
    pretend()
    solve(ball(), jobs=1, out=whole)
    designed = pretend()
    with pytest.raises(StoppedError):
        solve(ball(), jobs=1, out=out, progress=stopping_at(words))
    task, _ = stopped_solve(out)
    assert task == ball()
    solve(task, jobs=1, out=out, resume=True)
    assert content(out) == content(whole)
    assert content(out)["placement.json"]
    assert len({str(each.fingers) for each in designed}) == 2
    assert {each.name for each in tmp_path.iterdir()} == {"whole", "out"}


def test_a_stopped_exploration_keeps_the_contacts_that_were_placed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    whole, out = tmp_path / "whole", tmp_path / "out"
    solved_as(monkeypatch, "certified", "certified")
    explore(ball(), seeds=[0, 1], jobs=1, out=whole)
    solved_as(monkeypatch, "certified", "certified")
    with pytest.raises(StoppedError):
        explore(ball(), seeds=[0, 1], jobs=1, out=out, progress=stopping_at("placement: seed 1"))
    ranked = explore(ball(), seeds=[0, 1], jobs=1, out=out, resume=True)
    assert all(one.design.task.is_placed for one in ranked)
    assert content(out) == content(whole)


def test_what_cannot_be_placed_fails_with_its_reason(tmp_path: Path) -> None:
    # On the side that faces away from the palm no finger is side-on.
    task = ball("{a: {touches: {near: [0, 0, -0.03], within: 0.001}}, b: {touches: anywhere}}")
    design = solve(task, jobs=1, out=tmp_path)
    assert design.status == "failed"
    assert design.reason.startswith("contact 'a' (within 1 mm of [0.0, 0.0, -0.03] m): ")
    assert Design.load(tmp_path).reason == design.reason
    with pytest.raises(SolveError, match="contact 'a'"):
        formulate(task, "floating", jobs=1)


def test_a_program_of_placed_contacts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(placing, "try_contacts", lambda _: Tried((1, 1, 1), held=True))
    found = formulate(ball(), "floating", jobs=1)
    assert found.model.contact_names == ("finger1", "finger2", "finger3")


def test_contacts_of_an_earlier_result_are_kept() -> None:
    task = ball("{count: [2, 4]}")
    earlier = propose(task).sets[0].in_task(task)
    again = placed_like(task, earlier)
    assert again.is_placed
    assert again.fingers == earlier.fingers
    assert placed_like(ball("{a: {touches: anywhere}, b: {touches: anywhere}}"), earlier).is_placed is False


def test_an_earlier_result_of_other_contacts_is_no_start(tmp_path: Path) -> None:
    Design(task=ball("{a: {touches: [0, 0.03, 0]}, b: {touches: [0, -0.03, 0]}}"), status="failed").save(tmp_path)
    with pytest.raises(SolveError, match="has no contacts that were placed for what this task asks"):
        solve(ball(), jobs=1, start=tmp_path)


def anywhere(fingers: str = "3", more: str = "") -> Task:
    """The ball's task with a palm that the program places."""
    text = TASK.replace("palm: {position: [0, 0, 0.3], facing: [0, 0, -1]}", "palm: auto")
    return parse_task(text.replace("FINGERS", fingers) + more)


TWO = "{a: {touches: [0.03, 0, 0]}, b: {touches: [-0.03, 0, 0]}}"


@pytest.mark.parametrize("fingers", ["3", TWO])
def test_where_the_palm_was_placed_is_told_and_written(
    fingers: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    solved_as(monkeypatch, "certified")
    said: list[str] = []
    task = anywhere(fingers, "keep_out: [{name: shelf, box: {center: [0, 0, 0.4], size: [0.2, 0.2, 0.02]}}]\n")
    solve(task, jobs=1, out=tmp_path, progress=lambda news: said.append(news.text))
    again = Design.load(tmp_path)
    assert again.task.palm == task.palm
    told = again.placement["palm"]
    assert (told["position"], told["facing"]) == (list(task.palm.position), list(task.palm.facing))
    assert told["keep_out_gaps"]["shelf"] > 0
    assert any(told["why"] in words for words in said)
    assert ("sets" in again.placement) == (fingers == "3")
    with pytest.raises(DesignError, match="holds a certified result of this task already"):
        solve(task, jobs=1, out=tmp_path)


def test_a_palm_that_was_placed_is_kept_where_it_may_stand() -> None:
    earlier = anywhere(TWO)
    task = anywhere(TWO).changed(motion=[{"at": 0, "position": [0, 0, 0.22]}, {"at": 2, "position": [0, 0, 0.18]}])
    assert task.palm != earlier.palm
    assert stood_like(task, earlier).palm == earlier.palm
    given = task.changed(palm={"position": [0, 0, 0.3], "facing": [0, 0, -1]})
    assert stood_like(given, earlier) == given
    x, y, z = earlier.palm.position
    boxed = task.changed(keep_out=[{"box": {"center": [x, y, z], "size": [0.02, 0.02, 0.02]}}])
    assert stood_like(boxed, earlier) == boxed
