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
LEVELS = {
    "sparse": resampled_model(MODEL, MODEL.schedule.stepped(0.4)),
    "coarse": resampled_model(MODEL, MODEL.schedule.stepped(0.2)),
    "fine": MODEL,
}


@pytest.fixture(scope="module")
def start() -> WholeHand:
    palm = {"palm_position": MODEL.palm_position, "palm_quaternion": MODEL.palm_quaternion}
    return replace(carrying().start, **palm)


class Told(Continuation):
    """Solves return the motion they begin with, moved by their number, exact where they are told to be.

    Attributes:
        taken: for each solve its knots, the steps of its way, the share, and where the object was at the end of what it
            began with.
    """

    def __init__(self, exact: Callable[[str, float], bool], hopeless: bool = False, violation: float = 0.0) -> None:
        super().__init__(MODEL, (0, 2), (1, 2), np.ones((len(MODEL.schedule.samples), MODEL.contacts + 1), bool))
        self.taken: list[tuple[str, str, float, float]] = []
        self.exact_where, self.hopeless, self.violation = exact, hopeless, violation
        self.sparse, self.coarse, self.fine = (self._stage(level) for level in LEVELS)  # type: ignore[misc]

    def _stage(self, level: str) -> Any:
        model = LEVELS[level]

        def take(way: Any, hand: WholeHand, margin: Margin, share: float = 1.0) -> Refined:
            assert len(hand.position) == len(model.schedule.samples)
            self.taken.append((level, " ".join(step[0] for step in way), share, float(hand.position[-1, 0])))
            runs = tuple((step[0], made_up_solution({})) for step in way)
            moved = SimpleNamespace(**vars(hand))
            moved.position = hand.position[:1] + share * np.linspace(0, 1, len(hand.position))[:, None]
            result, slips = WholeHand(**vars(moved)), {level: share}
            exact, worst = self.exact_where(level, share), Worst("a.b", self.violation, None)
            return Refined(result, exact, worst, slips, self.hopeless and not exact, runs, {}, margin, share)

        return SimpleNamespace(model=model, take=take, costs=lambda *_: {"slip": 1.0, "passive_force": 0.0})

    @property
    def ways(self) -> list[tuple[str, str]]:
        """Knots and way of each solve."""
        return [(level, way) for level, way, *_ in self.taken]

    def shares(self, *levels: str) -> list[float]:
        """The shares that were solved on these knots."""
        return [share for level, _, share, _ in self.taken if level in levels]


def names(way: Any) -> str:
    return " ".join(step[0] for step in way)


LONG, SHORT = names(LONG_WAY), names(SHORT_WAY)


def test_a_motion_is_made_exact_on_ever_denser_knots(start: WholeHand) -> None:
    told = Told(lambda level, share: True)
    refined = told.solve(start, Margin())
    assert told.ways == [("sparse", LONG), ("coarse", "exact"), ("fine", "exact")]
    assert refined.exact
    assert [what for what, _ in refined.runs] == [*(f"sparse {step[0]}" for step in LONG_WAY), "coarse exact", "exact"]
    assert refined.slips == {"sparse": 1.0}
    assert len(refined.hand.position) == len(MODEL.schedule.samples)
    # The palm goes as it did, not as sparse samples of it.
    np.testing.assert_array_equal(refined.hand.palm_position, start.palm_position)


def test_what_fails_on_sparse_knots_is_tried_on_coarse_but_not_on_dense_ones(start: WholeHand) -> None:
    told = Told(lambda level, share: level != "sparse")
    assert told.solve(start, Margin()).exact
    assert told.ways == [("sparse", LONG), ("coarse", LONG), ("fine", "exact")]
    told = Told(lambda level, share: False)
    refined = told.solve(start, Margin())
    assert told.ways == [("sparse", LONG), ("coarse", LONG)]
    assert not refined.exact
    assert len(refined.runs) == 2 * len(LONG_WAY)
    assert len(refined.hand.position) == len(MODEL.schedule.samples)
    np.testing.assert_array_equal(refined.hand.active, start.active)


def test_where_fingers_cannot_roll_no_other_knots_are_tried(start: WholeHand) -> None:
    told = Told(lambda level, share: False, hopeless=True)
    refined = told.solve(start, Margin())
    assert told.ways == [("sparse", LONG)]
    assert refined.slips_hopelessly
    assert refined.slips == {"sparse": 1.0}
    # Without physics, slip says nothing: there may be too few knots.
    told = Told(lambda level, share: level != "sparse", hopeless=True, violation=1e-3)
    assert told.solve(start, Margin()).exact
    assert told.ways == [("sparse", LONG), ("coarse", LONG), ("fine", "exact")]


def test_what_fails_on_coarse_knots_is_not_tried_on_dense_ones(start: WholeHand) -> None:
    told = Told(lambda level, share: level == "sparse")
    refined = told.solve(start, Margin())
    assert told.ways == [("sparse", LONG), ("coarse", "exact"), ("coarse", SHORT)]
    assert not refined.exact
    assert len(refined.hand.position) == len(MODEL.schedule.samples)


def test_near_motions_take_the_short_way_and_the_long_one_where_it_fails(start: WholeHand) -> None:
    told = Told(lambda level, share: level != "fine")
    refined = told.solve(start, Margin(), near=True)
    denser = [("coarse", "exact"), ("fine", "exact"), ("fine", SHORT)]
    assert told.ways == [("sparse", SHORT), *denser, ("sparse", LONG), *denser]
    assert not refined.exact
    assert len(refined.runs) == sum(len(way.split()) for _, way in told.ways)


def test_a_motion_is_lengthened_until_it_reaches_its_goals(start: WholeHand) -> None:
    told = Told(lambda level, share: True)
    refined = told.lengthen(start, 0.5, Margin())
    assert told.shares(*LEVELS) == pytest.approx([0.5, 2 / 3, 5 / 6, 1.0, 1.0, 1.0])
    assert told.ways == [("sparse", LONG), *3 * [("sparse", SHORT)], ("coarse", "exact"), ("fine", "exact")]
    # Each begins where the ones before lead: the object went as far as its share.
    begun = np.diff([place for *_, place in told.taken[1:4]])
    np.testing.assert_allclose(begun, 1 / 6)
    assert refined.exact
    assert refined.share == 1
    assert refined.runs[0][0] == "sparse 50% of the way, soft"


def test_steps_get_shorter_where_they_fail_and_the_longest_exact_motion_is_kept(start: WholeHand) -> None:
    told = Told(lambda level, share: share < 0.8)
    refined = told.lengthen(start, 0.1, Margin())
    tried = [0.1, 0.4, 0.7, 1.0, 0.85, 0.775, 0.85]
    assert told.shares("sparse") == pytest.approx(tried)
    # Made exact there, and begun again; it gets no farther, and what is found first is kept.
    assert told.shares("coarse") == pytest.approx([refined.share, *tried])
    assert refined.share == pytest.approx(0.775)
    assert not refined.exact
    assert told.taken[-1][:3] == ("fine", "exact", refined.share)
    assert 0.3 / 2**2 > SHORTEST > 0.3 / 2**3


def test_what_goes_farther_on_coarse_knots_is_kept(start: WholeHand) -> None:
    told = Told(lambda level, share: level != "sparse" or share < 0.6)
    refined = told.lengthen(start, 0.5, Margin())
    longest = max(share for share in told.shares("sparse") if share < 0.6)
    assert told.shares("coarse") == pytest.approx([longest, 0.5, 2 / 3, 5 / 6, 1.0])
    assert refined.exact
    assert told.taken[-1][:3] == ("fine", "exact", 1.0)


def test_a_motion_of_which_no_part_is_exact_is_not_lengthened(start: WholeHand) -> None:
    told = Told(lambda level, share: False)
    refined = told.lengthen(start, 0.5, Margin())
    assert told.shares(*LEVELS) == 2 * [0.5, 0.25, 0.125]
    assert (refined.exact, refined.share) == (False, 0.125)


def test_where_the_first_part_fails_a_shorter_one_is_looked_for(start: WholeHand) -> None:
    told = Told(lambda level, share: share < 0.3 or len(told.taken) > 1)
    refined = told.lengthen(start, 0.5, Margin())
    assert told.shares("sparse") == pytest.approx([0.5, 0.25, 0.5, 0.75, 1.0])
    first, second = (place for *_, place in told.taken[:2])
    assert second - start.position[0, 0] == pytest.approx((first - start.position[0, 0]) / 2)
    assert refined.exact


@pytest.mark.parametrize("fails_on", ["", "sparse", "coarse", "fine"])
def test_a_firmer_grip_is_kept_where_it_is_exact(start: WholeHand, fails_on: str) -> None:
    firm, lengthened = Margin(normal_force=2.0), 4
    told = Told(lambda level, share: level != fails_on or len(told.taken) <= lengthened)
    refined = told.lengthen(start, 0.5, Margin(), firm)
    denser = [("sparse", SHORT), ("coarse", "exact"), ("fine", "exact")]
    if not fails_on:
        assert told.ways[lengthened:] == denser
    assert refined.exact == (fails_on in ("", "sparse"))
    assert refined.margin == (Margin() if fails_on else firm)
    assert len(refined.runs) == sum(len(way.split()) for _, way in told.ways)
    assert "sparse firmer grip, firm" in [what for what, _ in refined.runs]


def test_a_short_rest_of_the_way_is_gone_in_one_step(start: WholeHand) -> None:
    told = Told(lambda level, share: True)
    refined = told.lengthen(start, 0.96, Margin())
    assert told.shares("sparse") == pytest.approx([0.96, 1.0])
    assert refined.exact


@pytest.mark.parametrize(("answers", "exact"), [([True], True), ([False, True], True), ([False, False], False)])
def test_a_motion_that_is_exact_but_for_its_samples_takes_the_last_step_alone(
    start: WholeHand, answers: list[bool], exact: bool
) -> None:
    left = iter(answers)
    told = Told(lambda level, share: next(left))
    assert told.renew(start, Margin()).exact == exact
    # Where a small barrier leads nowhere a larger one is tried.
    assert told.ways == len(answers) * [("fine", "exact")]


def test_a_grip_is_made_firmer_on_sparse_knots_first(start: WholeHand) -> None:
    told = Told(lambda level, share: True)
    assert told.tighten(start, Margin(normal_force=2.0)).exact
    assert told.ways == [("sparse", SHORT), ("coarse", "exact"), ("fine", "exact")]
