"""Which ways to an exact motion are taken, and where they end, with solves that are told whether they serve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.resampling import resampled, resampled_model
from casadi_hands.stages.refine.continuation import LEAST_STEP, Continuation
from casadi_hands.stages.refine.result import Refined, Run, Worst
from casadi_hands.stages.refine.settings import ALL_STEPS, COUPLING_FROM_AFAR, COUPLING_STEPS, NEARBY_STEPS
from casadi_hands.stages.refine.values import Margin
from tests.stages.example import everything, made_up_solution, standing
from tests.stages.refining import carrying

pytestmark = pytest.mark.usefixtures("interpreted")

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
        wanted: for each solve the motion that its costs hold near to, at its knots.
    """

    def __init__(
        self,
        exact: Callable[[str, float, Margin], bool],
        hopeless: Callable[[str, str], bool] = lambda level, way: False,
        violation: float = 0.0,
        firmer_on: str = "",
    ) -> None:
        super().__init__(MODEL, (0, 2), (1, 2), np.ones((len(MODEL.schedule.samples), MODEL.contacts + 1), bool))
        self.taken: list[tuple[str, str, float, float]] = []
        self.wanted: list[WholeHand] = []
        self.cleared: list[bool] = []
        self.sharpened_to: list[int] = []
        self.exact_where, self.hopeless, self.violation, self.firmer_on = exact, hopeless, violation, firmer_on
        self.sparse, self.coarse, self.fine = (self._stage(level) for level in LEVELS)  # type: ignore[misc]

    def _stage(self, level: str) -> Any:
        model = LEVELS[level]

        def take(
            way: Any,
            hand: WholeHand,
            margin: Margin,
            homotopy: float = 1.0,
            wanted: WholeHand | None = None,
            clear: bool = False,
            sharpness: int = 0,
        ) -> Refined:
            self.sharpened_to.append(sharpness)
            self.cleared.append(clear)
            wanted = wanted or hand
            assert len(hand.position) == len(wanted.position) == len(model.schedule.samples)
            self.wanted.append(wanted)
            self.taken.append((level, " ".join(step[0] for step in way), homotopy, float(hand.position[-1, 0])))
            runs = tuple(Run(step[0], made_up_solution({}), margin) for step in way)
            moved = SimpleNamespace(**vars(hand))
            moved.position = hand.position[:1] + homotopy * np.linspace(0, 1, len(hand.position))[:, None]
            result, worst = WholeHand(**vars(moved)), Worst("a.b", self.violation, None)
            exact = self.exact_where(level, homotopy, margin)
            hopeless = not exact and self.hopeless(level, names(way))
            barely = hopeless or level == self.firmer_on
            return Refined(result, exact, worst, {level: homotopy}, hopeless, barely, runs, {}, margin, homotopy)

        return SimpleNamespace(
            model=model,
            take=take,
            take_clear=partial(take, clear=True),
            costs=lambda *_: {"slip": 1.0, "passive_force": 0.0},
        )

    @property
    def ways(self) -> list[tuple[str, str]]:
        """Knots and steps of each solve."""
        return [(level, steps) for level, steps, *_ in self.taken]

    def shares(self, *levels: str) -> list[float]:
        """The shares that were solved on these knots."""
        return [homotopy for level, _, homotopy, _ in self.taken if level in levels]


def names(way: Any) -> str:
    return " ".join(step[0] for step in way)


LONG, SHORT = names(ALL_STEPS), names(NEARBY_STEPS)


def test_a_motion_is_made_exact_on_ever_denser_knots(start: WholeHand) -> None:
    told = Told(lambda level, homotopy, margin: True)
    refined = told.solve(start, Margin())
    assert told.ways == [("sparse", LONG), ("coarse", "hard constraints"), ("fine", "hard constraints")]
    assert all(told.cleared)
    assert refined.exact
    assert [run.what for run in refined.runs] == [
        *(f"sparse {step[0]}" for step in ALL_STEPS),
        "coarse hard constraints",
        "hard constraints",
    ]
    assert len(refined.hand.position) == len(MODEL.schedule.samples)
    # The palm goes as it did, not as sparse samples of it.
    np.testing.assert_array_equal(refined.hand.palm_position, start.palm_position)


def test_the_motion_stays_near_the_first_on_all_knots(start: WholeHand) -> None:
    told = Told(lambda level, homotopy, margin: True)
    told.solve(start, Margin())
    assert told.wanted[-1] is start
    for wanted, level in zip(told.wanted, LEVELS, strict=True):
        np.testing.assert_allclose(wanted.point, resampled(start, MODEL, LEVELS[level]).point, atol=1e-12)
    assert told.taken[1][3] != told.wanted[1].position[-1, 0]


def test_what_fails_on_sparse_knots_is_tried_on_coarse_but_not_on_dense_ones(start: WholeHand) -> None:
    told = Told(lambda level, homotopy, margin: level != "sparse")
    assert told.solve(start, Margin()).exact
    assert told.ways == [("sparse", LONG), ("coarse", LONG), ("fine", "hard constraints")]
    told = Told(lambda level, homotopy, margin: False)
    refined = told.solve(start, Margin())
    assert told.ways == [("sparse", LONG), ("coarse", LONG)]
    assert not refined.exact
    assert len(refined.runs) == 2 * len(ALL_STEPS)
    assert len(refined.hand.position) == len(MODEL.schedule.samples)
    np.testing.assert_array_equal(refined.hand.active, start.active)


@pytest.mark.parametrize(("joints", "more"), [((1, 1), True), ((1, 0), False)])
def test_hands_that_leave_the_object_one_way_to_go_are_not_tried_on_more_knots(
    start: WholeHand, joints: tuple[int, int], more: bool
) -> None:
    # Of the object's six velocities and two joints' two contacts that roll leave two, of six and one joint's one.
    told = Told(lambda level, homotopy, margin: False)
    told.joints = joints
    told.solve(start, Margin())
    assert told.ways == [("sparse", LONG), ("coarse", LONG)][: 1 + more]
    # Where a finger never touches it takes nothing away.
    told.active[:, 0] = False
    told.taken.clear()
    told.solve(start, Margin())
    assert len(told.ways) == 2


def test_where_fingers_cannot_roll_no_other_knots_are_tried(start: WholeHand) -> None:
    told = Told(lambda level, homotopy, margin: False, hopeless=lambda level, way: True)
    refined = told.solve(start, Margin())
    assert told.ways == [("sparse", LONG)]
    assert refined.slips_hopelessly
    assert refined.barely_rolls
    assert refined.slips == {"sparse": 1.0}
    # Without physics, slip says nothing: there may be too few knots.
    told = Told(lambda level, homotopy, margin: level != "sparse", hopeless=lambda level, way: True, violation=1e-3)
    assert told.solve(start, Margin()).exact
    assert told.ways == [("sparse", LONG), ("coarse", LONG), ("fine", "hard constraints")]


def test_what_misses_less_is_exact_goes_farther_rolls_or_violates_less(start: WholeHand) -> None:
    exact = Refined(start, True, Worst("a", 1e-9, None), {}, False, False, (), {}, Margin(), 0.5)
    farther = replace(exact, met=False, worst=Worst("a", 1e-3, None), homotopy=0.9)
    whole = replace(farther, homotopy=1.0)
    slips = replace(whole, slips_hopelessly=True, worst=Worst("b", 1e-6, None))
    far = replace(whole, worst=Worst("a", 1.0, None))
    ranked = [replace(exact, homotopy=1.0), exact, whole, far, slips, farther]
    for i, better in enumerate(ranked):
        assert [better.misses_less_than(other) for other in ranked] == [i < k for k in range(len(ranked))]


def test_what_slips_only_on_coarse_knots_is_not_said_to_slip(start: WholeHand) -> None:
    # On sparse knots it rolls, and near that motion it misses less than where stiff penalties go from there.
    told = Told(lambda level, homotopy, margin: level == "sparse", hopeless=lambda level, way: way == SHORT)
    refined = told.solve(start, Margin())
    assert told.ways == [("sparse", LONG), ("coarse", "hard constraints"), ("coarse", SHORT)]
    assert not refined.slips_hopelessly
    assert not refined.barely_rolls
    steps = ["hard constraints", *(step[0] for step in NEARBY_STEPS)]
    assert [run.what for run in refined.runs[len(ALL_STEPS) :]] == [f"coarse {step}" for step in steps]


@pytest.mark.parametrize("firmer_on", ["", "sparse", "coarse"])
@pytest.mark.parametrize("exact_on", ["sparse", "coarse"])
def test_what_is_found_rolls_barely_where_its_own_knots_took_a_firmer_solve(
    start: WholeHand, firmer_on: str, exact_on: str
) -> None:
    told = Told(lambda level, homotopy, margin: level != "sparse" or exact_on == "sparse", firmer_on=firmer_on)
    assert told.solve(start, Margin()).barely_rolls == (firmer_on == exact_on)
    told.taken.clear()
    assert told.continue_from(start, 0.5, Margin()).barely_rolls == (firmer_on == exact_on)


def test_what_fails_on_coarse_knots_is_not_tried_on_dense_ones(start: WholeHand) -> None:
    told = Told(lambda level, homotopy, margin: level == "sparse")
    refined = told.solve(start, Margin())
    assert told.ways == [("sparse", LONG), ("coarse", "hard constraints"), ("coarse", SHORT)]
    assert not refined.exact
    assert len(refined.hand.position) == len(MODEL.schedule.samples)


def test_near_motions_take_the_short_way_and_the_long_one_where_it_fails(start: WholeHand) -> None:
    told = Told(lambda level, homotopy, margin: level != "fine")
    refined = told.solve(start, Margin(), near=True)
    denser = [("coarse", "hard constraints"), ("fine", "hard constraints"), ("fine", SHORT)]
    assert told.ways == [("sparse", SHORT), *denser, ("sparse", LONG), *denser]
    assert not refined.exact
    steps = {LONG: len(ALL_STEPS), SHORT: len(NEARBY_STEPS), "hard constraints": 1}
    assert len(refined.runs) == sum(steps[way] for _, way in told.ways)


def test_joints_that_share_motors_come_to_them_from_penalties_unless_their_motion_is_exact(start: WholeHand) -> None:
    for near, way in ((True, COUPLING_STEPS), (False, COUPLING_FROM_AFAR)):
        told = Told(lambda *_: True)
        told.model = replace(MODEL, motors=1)
        told.solve(start, Margin(), near=near)
        assert told.ways[0] == ("sparse", names(way))
    assert names(COUPLING_FROM_AFAR) == f"penalty {names(COUPLING_STEPS)}"


@pytest.mark.parametrize(("violation", "again"), [(5e-4, True), (2e-3, False)])
def test_commands_far_off_their_lines_are_not_tried_on_more_knots(
    start: WholeHand, violation: float, again: bool
) -> None:
    told = Told(lambda *_: False, violation=violation)
    told.model, told.joints = replace(MODEL, motors=1), (3, 3)
    told.solve(start, Margin(), near=True)
    assert [level for level, _ in told.ways] == (["sparse", "coarse"] if again else ["sparse"])


def test_a_motion_is_lengthened_until_it_reaches_its_goals(start: WholeHand) -> None:
    told = Told(lambda level, homotopy, margin: True)
    refined = told.continue_from(start, 0.5, Margin())
    assert told.shares(*LEVELS) == pytest.approx([0.5, 2 / 3, 5 / 6, 1.0, 1.0, 1.0])
    assert told.ways == [
        ("sparse", LONG),
        *3 * [("sparse", SHORT)],
        ("coarse", "hard constraints"),
        ("fine", "hard constraints"),
    ]
    # Each begins where the ones before lead: the object went as far as its homotopy.
    begun = np.diff([place for *_, place in told.taken[1:4]])
    np.testing.assert_allclose(begun, 1 / 6)
    assert refined.exact
    assert refined.homotopy == 1
    assert refined.runs[0][0] == "sparse homotopy 50%, penalty"


def test_steps_get_shorter_where_they_fail_and_the_longest_exact_motion_is_kept(start: WholeHand) -> None:
    told = Told(lambda level, homotopy, margin: homotopy < 0.8)
    refined = told.continue_from(start, 0.1, Margin())
    tried = [0.1, 0.4, 0.7, 1.0, 0.85, 0.775, 0.85]
    assert told.shares("sparse") == pytest.approx(tried)
    # On coarse knots it gets no farther: what was found first is made exact there.
    assert told.shares("coarse") == pytest.approx([*tried, refined.homotopy])
    assert told.shares("fine") == [refined.homotopy]
    assert refined.homotopy == pytest.approx(0.775)
    assert not refined.exact
    assert told.taken[-1][:3] == ("fine", "hard constraints", refined.homotopy)
    assert 0.3 / 2**2 > LEAST_STEP > 0.3 / 2**3


def test_what_goes_farther_on_coarse_knots_is_kept(start: WholeHand) -> None:
    told = Told(lambda level, homotopy, margin: level != "sparse" or homotopy < 0.6)
    refined = told.continue_from(start, 0.5, Margin())
    assert told.shares("coarse") == pytest.approx([0.5, 2 / 3, 5 / 6, 1.0])
    assert refined.exact
    assert told.shares("fine") == [1.0]


def test_an_exact_motion_is_not_given_up_for_a_longer_one_that_is_not(start: WholeHand) -> None:
    told = Told(lambda level, homotopy, margin: homotopy < {"sparse": 0.8, "coarse": 0.1, "fine": 0.8}[level])
    refined = told.continue_from(start, 0.5, Margin())
    assert refined.homotopy == max(homotopy for homotopy in told.shares("sparse") if homotopy < 0.8)


def test_a_motion_of_which_no_part_is_exact_is_not_lengthened(start: WholeHand) -> None:
    told = Told(lambda level, homotopy, margin: False)
    refined = told.continue_from(start, 0.5, Margin())
    assert told.shares(*LEVELS) == 2 * [0.5, 0.25, 0.125]
    assert (refined.exact, refined.homotopy) == (False, 0.125)


def test_where_the_first_part_fails_a_shorter_one_is_looked_for(start: WholeHand) -> None:
    told = Told(lambda level, homotopy, margin: homotopy < 0.3 or len(told.taken) > 1)
    refined = told.continue_from(start, 0.5, Margin())
    assert told.shares("sparse") == pytest.approx([0.5, 0.25, 0.5, 0.75, 1.0])
    first, second = (place for *_, place in told.taken[:2])
    assert second - start.position[0, 0] == pytest.approx((first - start.position[0, 0]) / 2)
    assert refined.exact


@pytest.mark.parametrize("fails_on", ["", "sparse", "coarse", "fine"])
def test_a_firmer_grip_is_kept_where_it_is_exact_and_the_other_one_elsewhere(start: WholeHand, fails_on: str) -> None:
    firm = Margin(normal_force=2.0)
    told = Told(lambda level, homotopy, margin: not (margin == firm and level == fails_on))
    refined = told.continue_from(start, 0.5, Margin(), firm)
    assert refined.exact
    assert refined.margin == (Margin() if fails_on else firm)
    steps = {
        "": ["sparse stiff penalty", "sparse hard constraints", "coarse hard constraints", "hard constraints"],
        "sparse": ["sparse stiff penalty", "sparse hard constraints"],
        "coarse": [
            "sparse stiff penalty",
            "sparse hard constraints",
            "coarse hard constraints",
            "coarse stiff penalty",
            "coarse hard constraints",
        ],
        "fine": [
            "sparse stiff penalty",
            "sparse hard constraints",
            "coarse hard constraints",
            "hard constraints",
            "stiff penalty",
            "hard constraints",
        ],
    }[fails_on]
    assert [run.what for run in refined.runs if run.margin == firm] == [
        f"larger normal forces, {step}" for step in steps
    ]
    if fails_on:
        assert [run.what for run in refined.runs[-2:]] == ["coarse hard constraints", "hard constraints"]
    # The whole way with the first margin was gone once.
    assert [run.what for run in refined.runs].count("sparse homotopy 50%, penalty") == 1


def test_a_short_rest_of_the_way_is_gone_in_one_step(start: WholeHand) -> None:
    told = Told(lambda level, homotopy, margin: True)
    refined = told.continue_from(start, 0.96, Margin())
    assert told.shares("sparse") == pytest.approx([0.96, 1.0])
    assert refined.exact


@pytest.mark.parametrize(("answers", "exact"), [([True], True), ([False, True], True), ([False, False], False)])
def test_a_motion_that_is_exact_but_for_its_samples_takes_the_last_step_alone(
    start: WholeHand, answers: list[bool], exact: bool
) -> None:
    left = iter(answers)
    told = Told(lambda level, homotopy, margin: next(left))
    renewed = told.renew(start, 2, Margin())
    assert (renewed.exact, renewed.sharpness) == (exact, 2)
    assert told.sharpened_to == len(answers) * [2]
    # Where a small barrier leads nowhere a larger one is tried.
    assert told.ways == len(answers) * [("fine", "hard constraints")]


@pytest.mark.parametrize(
    ("presses", "grip", "friction", "factor"),
    [
        (0.4, 2.0, 0.5, 4.0),  # by the margins, where nearly nothing presses with more than it must
        (1.6, 2.0, 0.5, 1.25),  # by what presses least, but for a tenth
        (3.0, 2.0, 0.5, 1.0),  # no softer, for the friction
        (0.4, 0.25, 0.5, 1.0),
        (3.0, 2.0, 0.25, 2.0),  # half the friction may be used: as along the surface, twice into it
        (3.0, 0.3, 1.0, 0.5),
    ],
)
def test_another_grip_is_had_on_few_knots_first_from_a_motion_that_presses_as_much(
    start: WholeHand, presses: float, grip: float, friction: float, factor: float
) -> None:
    kept, other = Margin(normal_force=0.5), Margin(friction, grip)
    sizes = np.linalg.norm(start.force[:, [0, 2]], axis=2)[start.active[:, [0, 2]]]
    start = replace(start, force=start.force * presses / np.quantile(sizes, 0.1))
    exact = Refined(start, True, Worst("a", 0.0, None), {}, False, False, (), {}, kept)
    told = Told(lambda level, homotopy, margin: margin == other)
    assert told.with_margin(exact, other).exact
    assert told.ways == [("sparse", SHORT), ("coarse", "hard constraints"), ("fine", "hard constraints")]
    found, fingers = told.wanted[-1].force, [0, 2]
    np.testing.assert_allclose(found[:, fingers], factor * start.force[:, fingers], rtol=1e-12)
    # What the ground and other contacts bear follows from that.
    np.testing.assert_array_equal(np.delete(found, fingers, axis=1), np.delete(start.force, fingers, axis=1))
