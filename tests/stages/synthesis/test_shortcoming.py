"""Reach against closed forms; what is said of fingers that miss, cannot reach or cannot press."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from casadi_hands.diagnosis.reason import Reason
from casadi_hands.diagnosis.shortcoming import shortcoming_reason
from casadi_hands.stages.synthesis.shortcoming import beyond_reach, shortcoming
from casadi_hands.stages.synthesis.stage import Synthesised
from casadi_hands.stages.synthesis.target import Target
from tests.stages.synthesis.example import ball_target, foot, hand, pointing

# The ball's contacts are 9 cm above a palm of 6 cm radius, 3 cm to either side; lengths in units of 3 cm.


def with_links(longest: float) -> Target:
    target = ball_target()
    return replace(target, model=replace(target.model, link_length=(0.5, longest)))


def told(target: Target, made: Synthesised, contact: int, score: float) -> Reason:
    return shortcoming_reason(target.model, shortcoming(target, made, contact, score))


def test_above_the_palm_reach_is_the_links_and_the_tip_s_radius() -> None:
    target = with_links(0.75)
    np.testing.assert_allclose(
        beyond_reach(target, 0, 2), 3 - foot(target) - (2 * 0.75 + target.model.link_radius), atol=1e-9
    )
    assert (beyond_reach(target, 0, 4) < 0).all()


def test_beside_the_palm_the_base_is_on_its_rim() -> None:
    target = with_links(0.75)
    # 4 from the axis, 2 outside a disc of radius 2; 1.5 above where fingers stand.
    target.points[-1, 1] = [2.4, -3.2, 1.5 + foot(target)]
    assert beyond_reach(target, 1, 2)[-1] == pytest.approx(2.5 - 1.5 - target.model.link_radius)
    # The nearest place of a base, by search.
    rim = {"type": "ineq", "fun": lambda xy: target.palm_radius**2 - xy @ xy}
    nearest = minimize(lambda xy: np.hypot(np.linalg.norm(xy - [2.4, -3.2]), 1.5), [0.1, 0.1], constraints=[rim])
    assert beyond_reach(target, 1, 2)[-1] == pytest.approx(nearest.fun - 1.5 - target.model.link_radius, abs=1e-5)


def test_a_contact_counts_only_while_it_acts() -> None:
    target = with_links(0.75)
    target.points[1, 0] = [0, 0, 50]
    target.active[1, 0] = False
    assert beyond_reach(target, 0, 2).max() < 2


def test_a_contact_out_of_reach_is_named_with_its_goal_and_the_links() -> None:
    target = with_links(0.75)
    target.points[-1, 0, 2] = 4.0
    made = hand([pointing(target, 0, [[1, 0, 0]] * 2), pointing(target, 1, [[1, 0, 0]])], (0, 1))
    reason = told(target, made, 0, 60.0)
    beyond = 30 * (4 - foot(target) - 1.5 - target.model.link_radius)
    assert reason.what == (
        f"finger 'left' cannot reach goal 2 (0.6 s) with 2 joints: its contact is {beyond:.1f} mm beyond links of "
        "at most 22.5 mm each"
    )
    assert reason.root
    assert "hand.link_length" in reason.advice


@pytest.mark.parametrize(
    ("heights", "when"),
    [
        ((3.0, 9.0, 4.0), "goal 2 (0.6 s)"),  # farther between the goals, but a goal is out of reach too
        ((2.0, 9.0, 2.0), "its contact at 0.3 s (between goals 1 and 2)"),
        ((4.0, 9.0, 3.0), "goal 1 (0 s)"),
    ],
)
def test_goals_out_of_reach_are_named_before_what_lies_between(heights: tuple[float, ...], when: str) -> None:
    target = with_links(1.1)
    target.points[:, 0, 2] = heights
    made = hand([pointing(target, 0, [[1, 0, 0]] * 2), pointing(target, 1, [[1, 0, 0]])], (0, 1))
    assert f"cannot reach {when} with 2 joints" in told(target, made, 0, 60.0).what


def test_a_reachable_contact_that_is_missed_is_not_called_out_of_reach() -> None:
    target = ball_target()
    made = hand([pointing(target, 0, [[1, 0, 0]]), pointing(target, 1, [[1, 0, 0]])], (0, 1))
    # Upright fingers, a ball that moves 15 mm: keyframe misses of 0, 7.5 and 15 mm and a score from them alone.
    score = 50 * np.mean([0, 0.25**2, 0.5**2])
    reason = told(target, made, 1, score)
    assert reason.what == "finger 'right' misses its contact by 15.0 mm at goal 2 (0.6 s) with 1 joint"
    assert not reason.root
    assert "search.max_joints" in reason.advice


def test_a_small_miss_beside_a_large_passive_force_is_not_the_reason() -> None:
    target = ball_target()
    target.points[:] = target.points[0]
    target.points[1, 0, 0] += 1.5e-3 / 0.03  # 1.5 mm
    made = hand([pointing(target, 0, [[1, 0, 0]]), pointing(target, 1, [[1, 0, 0]])], (0, 1))
    reason = told(target, made, 0, 50 * 0.05**2 / 3 + 0.7)
    assert reason.what == (
        "finger 'left' cannot press as its contact needs with 1 joint: no joint actuates 0.70 weights of the force, "
        "on average"
    )
