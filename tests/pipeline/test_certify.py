"""The loop of certification, on made-up verdicts: which hands are tried, who gets a joint, what is returned."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from casadi_hands.export.design import Design
from casadi_hands.nlp import SolverError
from casadi_hands.pipeline import certify, halving
from casadi_hands.pipeline import refiner as refiner_module
from casadi_hands.pipeline.certify import Certifier
from casadi_hands.pipeline.margins import Margins
from casadi_hands.pipeline.record import Record
from casadi_hands.pipeline.refiner import Refiner
from casadi_hands.problem.si import build_model
from casadi_hands.problem.strength import Strength
from casadi_hands.stages.refine.result import Run, Worst
from casadi_hands.stages.refine.values import Margin
from casadi_hands.stages.synthesis.algorithm import Candidate, Found
from casadi_hands.task import parse_task
from casadi_hands.verify.report import Audit, Figure
from tests.pipeline.replayed import OF, replayed
from tests.stages.example import made_up_solution
from tests.stages.synthesis.example import ball_target, ball_task, hand, pointing

AMPLE, FIRMER, LARGE = Margin(), Margin(normal_force=2.0), Margin(normal_force=4.0)
LOOSER, SOFT = Margin(0.6, 0.6), Margin(0.65, 0.3)
Verdict = tuple[
    int, tuple[int, ...], bool
]  # limits missed, contacts that cannot meet them, whether it slips hopelessly


def found(*joints: tuple[int, int], farthest: float = 0.0) -> Found:
    """Hands of a round, best first; told apart by their trial."""
    target = ball_target()
    candidates = []
    for trial, (left, right) in enumerate(joints):
        fingers = [pointing(target, 0, [[1, 0, 0]] * left), pointing(target, 1, [[1, 0, 0]] * right)]
        candidates.append(Candidate(hand(fingers, (0, 1)), (0.0, 0.0), trial))
    return Found(tuple(candidates), farthest, ())


class Loop(Certifier):
    """Verdicts are given; the search returns one hand with the joints it is asked for.

    Attributes:
        moved: trials of the hands whose motion was looked for.
        tried: joints of those that were refined.
        taken_up: trials of those that had been put off.
        crossing: trials of hands whose fingers pass through each other.
        breaks: trial of the hand whose motion breaks off.
    """

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, verdicts: list[Verdict], max_joints: int, crossing: Sequence[int] = ()
    ) -> None:
        search: Any = SimpleNamespace(max_joints=max_joints)
        judge: Any = SimpleNamespace(judge=lambda design, causes: replace(design, status="failed", reason="far"))
        floating: Any = None
        task = ball_task()
        super().__init__(Record(task, None, lambda _: None), build_model(task), floating, search, judge, 1)
        self.verdicts, self.crossing, self.breaks = verdicts, crossing, -1
        self.moved: list[int] = []
        self.tried: list[tuple[int, ...]] = []
        self.taken_up: list[int] = []
        self.least: list[dict[int, int]] = []
        self.dropped = [0] * len(verdicts)
        self.refiner: Any = SimpleNamespace(certify=self._verdict)
        monkeypatch.setattr(certify, "run_search", self._search)
        monkeypatch.setattr(certify, "run_whole_hand", self._whole)
        monkeypatch.setattr(certify, "take_up", lambda record, model, whole: self.taken_up.append(whole.trial))
        monkeypatch.setattr(certify, "pass_through", lambda structure, whole, times: whole.trial in self.crossing)

    def _search(self, *arguments: Any) -> Found:
        self.least.append(arguments[-1])
        return found((arguments[-1][0], arguments[-1][1]))

    def _whole(self, record: Record, model: Any, floating: Any, candidate: Candidate) -> Any:
        if candidate.trial == self.breaks:
            raise SolverError("it broke off")
        self.moved.append(candidate.trial)
        active = np.ones((len(self.model.schedule.samples), 2), bool)
        return SimpleNamespace(contacts=(0, 1), active=active, joints=candidate.joints, trial=candidate.trial)

    def _verdict(self, whole: Any, short: Any, margin: Any, homotopy: float, thorough: bool) -> tuple[Design, Any]:
        assert (margin, homotopy, thorough) == (None, 1.0, True)
        missed, contacts, slips = self.verdicts[len(self.tried)]
        self.tried.append(whole.joints)
        refined = SimpleNamespace(
            met=False,
            slips_hopelessly=slips,
            barely_rolls=slips,
            slips={"left": 1.0, "right": 0.1},
            worst=Worst("some.constraint", 1.0, None, contacts),
            homotopy=1.0,
        )
        self.record.add_runs([{"stage": "refine", "what": len(self.tried)}])
        certificate = {str(i): {"holds": i >= missed} for i in range(9)}
        status = "failed" if missed else "certified"
        words = f"attempt {len(self.tried)}"
        judged = replace(self.record.design, status=status, reason=words, certificate=certificate)
        return judged if missed else replayed(judged, self.dropped[len(self.tried) - 1]), refined


def test_the_first_certified_hand_is_returned(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = Loop(monkeypatch, [(2, (), False), (0, (), False)], max_joints=3)
    assert loop.run(found((1, 1), (1, 1), (1, 1))).status == "certified"
    assert loop.tried == [(1, 1), (1, 1)]


def test_hands_whose_fingers_pass_through_each_other_are_tried_last(monkeypatch: pytest.MonkeyPatch) -> None:
    hands = found((1, 1), (2, 1), (1, 2))
    loop = Loop(monkeypatch, [(0, (), False)], max_joints=3, crossing=(0, 1))
    assert loop.run(hands).status == "certified"
    assert (loop.tried, loop.moved, loop.taken_up) == ([(1, 2)], [0, 1, 2], [])
    # Where none that is clear is certified, they are, with the motions that they had; and not where all are clear.
    loop = Loop(monkeypatch, [(1, (), False), (1, (), False), (0, (), False)], max_joints=1, crossing=(0, 1))
    assert loop.run(hands).reason == "attempt 3"
    assert (loop.tried, loop.moved, loop.taken_up) == ([(1, 2), (1, 1), (2, 1)], [0, 1, 2], [0, 1])
    loop = Loop(monkeypatch, [(0, (), False)], max_joints=3)
    assert loop.run(hands).status == "certified"
    assert (loop.tried, loop.moved) == ([(1, 1)], [0])
    # Nor is one lost where the solver breaks off after it was put off.
    loop = Loop(monkeypatch, [(1, (), False)], max_joints=1, crossing=(0,))
    loop.breaks = 1
    with pytest.raises(SolverError):
        loop.run(hands)
    assert (loop.tried, loop.moved) == ([(1, 1)], [0])


def test_a_certified_hand_that_drops_the_object_makes_way_for_one_that_drops_it_less(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cases = (([12, 0], 2, 2), ([12, 5, 6], 2, 3), ([5, 12, 13], 1, 3), ([2, 0], 2, 2), ([1, 0], 1, 1))
    for dropped, best, tried in (*cases, ([12, 7, 3], 3, 3), ([12, 7, 8], 2, 3), ([8, 6, 0], 3, 3)):
        loop = Loop(monkeypatch, 3 * [(0, (), False)], max_joints=1)
        loop.dropped = dropped
        assert loop.run(found((1, 1), (1, 1), (1, 1))).reason == f"attempt {best}"
        assert len(loop.tried) == tried
    assert loop.least == []


def test_where_hands_drop_the_object_fingers_get_another_joint(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = Loop(monkeypatch, 3 * [(0, (), False)], max_joints=2)
    loop.dropped = [20, 12, 1]
    assert loop.run(found((1, 1), (1, 1), (1, 1))).reason == "attempt 3"
    assert loop.tried == [(1, 1), (1, 1), (2, 2)]


def test_the_finger_that_failed_gets_a_joint_then_the_others_until_none_may(monkeypatch: pytest.MonkeyPatch) -> None:
    verdicts = [(3, (1,), False), (4, (1,), False), (1, (1,), False)]
    loop = Loop(monkeypatch, [*verdicts, *3 * [(2, (1,), False)]], max_joints=3)
    design = loop.run(found((1, 1), (1, 1)))
    assert loop.tried == [(1, 1), (1, 1), (1, 2), (1, 3), (2, 3), (3, 3)]
    assert loop.least == [{0: 1, 1: 2}, {0: 1, 1: 3}, {0: 2, 1: 3}, {0: 3, 1: 3}]
    # The third attempt missed fewest limits; others were made after it, and their runs and time are the design's too.
    assert design.reason == "attempt 3"
    assert [run["what"] for run in loop.record.complete(design).stages] == [1, 2, 3, 4, 5, 6]


def test_all_hands_are_tried_where_no_finger_may_have_another_joint(monkeypatch: pytest.MonkeyPatch) -> None:
    verdicts = 3 * [(1, (1,), False)]
    loop = Loop(monkeypatch, [*verdicts, (0, (), False)], max_joints=1)
    assert loop.run(found((1, 1), (1, 1), (1, 1), (1, 1))).status == "certified"
    loop = Loop(monkeypatch, [*verdicts, (1, (1,), False)], max_joints=2)
    loop.run(found((1, 1), (1, 1), (1, 1), (1, 1)))
    assert loop.tried == [(1, 1), (1, 1), (1, 2), (2, 2)]
    assert loop.moved == [0, 1, 0, 0]  # and no motion is looked for that is not refined


def test_where_no_finger_is_to_blame_those_with_fewest_joints_get_one(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = Loop(monkeypatch, [(1, (), False), (0, (), False)], max_joints=3)
    assert loop.run(found((2, 1))).status == "certified"
    assert loop.least == [{0: 2, 1: 2}]


def test_a_structure_that_must_slip_is_tried_once(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = Loop(monkeypatch, [(1, (0,), True), (0, (), False)], max_joints=3)
    assert loop.run(found((1, 1), (1, 1))).status == "certified"
    assert loop.least == [{0: 2, 1: 1}]
    # Where joints could follow, another hand of the same structure may.
    loop = Loop(monkeypatch, [(1, (0,), True), (0, (), False)], max_joints=3)
    assert loop.run(found((2, 2), (2, 2))).status == "certified"
    assert loop.tried == [(2, 2), (2, 2)]


def test_a_hand_far_from_its_contacts_is_not_refined(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = Loop(monkeypatch, [], max_joints=3)
    assert loop.run(found((1, 1), farthest=0.31)).reason == "far"
    assert loop.moved == [0]
    assert loop.tried == []


def test_a_design_there_is_already_is_returned_where_no_hand_is_better(monkeypatch: pytest.MonkeyPatch) -> None:
    # Limits missed and replays dropped by that design and by the two hands, and which of them is best.
    cases = (((2, 0), (2, 3), 0), ((2, 0), (3, 1), 2), ((0, 4), (1, 2), 0), ((0, 4), (0, 0), 1))
    for known, (first, second), best in cases:
        loop = Loop(monkeypatch, [(first, (1,), False), (second, (1,), False)], max_joints=1)
        loop.dropped = [0, 0]
        status = "failed" if known[0] else "certified"
        certificate = {str(i): {"holds": i >= known[0]} for i in range(9)}
        judged = replace(loop.record.design, status=status, reason="attempt 0", certificate=certificate)
        loop.record.update_best(judged if known[0] else replayed(judged, known[1]))
        design = loop.run(found((1, 1), (1, 1)))
        assert design.reason == f"attempt {best}"


def test_a_design_there_is_already_is_better_than_a_hand_far_from_its_contacts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    loop = Loop(monkeypatch, [], max_joints=3)
    known = replayed(replace(loop.record.design, status="certified", reason="known"), 0)
    loop.record.update_best(known)
    assert loop.run(found((1, 1), farthest=0.31)).reason == "known"


def test_what_a_firmer_grip_changes_is_told_from_the_hand_before_any_refinement(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole, exact, solution = object(), object(), made_up_solution({})
    firm = SimpleNamespace(solution=solution)
    asked: list[Any] = []

    def solve(start: object, margin: Margin, near: bool) -> Any:
        asked.append((start, margin, near))
        other = Run("firm", made_up_solution({}), AMPLE)
        return SimpleNamespace(hand=firm, runs=(other, Run("exact", solution, LARGE), other))

    told: Any = {}
    monkeypatch.setattr(refiner_module, "design_change", lambda _, before, after: {"from": before, "to": after})
    record = Record(ball_task(), None, lambda _: None)
    Refiner(record, told, told, 1)._attempt(whole, LARGE, partial(solve, exact, near=True))  # type: ignore[arg-type]
    assert asked == [(exact, LARGE, True)]
    changes = [run.get("design_change") for run in record.design.stages]
    assert changes == [None, {"from": whole, "to": firm}, None]
    # Each solve is told with the margin that it kept, whatever was asked for at first.
    assert [run["what"].split("friction and ")[1] for run in record.design.stages] == [
        "1 weights of normal force",
        "4 weights of normal force",
        "1 weights of normal force",
    ]


@pytest.mark.parametrize(
    ("missed", "passes", "again"), [("slip", False, 2), ("goal_angle", False, 0), ("penetration", True, 0)]
)
def test_what_is_missed_only_between_samples_gets_more_of_them(
    monkeypatch: pytest.MonkeyPatch, missed: str, passes: bool, again: int
) -> None:
    model = build_model(ball_task())
    tried: list[Any] = []

    class Once:
        """Every motion is exact, and certified once two intervals beside the first were halved twice."""

        contacts, joints = (0, 1), (1, 1)

        def __init__(self, model: Any, *_: Any) -> None:
            self.model = model

        def renew(self, start: Any, sharpness: int, margin: Margin) -> Any:
            assert sharpness == 0
            tried.append(self.model.schedule.samples)
            told = {"runs": (), "weights": {}, "margin": margin, "sharpness": 0}
            return SimpleNamespace(exact=True, barely_rolls=False, hand=start, **told)

        def solve(self, start: Any, margin: Margin, near: bool) -> Any:
            return self.renew(start, 0, margin)

        def passes_through(self, refined: Any) -> bool:
            return passes

    def judged(self: Refiner, model: Any, *_: Any) -> Design:
        fine = np.diff(model.schedule.samples)[0] < 0.03
        figure = {"holds": fine, "value": 0.0 if fine else 4.0 / len(tried), "limit": 1.0}
        return replace(self.record.design, status="certified" if fine else "feasible", certificate={missed: figure})

    def audited(design: Design) -> Any:
        parts = np.zeros(len(tried[-1]) - 1)
        parts[0] = 4.0 / len(tried)
        parts = parts if missed != "slip" else parts[None]
        kept = {name: Figure(name, 0.0, 1.0, "m", "") for name in halving.BETWEEN}
        return SimpleNamespace(figures={**kept, missed: Figure(missed, parts.sum(), 1.0, "m", "", by_interval=parts)})

    monkeypatch.setattr(refiner_module, "margins_for", lambda *_: Margins(AMPLE, LARGE, FIRMER, LOOSER, SOFT))
    monkeypatch.setattr(refiner_module, "Continuation", Once)
    monkeypatch.setattr(Refiner, "_with_margin", lambda *_: SimpleNamespace(exact=False))  # no grip is any better
    monkeypatch.setattr(refiner_module, "resampled", lambda hand, before, after: hand)
    monkeypatch.setattr(Refiner, "_attempt", lambda self, whole, margin, refine: refine(margin=margin))
    monkeypatch.setattr(Refiner, "_judged", judged)
    monkeypatch.setattr(Refiner, "_replayed", lambda self, design: design)
    judge: Any = SimpleNamespace(audited=audited)
    whole: Any = SimpleNamespace(contacts=(0, 1), fingers=(), active=None)
    design, _ = Refiner(Record(ball_task(), None, lambda _: None), model, judge, 1).certify(whole, ())
    assert [len(samples) - len(tried[0]) for samples in tried] == [0, 2, 4][: 1 + again]
    assert design.status == ("certified" if again else "feasible")


class Ways:
    """A continuation whose refinements are all exact; ``asked`` has their names and margins.

    Args:
        firm: whether a long way is gone with the firm grip.
    """

    contacts, joints, active, model = (0, 1), (1, 1), None, None
    exact = True  # with what links bear as a limit, too
    sharpest: int = 1
    blunt: tuple[Margin, ...] = ()  # margins with which no sharpened motion is exact

    def __init__(self, firm: bool) -> None:
        self.firm, self.passes = firm, False
        self.asked: list[tuple[str, Margin]] = []
        self.models: list[Any] = []

    def of(self, model: Any) -> Ways:
        """One for a model, with the same records."""
        self.models.append(model)
        made = copy.copy(self)
        made.model = model
        return made

    def taken(self, name: str, margin: Margin) -> Any:
        self.asked.append((name, margin))
        exact = self.exact or self.model.strength is None
        hand = SimpleNamespace(active=None)
        taken = SimpleNamespace(exact=exact, barely_rolls=False, hand=hand, runs=(), weights={}, margin=margin)
        taken.sharpness = 0
        return taken

    def solve(self, start: Any, margin: Margin, near: bool) -> Any:
        return self.taken("solve", margin)

    def continue_from(self, start: Any, homotopy: float, margin: Margin, larger: Margin) -> Any:
        assert (homotopy, margin, larger) == (0.5, AMPLE, LARGE)
        return self.taken("continue_from", larger if self.firm else margin)

    def sharpened(self, exact: Any, sharpness: int, margin: Margin) -> Any:
        sharp = self.taken("sharpened" if sharpness == 1 else f"sharpened to {sharpness}", margin)
        sharp.sharpness, sharp.exact = sharpness, margin not in self.blunt
        return sharp

    def with_margin(self, exact: Any, margin: Margin) -> Any:
        return self.taken("with_margin", margin)

    def renew(self, start: Any, sharpness: int, margin: Margin) -> Any:
        return self.taken("renew", margin)

    def passes_through(self, refined: Any) -> bool:
        return self.passes


def refine(
    monkeypatch: pytest.MonkeyPatch,
    ways: Ways,
    homotopy: float,
    statuses: list[str],
    drops: list[int],
    stiffness: float = 0.1,
    angle: float = 1.0,
    soft: bool = False,
    torque: float | None = None,
    angles: Sequence[float] = (),
    missed: Sequence[str] = (),
    off: list[float] | None = None,
    thorough: bool = True,
) -> tuple[Margin, int]:
    """The margin of what is kept and its drops, where designs and drops are judged as told, in this order.

    Of each the grasp asks for a stiffness, N·m/rad, and a share of the motors' torque, if they have one, and the replay
    as planned ends at an angle, degrees, off a goal: the same of all, or one of each. Designs that are not certified
    miss the limits of what is told. ``off`` gets the angle of what is kept.
    """
    judged, dropped = iter(statuses), iter(drops)
    turned = iter(angles or [angle] * len(drops))
    monkeypatch.setattr(refiner_module, "margins_for", lambda *_: Margins(AMPLE, LARGE, FIRMER, LOOSER, SOFT))
    monkeypatch.setattr(refiner_module, "Continuation", lambda model, *_: ways.of(model))
    monkeypatch.setattr(Refiner, "_attempt", lambda self, whole, margin, refine: refine(margin=margin))
    measured: dict[str, dict[str, Any]] = {
        "least_stiffness": {"value": stiffness, "limit": 1.0, "holds": stiffness <= 1.0}
    }
    unit = {"value": 0.9, "unit": "N·m"} if torque is None else {"value": torque, "unit": "share"}
    measured["torque"] = {"limit": 1.0, "holds": True, **unit}

    def judge(self: Refiner, *_: Any) -> Design:
        status, over = next(judged), {"value": 2.0, "limit": 1.0, "holds": False}
        missing = {} if status == "certified" else dict.fromkeys(missed, over)
        return replace(self.record.design, status=status, certificate=measured | missing)

    def played(self: Refiner, design: Design) -> Design:
        if design.status != "certified":
            return design
        far = next(turned)
        told = {"replay_angle": {"value": far, "limit": 5.0, "holds": far <= 5}}
        seen = replayed(replace(design, certificate=measured | told), next(dropped))
        return seen if far <= 5 else replace(seen, status="feasible")

    monkeypatch.setattr(Refiner, "_judged", judge)

    monkeypatch.setattr(Refiner, "_replayed", played)
    whole: Any = SimpleNamespace(contacts=(0, 1), fingers=(), active=None)
    record, judging = Record(ball_task(), None, lambda _: None), SimpleNamespace(audited=lambda _: None)
    model = replace(build_model(ball_task()), torsion=float(soft))
    refiner = Refiner(record, model, judging, 1)  # type: ignore[arg-type]
    design, refined = refiner.certify(whole, (), homotopy=homotopy, thorough=thorough)
    assert (next(judged, None), next(dropped, None)) == (None, None)
    if off is not None:
        off.append(design.replay_angle)
    return refined.margin, design.drops or 0


@pytest.mark.parametrize("homotopy", [1.0, 0.5])
@pytest.mark.parametrize(
    ("drops", "kept"),
    [([4, 1], LARGE), ([4, 3], LARGE), ([1, 0], LARGE), ([4, 4], AMPLE), ([0], AMPLE)],
)
def test_a_firmer_grip_is_tried_where_replays_drop_and_kept_where_they_drop_less(
    monkeypatch: pytest.MonkeyPatch, homotopy: float, drops: list[int], kept: Margin
) -> None:
    ways = Ways(firm=False)
    assert refine(monkeypatch, ways, homotopy, ["certified"] * len(drops), drops) == (kept, min(drops))
    first = ("solve" if homotopy == 1 else "continue_from", AMPLE)
    assert ways.asked == [first, *[("with_margin", LARGE)] * (len(drops) - 1)]


def test_where_a_hand_is_one_of_several_that_may_do_no_other_grip_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    ways = Ways(firm=False)
    assert refine(monkeypatch, ways, 1.0, ["certified"], [4], thorough=False) == (AMPLE, 4)
    assert ways.asked == [("solve", AMPLE)]
    # One that is certified may grip better.
    ways = Ways(firm=False)
    assert refine(monkeypatch, ways, 1.0, ["certified"] * 2, [1, 0], thorough=False) == (LARGE, 0)


@pytest.mark.parametrize("thorough", [True, False])
def test_little_is_tried_of_a_hand_that_would_only_take_anothers_place(
    monkeypatch: pytest.MonkeyPatch, thorough: bool
) -> None:
    ways = Ways(firm=False)
    judged = ["feasible"] * (2 if thorough else 1)
    assert refine(monkeypatch, ways, 1.0, judged, [], missed=["least_stiffness"], thorough=thorough) == (AMPLE, 0)
    assert ways.asked == [("solve", AMPLE), ("with_margin", SOFT)][: len(judged)]


@pytest.mark.parametrize("thorough", [True, False])
def test_of_such_a_hand_intervals_are_halved_once(monkeypatch: pytest.MonkeyPatch, thorough: bool) -> None:
    left = iter([True, True, True, False])
    monkeypatch.setattr(refiner_module, "intervals_to_halve", lambda *_: np.full(6, next(left)))
    monkeypatch.setattr(refiner_module, "resampled_model", lambda model, _: model)
    monkeypatch.setattr(refiner_module, "resampled", lambda hand, *_: hand)
    monkeypatch.setattr(refiner_module, "GAIN", 2.0)  # each halving is a gain
    ways = Ways(firm=False)
    if thorough:
        refine(monkeypatch, ways, 1.0, [*["feasible"] * 4, "certified"], [0], missed=["residual"])
        assert [name for name, _ in ways.asked] == ["solve", *["renew"] * 3, "with_margin"]
    else:
        refine(monkeypatch, ways, 1.0, ["feasible"] * 2, [], missed=["residual"], thorough=False)
        assert [name for name, _ in ways.asked] == ["solve", "renew"]


@pytest.mark.parametrize("missed", [["tip_deflection"], ["tip_deflection", "least_stiffness"]])
def test_what_links_bear_is_a_limit_only_where_nothing_else_is_in_the_way(
    monkeypatch: pytest.MonkeyPatch, missed: list[str]
) -> None:
    ways = Ways(firm=False)
    refine(monkeypatch, ways, 1.0, ["feasible"] * 2, [], missed=missed, thorough=False)
    assert [name for name, _ in ways.asked] == ["solve", "with_margin"]
    ways = Ways(firm=False)
    refine(monkeypatch, ways, 1.0, ["feasible"], [], missed=[*missed, "friction"], thorough=False)
    assert [name for name, _ in ways.asked] == ["solve"]


@pytest.mark.parametrize(("drops", "kept"), [([4, 3], SOFT), ([4, 4], AMPLE), ([0], AMPLE)])
def test_a_softer_grip_is_tried_instead_where_joints_are_hardly_stiff_enough(
    monkeypatch: pytest.MonkeyPatch, drops: list[int], kept: Margin
) -> None:
    ways = Ways(firm=False)
    statuses = ["certified"] * len(drops)
    assert refine(monkeypatch, ways, 1.0, statuses, drops, stiffness=0.4) == (kept, min(drops))
    assert ways.asked == [("solve", AMPLE), *[("with_margin", SOFT)] * (len(drops) - 1)]


@pytest.mark.parametrize(("drops", "kept"), [([4, 2], FIRMER), ([4, 4], AMPLE)])
def test_a_little_firmer_grip_is_tried_where_hands_cannot_grip_so_firmly(
    monkeypatch: pytest.MonkeyPatch, drops: list[int], kept: Margin
) -> None:
    ways = Ways(firm=False)
    assert refine(monkeypatch, ways, 1.0, ["certified", "feasible", "certified"], drops) == (kept, min(drops))
    assert ways.asked == [("solve", AMPLE), ("with_margin", LARGE), ("with_margin", FIRMER)]


@pytest.mark.parametrize(
    ("drops", "kept"), [([4, 2, 1], LOOSER), ([4, 2, 3], SOFT), ([2, 2, 1], LOOSER), ([4, 3], SOFT), ([2, 1], SOFT)]
)
def test_where_hardly_too_many_replays_drop_a_grip_in_between_is_tried(
    monkeypatch: pytest.MonkeyPatch, drops: list[int], kept: Margin
) -> None:
    """Two of twenty are nearly as few as the one that may."""
    ways = Ways(firm=False)
    tried = [SOFT, LOOSER][: len(drops) - 1]
    assert refine(monkeypatch, ways, 1.0, ["certified"] * len(drops), drops, stiffness=0.4) == (kept, min(drops))
    assert ways.asked == [("solve", AMPLE), *(("with_margin", margin) for margin in tried)]


@pytest.mark.parametrize(
    ("stiffness", "tried"), [(0.1, [LARGE, LOOSER]), (0.4, [SOFT, FIRMER])], ids=["firmer", "softer"]
)
@pytest.mark.parametrize(("drops", "kept"), [([2, 3, 1], 1), ([4, 5, 2], 1), ([2, 5, 4], None), ([4, 5, 6], None)])
def test_where_a_grip_drops_the_object_more_often_one_the_other_way_is_tried(
    monkeypatch: pytest.MonkeyPatch, drops: list[int], kept: int | None, stiffness: float, tried: list[Margin]
) -> None:
    ways = Ways(firm=False)
    margin, left = refine(monkeypatch, ways, 1.0, ["certified"] * 3, drops, stiffness=stiffness)
    assert (margin, left) == (AMPLE if kept is None else tried[kept], min(drops))
    assert ways.asked == [("solve", AMPLE), *(("with_margin", each) for each in tried)]


@pytest.mark.parametrize(
    ("drops", "angles", "due"),
    [
        ([4, 0, 1], [1.0, 6.0, 2.0], [LARGE, FIRMER]),
        ([4, 4], [1.0, 6.0], [LARGE]),
    ],
)
def test_a_grip_in_between_is_tried_where_each_keeps_what_the_other_misses(
    monkeypatch: pytest.MonkeyPatch, drops: list[int], angles: list[float], due: list[Margin]
) -> None:
    ways = Ways(firm=False)
    kept, left = refine(monkeypatch, ways, 1.0, ["certified"] * len(drops), drops, angles=angles)
    assert ways.asked == [("solve", AMPLE), *(("with_margin", margin) for margin in due)]
    assert (kept, left) == ((FIRMER, 1) if FIRMER in due else (AMPLE, 4))


@pytest.mark.parametrize("missed", ["bearing_moment", "link_stress", "tip_deflection"])
@pytest.mark.parametrize(
    ("exact", "statuses", "due"),
    [
        (True, ["feasible", "certified"], [AMPLE]),
        # Else with a softer grip, which asks less of them; also within what they bear.
        (True, ["feasible", "feasible", "certified"], [AMPLE, SOFT]),
        (True, ["feasible", "feasible", "feasible", "certified"], [AMPLE, SOFT, SOFT]),
        # What is not exact is not judged.
        (False, ["feasible", "certified"], [AMPLE, SOFT]),
    ],
)
def test_where_links_bear_too_much_what_they_bear_is_a_limit(
    monkeypatch: pytest.MonkeyPatch, missed: str, exact: bool, statuses: list[str], due: list[Margin]
) -> None:
    ways = Ways(firm=False)
    ways.exact = exact
    kept, _ = refine(monkeypatch, ways, 1.0, statuses, [0], missed=[missed])
    assert ways.asked == [("solve", AMPLE), *(("with_margin", margin) for margin in due)]
    assert kept == due[-1]
    first, *held = ways.models
    assert first.strength is None
    assert held[0].strength == Strength.of(ball_task(), first.units)


def test_a_softer_grip_is_tried_where_a_plan_takes_more_torque_than_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    ways = Ways(firm=False)
    refine(monkeypatch, ways, 1.0, ["feasible", "certified"], [0], missed=["torque"])
    assert ways.asked == [("solve", AMPLE), ("with_margin", SOFT)]


@pytest.mark.parametrize(("torque", "kept"), [(0.9, SOFT), (0.7, LARGE), (None, LARGE)])
def test_a_softer_grip_is_tried_instead_where_motors_are_hardly_strong_enough(
    monkeypatch: pytest.MonkeyPatch, torque: float | None, kept: Margin
) -> None:
    ways = Ways(firm=False)
    assert refine(monkeypatch, ways, 1.0, ["certified"] * 2, [4, 1], torque=torque) == (kept, 1)
    assert ways.asked == [("solve", AMPLE), ("with_margin", kept)]


@pytest.mark.parametrize(
    ("rolls", "slides", "due", "kept"),
    [
        (0.0, 0.0, ["roll"], "roll"),
        (0.2, 0.0, ["roll", "slide"], "slide"),
        (0.2, 0.1, ["roll", "slide", "slide"], "slide"),
        (0.1, 0.2, ["roll", "slide", "slide"], "roll"),
    ],
)
def test_contacts_that_may_slide_do_so_only_where_no_motion_is_exact_with_which_they_roll(
    monkeypatch: pytest.MonkeyPatch, rolls: float, slides: float, due: list[str], kept: str
) -> None:
    """What is missed least is kept; a motion is exact that misses nothing."""
    tried: list[str] = []

    class Either:
        """A continuation whose contacts roll or slide, and miss what is told."""

        contacts, joints = (0, 1), (1, 1)

        def __init__(self, model: Any, *_: Any) -> None:
            self.model = model

        def solve(self, start: Any, margin: Margin, near: bool = False) -> Any:
            tried.append("slide" if self.model.sliding else "roll")
            missed = slides if self.model.sliding else rolls
            less = partial(lambda missed, other: missed < other.missed, missed)
            return SimpleNamespace(
                exact=not missed, missed=missed, barely_rolls=False, margin=margin, misses_less_than=less
            )

    monkeypatch.setattr(refiner_module, "Continuation", Either)
    monkeypatch.setattr(Refiner, "_attempt", lambda self, whole, margin, refine: refine(margin=margin))
    unused: Any = SimpleNamespace()
    whole: Any = SimpleNamespace(contacts=(0, 1), fingers=(), active=None)
    record = Record(ball_task(), None, lambda _: None)
    refiner = Refiner(record, replace(build_model(ball_task()), sliding=0.1), unused, 1)
    refined: Any
    refined, stage = refiner._exact(whole, AMPLE, False, 1.0, LARGE)
    assert tried == due
    assert (refined.missed, bool(stage.model.sliding)) == ((slides, True) if kept == "slide" else (rolls, False))


def test_another_grip_is_tried_where_the_replay_as_planned_ends_off_its_goals(monkeypatch: pytest.MonkeyPatch) -> None:
    ways = Ways(firm=False)
    refine(monkeypatch, ways, 1.0, ["certified"] * 2, [0, 0], angle=4.0)
    assert ways.asked == [("solve", AMPLE), ("with_margin", LARGE)]
    # Soft fingertips first resist slow spins in full.
    ways = Ways(firm=False)
    refine(monkeypatch, ways, 1.0, ["certified"] * 3, [0, 0, 0], angle=4.0, soft=True)
    assert ways.asked == [("solve", AMPLE), ("sharpened", AMPLE), ("with_margin", LARGE)]


@pytest.mark.parametrize(
    ("angles", "kept"), [([9.0, 2.0], 2.0), ([9.0, 8.0, 2.0], 2.0), ([9.0, 7.0, 4.5], 4.5), ([9.0, 4.0], 4.0)]
)
def test_slower_and_slower_spins_are_resisted_until_the_replay_keeps_its_goals(
    monkeypatch: pytest.MonkeyPatch, angles: list[float], kept: float
) -> None:
    ways, off = Ways(firm=False), list[float]()
    ways.sharpest = 2
    # A firmer grip, with spins resisted likewise, is no better.
    more = [4.5] if kept > 3 else []
    count = len(angles) + len(more)
    refine(monkeypatch, ways, 1.0, ["certified"] * count, [0] * count, angles=[*angles, *more], soft=True, off=off)
    assert off == [kept]
    sharper = [("sharpened", AMPLE), ("sharpened to 2", AMPLE)][: len(angles) - 1]
    again = [("with_margin", LARGE), *((name, LARGE) for name, _ in sharper)]
    assert ways.asked == [("solve", AMPLE), *sharper, *(again if more else [])]


def test_where_the_replay_as_planned_drops_another_grip_comes_before_spins(monkeypatch: pytest.MonkeyPatch) -> None:
    ways = Ways(firm=False)
    refine(monkeypatch, ways, 1.0, ["certified"] * 3, [OF, 0, 0], angles=[40.0, 9.0, 2.0], soft=True)
    assert ways.asked == [("solve", AMPLE), ("with_margin", LARGE), ("sharpened", LARGE)]


def test_spins_are_resisted_as_far_as_motions_are_exact(monkeypatch: pytest.MonkeyPatch) -> None:
    ways, off = Ways(firm=False), list[float]()
    ways.sharpest, ways.blunt = 2, (AMPLE,)
    statuses = ["certified", "feasible", "certified"]
    refine(monkeypatch, ways, 1.0, statuses, [0, 0], angles=[9.0, 2.0], soft=True, off=off)
    assert off == [2.0]
    assert ways.asked == [("solve", AMPLE), ("sharpened", AMPLE), ("with_margin", LARGE)]
    # With another grip as they were, if that is exact.
    ways, off = Ways(firm=False), []
    ways.blunt = (LARGE,)
    refine(monkeypatch, ways, 1.0, ["certified"] * 3, [0] * 3, angles=[9.0, 4.0, 2.0], soft=True, off=off)
    assert off == [2.0]
    assert ways.asked == [("solve", AMPLE), ("sharpened", AMPLE), ("with_margin", LARGE), ("sharpened", LARGE)]


@pytest.mark.parametrize(("angle", "kept"), [(2.0, 2.0), (8.0, 8.0), (10.0, 9.0)])
def test_where_a_firmer_grip_turns_the_object_it_is_taken_with_slow_spins_resisted(
    monkeypatch: pytest.MonkeyPatch, angle: float, kept: float
) -> None:
    ways = Ways(firm=False)
    angles, drops = [2.0, 9.0, angle], [4, 1, 1]
    if angle > 5:  # one in between is tried, as each keeps what the other misses
        angles, drops = [*angles, 6.0, 6.0], [*drops, 4, 4]
    off: list[float] = []
    statuses = ["certified"] * len(drops)
    assert refine(monkeypatch, ways, 1.0, statuses, drops, angles=angles, soft=True, off=off) == (LARGE, 1)
    assert off == [kept]
    tried = [("with_margin", LARGE), ("sharpened", LARGE), ("with_margin", FIRMER), ("sharpened", FIRMER)]
    assert ways.asked == [("solve", AMPLE), *tried[: len(drops) - 1]]


def test_a_long_way_is_gone_with_a_firm_grip_at_once_where_it_can_be(monkeypatch: pytest.MonkeyPatch) -> None:
    ways = Ways(firm=True)
    assert refine(monkeypatch, ways, 0.5, ["certified"], [4]) == (LARGE, 4)
    assert ways.asked == [("continue_from", LARGE)]


@pytest.mark.parametrize(
    ("statuses", "drops", "kept"),
    [
        (["feasible", "certified"], [0], AMPLE),
        (["feasible", "certified", "certified"], [4, 4], AMPLE),
        (["feasible", "feasible"], [], LARGE),
    ],
)
def test_where_the_audit_refuses_a_firm_grip_over_a_long_way_the_looser_one_is_judged(
    monkeypatch: pytest.MonkeyPatch, statuses: list[str], drops: list[int], kept: Margin
) -> None:
    ways = Ways(firm=True)
    margin, _ = refine(monkeypatch, ways, 0.5, statuses, drops)
    assert margin == kept
    assert ways.asked[:2] == [("continue_from", LARGE), ("with_margin", AMPLE)]


@pytest.mark.parametrize(("second", "kept"), [("certified", LARGE), ("feasible", AMPLE)])
def test_where_the_audit_refuses_an_exact_motion_a_firmer_grip_is_judged(
    monkeypatch: pytest.MonkeyPatch, second: str, kept: Margin
) -> None:
    ways = Ways(firm=False)
    drops = [0] if second == "certified" else []
    assert refine(monkeypatch, ways, 1.0, ["feasible", second], drops) == (kept, 0)
    assert ways.asked == [("solve", AMPLE), ("with_margin", LARGE)]


def test_where_joints_are_not_stiff_enough_for_an_exact_motion_a_softer_grip_is_judged(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ways = Ways(firm=False)
    assert refine(monkeypatch, ways, 1.0, ["feasible", "certified"], [0], stiffness=1.5) == (SOFT, 0)
    assert ways.asked == [("solve", AMPLE), ("with_margin", SOFT)]


def test_where_fingers_pass_through_each_other_no_other_grip_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    ways = Ways(firm=False)
    ways.passes = True
    assert refine(monkeypatch, ways, 1.0, ["feasible"], []) == (AMPLE, 0)
    assert ways.asked == [("solve", AMPLE)]


def test_intervals_that_use_up_a_limit_and_their_neighbours_are_halved() -> None:
    figures = {name: Figure(name, 0.0, 1.0, "m", "", by_interval=np.zeros(8)) for name in halving.BETWEEN}
    lengths = np.full(8, 0.1)

    def marked(name: str, *parts: list[float]) -> list[int]:
        value = max(map(sum, parts)) if name == "slip" else max(parts[0])
        figure = Figure(name, value, 1.0, "m", "", by_interval=np.array(parts if name == "slip" else parts[0]))
        found = halving.intervals_to_halve(Audit("", {**figures, name: figure}, ()), lengths)
        return np.flatnonzero(found).tolist()

    assert marked("penetration", [0, 0, 1.5, 0, 0, 0, 0.8, 0.6]) == [1, 2, 3, 5, 6, 7]
    assert marked("penetration", [0.9, 0.9, 0.9, 0, 0, 0, 0, 0]) == []  # the limit is kept
    # One interval halved leaves 0.1 + 0.5 of the limit; of eight that slip alike, six must be.
    assert marked("slip", [0, 0.8, 0, 0, 0.5, 0, 0, 0]) == [0, 1, 2]
    assert marked("slip", [0.2] * 8) == [0, 1, 2, 3, 4, 5, 6]
    # Every contact that slips too far has its own.
    assert marked("slip", [0, 1.2, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0, 0, 1.1]) == [0, 1, 2, 6, 7]
    assert marked("slip", [0, 1.2, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0, 0, 0.5]) == [0, 1, 2]
    # What is too short to be halved stays as it is: then others must do.
    lengths[1] = 0.03
    assert marked("slip", [0, 0.8, 0, 0, 0.5, 0, 0, 0]) == [3, 4, 5]


SPHERE = """\
object: {mass: 0.05, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {radius: 0.05, position: [0, 0, 0.3], facing: [0, 0, -1]}
motion:
  - {at: 0, position: [0, 0, 0.2]}
  - {at: 3, position: [0, 0, 0.2], rotation: {axis: [0, 0, 1], degrees: -120}}
  - {at: 6, position: [0, 0, 0.2], rotation: {axis: [0, 0, 1], degrees: 60}}
fingers: {left: {touches: [0.03, 0, 0]}, right: {touches: [-0.03, 0, 0]}}
"""


@pytest.mark.parametrize("limits_travel", [True, False])
def test_only_where_contacts_are_held_back_refinements_begin_with_a_part_of_the_way(
    monkeypatch: pytest.MonkeyPatch, limits_travel: bool
) -> None:
    model, given = build_model(parse_task(SPHERE)), SimpleNamespace(name="the whole way")
    asked: list[Any] = []
    monkeypatch.setattr(type(model), "limits_travel", limits_travel)
    monkeypatch.setattr(certify, "run_shortened", lambda record, part, whole: asked.append((part, whole)) or "a part")
    anything: Any = None
    begun = Certifier(anything, model, given, anything, anything, 1)._begun  # type: ignore[arg-type]
    if not limits_travel:
        assert begun == (model, given, 1.0)
        assert asked == []
        return
    part, floating, homotopy = begun
    assert (floating, homotopy) == ("a part", pytest.approx(0.75))  # 90 of 120 degrees
    assert asked == [(part, given)]
    np.testing.assert_allclose(np.degrees(part.goal_vectors[:, 2]), [0, -90, 45], atol=1e-9)
