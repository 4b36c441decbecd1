"""Random starts: the same for one stream, within bounds, spread out."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.stats import kstest

from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.stages.synthesis.seeds import random_finger
from casadi_hands.stages.synthesis.target import Target
from tests.stages.synthesis.example import ball_target


@pytest.fixture(scope="module")
def target() -> Target:
    return ball_target()


def draw(target: Target, stream: tuple[int, ...], joints: int = 2) -> FingerSeed:
    return random_finger(target, 1, joints, np.random.default_rng(stream))


def test_one_stream_gives_one_finger_and_another_another(target: Target) -> None:
    one, again, other = draw(target, (0, 1, 2, 3)), draw(target, (0, 1, 2, 3)), draw(target, (0, 1, 2, 4))
    for field in dataclasses.fields(FingerSeed):
        if field.name == "axes":
            np.testing.assert_array_equal(one.axes, 0)
            continue
        np.testing.assert_array_equal(getattr(one, field.name), getattr(again, field.name))
        assert not np.array_equal(getattr(one, field.name), getattr(other, field.name))


@pytest.mark.parametrize("joints", [1, 2, 3])
def test_fingers_are_within_what_can_be_built(target: Target, joints: int) -> None:
    shortest, longest = target.link_length
    low, high = target.joint_limits
    for trial in range(100):
        finger = draw(target, (5, trial), joints)
        assert np.linalg.norm(finger.base) <= target.palm_radius - target.link_radius
        assert ((shortest <= finger.lengths) & (finger.lengths <= longest)).all()
        assert ((low < finger.angles) & (finger.angles < high)).all()
        assert np.ptp(finger.angles, axis=0).max() == 0
        assert np.abs(finger.tips).max() <= target.tip_arc
        assert finger.angles.shape == (len(target.times), joints)
        assert finger.tips.shape == (1, 2)
        for frame in finger.frames:
            np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-12)
            assert np.linalg.det(frame) == pytest.approx(1)


def test_bases_cover_the_disc_and_axes_their_part_of_the_sphere_evenly(target: Target) -> None:
    fingers = [draw(target, (9, trial)) for trial in range(400)]
    reach = target.palm_radius - target.link_radius
    shares = [(np.linalg.norm(f.base) / reach) ** 2 for f in fingers]
    heights = [(f.axis_vectors[0, 2] / target.model.axis_cosines[1] + 1) / 2 for f in fingers]
    assert kstest(shares, "uniform").pvalue > 0.01
    assert kstest(heights, "uniform").pvalue > 0.01
