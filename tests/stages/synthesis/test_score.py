"""Scores of fingers whose Jacobians are known."""

from __future__ import annotations

import numpy as np
import pytest

from casadi_hands.stages.synthesis.score import finger_scores, worst_miss
from casadi_hands.stages.synthesis.target import Target
from casadi_hands.statics.joints import structural_projector
from casadi_hands.terms.finger import NULL_SPACE_DAMPING
from tests.stages.synthesis.example import ball_target, foot, hand, pointing

# An upright finger of height h: a turn about x moves its tip along y, one about y along x.
PUSH_ONLY = [[1, 0, 0]]
SIDEWAYS = [[0, 1, 0]]


@pytest.fixture(scope="module")
def target() -> Target:
    return ball_target()


@pytest.mark.parametrize("joints", [1, 2, 3, 5])
def test_projector_is_the_svd_one_damped(joints: int) -> None:
    jacobian = np.random.default_rng(joints).normal(size=(3, joints))
    left, singular, _ = np.linalg.svd(jacobian)
    shares = np.zeros(3)
    shares[: len(singular)] = singular**2 / (singular**2 + 0.02**2)
    np.testing.assert_allclose(
        structural_projector(jacobian, NULL_SPACE_DAMPING), left @ np.diag(1 - shares) @ left.T, atol=1e-12
    )


def test_tip_share_is_fifty_times_the_mean_squared_miss(target: Target) -> None:
    # Upright fingers meet their contact at the first of three keyframes and are left behind by 0, 0.25, 0.5 half
    # extents; three joints supply every force, so nothing else counts.
    axes = [[1, 0, 0], [0, 1, 0], [1, 1, 0.5]]
    fingers = [pointing(target, c, axes) for c in (0, 1)]
    for seed in fingers:
        seed.angles[:] = [0.4, -0.3, 0.5]
    bent = hand(fingers, (0, 1))
    straight = hand([pointing(target, c, axes) for c in (0, 1)], (0, 1))
    np.testing.assert_allclose(target.points[:, 0, 1] - target.points[0, 0, 1], [0, 0.25, 0.5], atol=1e-9)
    misses = 50 * np.mean([0, 0.25**2, 0.5**2])
    # Straight up, no joint lifts: the lift of 0.5 is structural in full; forces along y cost nothing.
    np.testing.assert_allclose(finger_scores(target, straight), misses + 0.5, atol=0.02)
    assert (finger_scores(target, bent) > 0).all()


def test_a_finger_that_can_supply_all_scores_nothing_one_that_cannot_its_share_of_the_weight() -> None:
    still = ball_target()
    still.points[:] = still.points[0]
    still.centers[:] = still.centers[0]
    # Bent in the plane across the ball, two joints about x move the tip along y and z: press and lift.
    able = [pointing(still, c, [[1, 0, 0], [1, 0, 0]]) for c in (0, 1)]
    for seed, side in zip(able, (-1, 1), strict=True):
        first, second = 0.6 * side, -1.2 * side
        seed.angles[:] = [first, second]
        # Out and back: the tip comes to stand over the base again, at the height of the contact.
        height = still.points[0, 0, 2] - foot(still) - still.model.link_radius * np.cos(0.6)
        seed.lengths[:] = height / (2 * np.cos(0.6))
        seed.base[1] -= still.model.link_radius * np.sin(0.6) * side
        seed.tips[:] = 0
    score = finger_scores(still, hand(able, (0, 1)))
    assert (score < 0.01).all()
    # Upright with one joint about x they press, and what they lift, half the weight each, is structural.
    unable = finger_scores(still, hand([pointing(still, c, PUSH_ONLY) for c in (0, 1)], (0, 1)))
    np.testing.assert_allclose(unable, 0.5, atol=0.02)
    # With one joint across the squeeze nothing is supplied: all that friction needs of it is structural too.
    worse = finger_scores(still, hand([pointing(still, c, SIDEWAYS) for c in (0, 1)], (0, 1)))
    assert (worse > 1.0).all()
    # One of each: the able finger takes over what the other cannot, as far as balance of torques lets it.
    mixed = finger_scores(still, hand([able[0], pointing(still, 1, PUSH_ONLY)], (0, 1)))
    assert mixed[0] < 0.01
    assert mixed[1] == pytest.approx(0.5, abs=0.02)


def test_a_contact_counts_only_while_it_acts() -> None:
    target = ball_target()
    target.active[1:, 1] = False
    target.forces[1:, 1] = 0
    fingers = [pointing(target, c, [[1, 0, 0], [0, 1, 0], [1, 1, 0.5]]) for c in (0, 1)]
    scores = finger_scores(target, hand(fingers, (0, 1)))
    # The right finger acts at the first keyframe alone, where it is at its contact.
    assert scores[1] == pytest.approx(0.5, abs=0.02)
    assert scores[0] > 50 * np.mean([0, 0.25**2, 0.5**2])


def test_the_worst_miss_is_the_farthest_while_the_contact_acts() -> None:
    # The contact moves away by 0.25 lengths a keyframe; keyframes are 0.3 s apart.
    target = ball_target()
    straight = hand([pointing(target, c, PUSH_ONLY) for c in (0, 1)], (0, 1))
    np.testing.assert_allclose(worst_miss(target, straight, 0), (0.5, 0.6), atol=1e-9)
    target.active[2, 1] = False
    np.testing.assert_allclose(worst_miss(target, straight, 1), (0.25, 0.3), atol=1e-9)
