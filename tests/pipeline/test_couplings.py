"""How few motors are looked for, and what is said where they are not found; nothing is solved."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from casadi_hands.cli.summary import design_summary
from casadi_hands.export.design import Design
from casadi_hands.pipeline import couplings
from casadi_hands.pipeline.alternatives.ranking import rank
from casadi_hands.pipeline.couplings import Coupler
from casadi_hands.pipeline.judge import Judge, counted
from casadi_hands.pipeline.record import Record, rank_of
from casadi_hands.problem.coupling import Coupling
from casadi_hands.problem.drive import Drive
from casadi_hands.problem.hand import Finger
from tests.export.example import example_hand, example_motion, example_task
from tests.pipeline.replayed import replayed

OFF = {1: 0.5, 2: 0.3, 3: 0.2, 4: 0.1}  # rad that commands are off so many lines


def own_motors(asked: Any) -> Design:
    """A certified hand with a motor for each of its six joints."""
    task = example_task().model_copy(update={"motors": asked})
    design = Design(task, "certified", hand=example_hand(), motion=example_motion())
    return replayed(replace(design, certificate={"gap": {"value": 0.0, "limit": 1.0, "holds": True}}), 0)


def with_motors(design: Design, motors: int) -> Design:
    assert design.hand is not None
    drive = Drive(((1.0,) * motors,) * 6, (0.0,) * 6, 1.0, 1.0)
    return replace(design, hand=replace(design.hand, drive=drive))


class Whole:
    """A hand that a coupling is looked for."""

    def __init__(self, joints: list[int]) -> None:
        self.fingers = [SimpleNamespace(joints=n) for n in joints]


class Start:
    """What a coupling begins with."""

    def __init__(self, whole: Whole, motors: int) -> None:
        self.motors, self.joints = motors, sum(finger.joints for finger in whole.fingers)
        self.coupling = Coupling(np.ones((6, motors)), np.zeros(6), np.zeros((2, motors)), tuple(range(motors)))


class Search:
    """Of hands with other joints."""

    contacts = (0, 1, 2)

    def with_joints(self, joints: dict[int, int]) -> list[Whole]:
        return [Whole(list(joints.values()))]

    def take_runs(self) -> list[Any]:
        return []


def looked_for(
    monkeypatch: pytest.MonkeyPatch, asked: Any, works: int, joints: int = 6, larger: int | None = None
) -> tuple[Design, list[int]]:
    """The design that is handed over, and the numbers of motors tried, where so many and more work.

    Args:
        monkeypatch: for what solves.
        asked: motors.
        works: motors that work for the hand.
        joints: of the hand.
        larger: motors that work for a hand of more joints; None where there is none. Its tries count from ten.
    """
    design, tried = own_motors(asked), list[int]()
    assert design.hand is not None
    left, fingers = joints, list[Finger]()
    for finger in design.hand.fingers:
        fingers += [replace(finger, links=finger.links[:left])] if left else []
        left = max(0, left - len(finger.links))
    design = replace(design, hand=replace(design.hand, fingers=tuple(fingers)))
    assert design.hand is not None
    assert design.hand.degrees_of_freedom == joints

    class Refiner:
        def __init__(self, record: Record, model: Any, judge: Judge, jobs: int) -> None:
            self.motors = model.motors

        def certify(self, begun: Start, *_: Any, near: bool, **__: Any) -> tuple[Design, None]:
            assert near == (begun.joints == joints)
            tried.append(self.motors + (0 if near else 10))
            found = with_motors(design, self.motors)
            enough = self.motors >= (works if near else larger or 0)
            return (found if enough else replace(found, status="failed", reason="it slips")), None

    monkeypatch.setattr(couplings, "Refiner", Refiner)
    monkeypatch.setattr(couplings, "warm_start", lambda *_: Whole([len(f.links) for f in design.hand.fingers]))  # type: ignore[union-attr]
    monkeypatch.setattr(couplings, "kept_margin", lambda *_: None)
    monkeypatch.setattr(couplings, "coupled", lambda model, whole, motors: Start(whole, motors))
    monkeypatch.setattr(couplings, "joint_commands", lambda model, begun: np.full((2, 6), OFF[begun.motors]))
    model: Any = type("Model", (), {"motors": 0})()
    monkeypatch.setattr(couplings, "replace", _replaced)
    monkeypatch.setattr(couplings, "adopt", lambda *_: None)
    monkeypatch.setattr(couplings, "rolls_far", lambda _: False)
    monkeypatch.setattr(couplings, "run_whole_hand", lambda record, model, floating, candidate: candidate)
    certifier: Any = SimpleNamespace(search=Search(), floating=None) if larger else None
    coupler = Coupler(Record(design.task, None, lambda _: None), model, Judge(model, model), 1, certifier)
    return coupler.run(design), tried


def _replaced(value: Any, **changes: Any) -> Any:
    """As `dataclasses.replace`, also of the made-up model."""
    return type("Model", (), changes)() if "motors" in changes else replace(value, **changes)


def test_the_fewest_that_are_certified_are_taken_from_where_lines_are_near(monkeypatch: pytest.MonkeyPatch) -> None:
    found, tried = looked_for(monkeypatch, "fewest", works=3)
    assert tried == [2, 3]
    assert found.hand is not None
    assert (found.status, found.hand.motors, found.reason) == ("certified", 3, "")


def test_hands_of_more_joints_are_tried_before_another_motor(monkeypatch: pytest.MonkeyPatch) -> None:
    found, tried = looked_for(monkeypatch, "fewest", works=3, larger=2)
    assert tried == [11, 2, 12]
    assert found.hand is not None
    assert (found.status, found.hand.motors) == ("certified", 2)
    assert looked_for(monkeypatch, "fewest", works=3, larger=9)[1] == [11, 2, 12, 3]
    # Four motors leave the hand of three fingers of two joints one way to go.
    assert looked_for(monkeypatch, "fewest", works=9, larger=9)[1] == [11, 2, 12, 3, 13, 4]
    assert looked_for(monkeypatch, 2, works=2, larger=1)[1] == [2]
    assert looked_for(monkeypatch, 1, works=2, larger=1)[1] == [11]


@pytest.mark.parametrize(
    ("joints", "most", "due"),
    [([2, 2, 2], 3, (3, 3, 3)), ([2, 4, 3], 6, (3, 4, 3)), ([2, 1, 2], 2, (2, 2, 2)), ([3, 3], 3, ()), ([2, 2], 2, ())],
)
def test_fingers_get_the_joints_to_push_in_all_directions_that_they_may_have(
    joints: list[int], most: int, due: tuple[int, ...]
) -> None:
    assert couplings._with_enough(joints, most) == due


def test_of_a_number_only_that_is_tried_and_out_of_reach_it_is_not_certified(monkeypatch: pytest.MonkeyPatch) -> None:
    found, tried = looked_for(monkeypatch, 2, works=3)
    assert tried == [2]
    assert found.status == "feasible"
    assert found.reason == "no motion was found with which 2 motors drive all 6 joints"
    assert found.missed == {"motors"}


def test_the_certificate_has_the_number_that_is_asked_for_and_met(monkeypatch: pytest.MonkeyPatch) -> None:
    found, tried = looked_for(monkeypatch, 3, works=2)
    assert (tried, found.status) == ([3], "certified")
    figure = found.certificate["motors"]
    assert (figure["value"], figure["limit"], figure["holds"]) == (3.0, 3.0, True)
    met, more = (counted(with_motors(own_motors(2), motors)) for motors in (2, 4))
    assert (met.status, met.certificate["motors"]["holds"], met.reason) == ("certified", True, "")
    assert (more.status, more.missed) == ("feasible", {"motors"})
    assert more.reason == "the hand has 4 motors, the task asks for 2 (motors)"
    assert "motors" not in counted(with_motors(own_motors("fewest"), 2)).certificate


def test_of_a_small_hand_no_more_motors_are_spoken_of_than_could_share_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for joints, words in ((2, "1 motor drives all 2 joints"), (3, "2 motors or fewer drive all 3 joints")):
        found, tried = looked_for(monkeypatch, "fewest", works=9, joints=joints)
        assert tried == [n for n in range(2, joints)]
        assert found.reason == f"no motion was found with which {words}"


def test_where_none_share_joints_the_hand_is_kept_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    found, _ = looked_for(monkeypatch, "fewest", works=9)
    assert found.hand is not None
    assert (found.status, found.hand.motors) == ("certified", 6)
    assert found.reason == "no motion was found with which 4 motors or fewer drive all 6 joints"
    found, _ = looked_for(monkeypatch, 1, works=9)
    assert found.status == "feasible"
    assert found.reason == "no motion was found with which 1 motor drives all 6 joints"


@pytest.mark.parametrize("asked", ["independent", 6, 9])
def test_nothing_is_looked_for_where_every_joint_may_have_its_own(monkeypatch: pytest.MonkeyPatch, asked: Any) -> None:
    found, tried = looked_for(monkeypatch, asked, works=1)
    assert tried == []
    due = own_motors(asked)
    assert (found.status, found.reason, found.hand, found.missed) == ("certified", "", due.hand, set())
    assert ("motors" in found.certificate) == isinstance(asked, int)


def test_fewer_motors_are_better_than_fewer_drops_and_fewer_joints() -> None:
    own, shared = own_motors("fewest"), with_motors(own_motors("fewest"), 2)
    assert rank_of(replayed(shared, 1)) < rank_of(replayed(own, 0))
    assert rank_of(with_motors(own, 1)) < rank_of(shared)
    assert own.hand is not None
    fewer_joints = replace(own.hand, fingers=own.hand.fingers[:2])
    ranked = rank({0: replace(own, hand=fewer_joints), 1: shared, 2: own})
    assert [each.seed for each in ranked] == [1, 0, 2]


def test_the_summary_says_how_many_motors_drive_how_many_joints(tmp_path: Any) -> None:
    for motors, words in ((1, "1 motor drives 6 joints"), (2, "2 motors drive 6 joints")):
        lines = [str(part) for part in design_summary(with_motors(own_motors("fewest"), motors), tmp_path).renderables]  # type: ignore[attr-defined]
        assert f"motors: {words}" in lines
