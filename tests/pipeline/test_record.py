"""What is kept: runs, costs, and all time, whichever design is returned."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from casadi_hands.export.design import Design
from casadi_hands.nlp import Term
from casadi_hands.pipeline.record import Progress, Record
from tests.pipeline.replayed import replayed
from tests.stages.example import made_up_solution
from tests.stages.synthesis.example import ball_task


def record(news: list[Progress], out: Path | None = None) -> Record:
    return Record(ball_task(), out, news.append)


class Clock:
    """A clock that stands still but where it is put forward."""

    def __init__(self) -> None:
        self.now = 1000.0

    def perf_counter(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr("casadi_hands.pipeline.record.time", clock)
    return clock


def test_an_earlier_design_gets_the_runs_and_times_of_what_was_tried_after_it(clock: Clock) -> None:
    news: list[Progress] = []
    kept = record(news)
    with kept.stage("refine", "first"):
        clock.now += 2
    kept.add_runs([{"stage": "refine", "what": "first"}])
    earlier = kept.design
    clock.now += 4
    with kept.stage("refine", "second"):
        clock.now += 3
    kept.add_runs([{"stage": "refine", "what": "second"}])
    design = kept.complete(earlier)
    assert earlier.seconds == {"refine": 2}
    assert design.seconds == {"refine": 5, "total": 9}
    assert [run["what"] for run in design.stages] == ["first", "second"]
    assert [(word.stage, word.text, word.elapsed) for word in news] == [("refine", "first", 0), ("refine", "second", 6)]


def test_costs_have_the_last_of_annealed_weights_and_those_of_perturbed_twins() -> None:
    kept = record([])
    declared = {name: Term(name) for name in ("physics", "collision")}
    declared |= {"physics_perturbed": Term("physics"), "on_ground": Term("on_ground", weighs_as="physics")}
    solution = made_up_solution({}, physics=2.0, physics_perturbed=3.0, collision=4.0, on_ground=5.0)
    solution = replace(solution, declared=declared)
    kept.set_costs("synthesis", solution, {"physics": 10.0, "collision": (0.1, 5.0, 100.0)})
    assert kept.design.costs["synthesis"] == {
        "physics": {"weight": 10.0, "value": 2.0},
        "physics_perturbed": {"weight": 10.0, "value": 3.0},
        "collision": {"weight": 100.0, "value": 4.0},
        "on_ground": {"weight": 10.0, "value": 5.0},
    }


def test_what_is_kept_is_written(clock: Clock, tmp_path: Path) -> None:
    kept = record([], tmp_path)
    clock.now += 7
    kept.keep(kept.design)
    loaded = Design.load(tmp_path)
    assert loaded.reason == "nothing has been computed yet"
    assert loaded.seconds["total"] == 7


def test_nothing_unfinished_takes_the_place_of_a_judged_design(tmp_path: Path) -> None:
    kept = record([], tmp_path)
    kept.keep_unfinished("stopped early")
    assert Design.load(tmp_path).reason == "stopped early"
    kept.update_best(replace(kept.design, status="feasible", reason="slips a little"))
    kept.keep_unfinished("stopped while another hand was tried")
    loaded = Design.load(tmp_path)
    assert (loaded.status, loaded.reason) == ("feasible", "slips a little")


def test_what_was_not_replayed_is_not_called_certified(tmp_path: Path) -> None:
    kept = record([], tmp_path)
    kept.update_best(replace(kept.design, status="certified", reason=""))
    loaded = Design.load(tmp_path)
    assert (loaded.status, loaded.reason) == ("feasible", "its files hold; it was stopped before it was replayed")
    kept.update_best(replayed(replace(kept.design, status="certified", reason=""), 1))
    assert Design.load(tmp_path).status == "certified"


def test_the_best_design_is_written_as_soon_as_it_is_known(tmp_path: Path) -> None:
    kept = record([], tmp_path)

    def judged(reason: str, missed: tuple[str, ...], drops: int | None) -> Design:
        design = replace(kept.design, reason=reason, certificate={name: {"holds": False} for name in missed})
        return design if drops is None else replayed(design, drops)

    offers = (("two", ("slip", "gap"), None), ("one", ("gap",), None), ("worse", ("slip", "gap"), 0))
    offers += ("none", (), None), ("equal", (), None), ("fewer drops", (), 3), ("more", (), 5), ("held", (), 0)
    best = []
    for reason, missed, drops in offers:
        best.append(kept.update_best(judged(reason, missed, drops)).reason)
        assert Design.load(tmp_path).reason == best[-1]
    assert best == ["two", "one", "one", "none", "none", "fewer drops", "fewer drops", "held"]
