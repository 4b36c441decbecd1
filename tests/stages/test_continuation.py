"""Which ways to an exact motion are taken, and where they end, with solves that are told whether they serve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from casadi_hands.stages.continuation import SHORTEST, Continuation
from casadi_hands.stages.refine import LONG_WAY, SHORT_WAY, Refined, Worst
from casadi_hands.stages.refine_values import Margin
from casadi_hands.stages.sampling import resampled_model
from casadi_hands.stages.whole_hand import WholeHand
from tests.stages.example import everything, made_up_solution, standing
from tests.stages.refining import carrying

MODEL = standing(everything()[1])
FEWER = resampled_model(MODEL, MODEL.schedule.stepped(0.2))


@pytest.fixture(scope="module")
def start() -> WholeHand:
    palm = {"palm_position": MODEL.palm_position, "palm_quaternion": MODEL.palm_quaternion}
    return replace(carrying().start, **palm)


class Told(Continuation):
    """Solves return the motion they begin with, moved by their number, exact where they are told to be.

    Attributes:
        taken: for each solve whether it was on coarse knots, the last step of its way, the share, and where the object
            was in the middle of what it began with.
    """

    def __init__(self, exact: Callable[[bool, float], bool]) -> None:
        super().__init__(MODEL, (0, 2), (1, 2), np.ones((len(MODEL.schedule.samples), MODEL.contacts + 1), bool))
        self.taken: list[tuple[bool, str, float, float]] = []
        self.exact_where = exact

    def _stage(self, model: Any, coarse: bool) -> Any:
        def take(way: Any, hand: WholeHand, margin: Margin, share: float = 1.0) -> Refined:
            assert len(hand.position) == len(model.schedule.samples)
            self.taken.append((coarse, " ".join(step[0] for step in way), share, float(hand.position[-1, 0])))
            runs = tuple((step[0], made_up_solution({})) for step in way)
            moved = SimpleNamespace(**vars(hand))
            moved.position = hand.position[:1] + share * np.linspace(0, 1, len(hand.position))[:, None]
            result = WholeHand(**vars(moved))
            exact = self.exact_where(coarse, share)
            return Refined(result, exact, Worst("a.b", 0.0, None), {"left": share}, False, runs, {}, share)

        return SimpleNamespace(model=model, take=take, costs=lambda *_: {"slip": 1.0, "passive_force": 0.0})

    @property
    def fine(self) -> Any:  # type: ignore[override]
        self._fine = getattr(self, "_fine", None) or self._stage(MODEL, coarse=False)
        return self._fine

    @property
    def coarse(self) -> Any:  # type: ignore[override]
        self._coarse = getattr(self, "_coarse", None) or self._stage(FEWER, coarse=True)
        return self._coarse


def names(way: Any) -> str:
    return " ".join(step[0] for step in way)


def test_a_motion_is_made_exact_on_coarse_knots_first(start: WholeHand) -> None:
    told = Told(lambda coarse, share: True)
    refined = told.solve(start)
    assert [(coarse, way) for coarse, way, *_ in told.taken] == [(True, names(LONG_WAY)), (False, "exact")]
    assert refined.exact
    assert [what for what, _ in refined.runs] == [*(f"coarse {step[0]}" for step in LONG_WAY), "exact"]
    assert len(refined.hand.position) == len(MODEL.schedule.samples)
    # The palm goes as it did, not as coarse samples of it.
    np.testing.assert_array_equal(refined.hand.palm_position, start.palm_position)


def test_what_fails_on_coarse_knots_is_not_tried_on_dense_ones(start: WholeHand) -> None:
    told = Told(lambda coarse, share: False)
    refined = told.solve(start)
    assert [coarse for coarse, *_ in told.taken] == [True]
    assert not refined.exact
    assert len(refined.hand.position) == len(MODEL.schedule.samples)
    np.testing.assert_array_equal(refined.hand.active, start.active)


def test_near_motions_take_the_short_way_and_the_long_one_where_it_fails(start: WholeHand) -> None:
    told = Told(lambda coarse, share: coarse)
    refined = told.solve(start, near=True)
    on_fine = [(False, "exact"), (False, names(SHORT_WAY))]
    ways = [(True, names(SHORT_WAY)), *on_fine, (True, names(LONG_WAY)), *on_fine]
    assert [(coarse, way) for coarse, way, *_ in told.taken] == ways
    assert not refined.exact
    assert len(refined.runs) == sum(len(way.split()) for _, way in ways)


def test_a_motion_is_lengthened_until_it_reaches_its_goals(start: WholeHand) -> None:
    told = Told(lambda coarse, share: True)
    refined = told.lengthen(start, 0.5)
    assert [share for *_, share, _ in told.taken] == pytest.approx([0.5, 2 / 3, 5 / 6, 1.0, 1.0])
    assert [way for _, way, *_ in told.taken] == [names(LONG_WAY), *3 * [names(SHORT_WAY)], "exact"]
    # Each begins where the ones before lead: the object went as far as its share.
    begun = np.diff([place for *_, place in told.taken[1:4]])
    np.testing.assert_allclose(begun, 1 / 6)
    assert refined.exact
    assert refined.share == 1
    assert refined.runs[0][0] == "50% of the way, soft"


def test_steps_get_shorter_where_they_fail_and_the_longest_exact_motion_is_kept(start: WholeHand) -> None:
    told = Told(lambda coarse, share: share < 0.8)
    refined = told.lengthen(start, 0.1)
    shares = [share for coarse, _, share, _ in told.taken if coarse]
    assert shares == pytest.approx([0.1, 0.4, 0.7, 1.0, 0.85, 0.775, 0.85])
    assert refined.share == pytest.approx(0.775)
    assert not refined.exact
    assert told.taken[-1][:3] == (False, "exact", refined.share)
    assert 0.3 / 2**2 > SHORTEST > 0.3 / 2**3


def test_a_motion_of_which_no_part_is_exact_is_not_lengthened(start: WholeHand) -> None:
    told = Told(lambda coarse, share: False)
    refined = told.lengthen(start, 0.5)
    assert [share for *_, share, _ in told.taken] == [0.5, 0.25, 0.125]
    assert (refined.exact, refined.share) == (False, 0.125)


def test_where_the_first_part_fails_a_shorter_one_is_looked_for(start: WholeHand) -> None:
    told = Told(lambda coarse, share: share < 0.3 or len(told.taken) > 1)
    refined = told.lengthen(start, 0.5)
    assert [share for coarse, _, share, _ in told.taken if coarse] == pytest.approx([0.5, 0.25, 0.5, 0.75, 1.0])
    first, second = (place for *_, place in told.taken[:2])
    assert second - start.position[0, 0] == pytest.approx((first - start.position[0, 0]) / 2)
    assert refined.exact


def test_a_short_rest_of_the_way_is_gone_in_one_step(start: WholeHand) -> None:
    told = Told(lambda coarse, share: True)
    refined = told.lengthen(start, 0.96)
    assert [share for coarse, _, share, _ in told.taken if coarse] == pytest.approx([0.96, 1.0])
    assert refined.exact


def test_a_motion_that_is_exact_but_for_its_samples_takes_the_last_step_alone(start: WholeHand) -> None:
    told = Told(lambda coarse, share: True)
    assert told.renew(start).exact
    assert [(coarse, way) for coarse, way, *_ in told.taken] == [(False, "exact")]


def test_where_a_small_barrier_leads_nowhere_a_larger_one_is_tried_but_once_for_a_firmer_grip(start: WholeHand) -> None:
    for firmer, answers, exact in (
        (False, [False, True], True),
        (False, [False, False], False),
        (True, [False], False),
    ):
        left = iter(answers)
        told = Told(lambda coarse, share, left=left: next(left))  # type: ignore[misc]
        assert told.renew(start, firmer=firmer).exact == exact
        assert next(left, None) is None
