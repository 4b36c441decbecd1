"""Random starts: the same for one stream, within bounds, spread out."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.problem.si import build_model
from casadi_hands.stages.synthesis.seeds import random_finger
from casadi_hands.stages.synthesis.target import Target
from casadi_hands.task import parse_task
from tests.stages.synthesis.example import BALL, ball_target, foot


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
        assert np.linalg.norm(finger.base) <= target.palm_radius - target.model.link_radius
        assert ((shortest <= finger.lengths) & (finger.lengths <= longest)).all()
        assert ((low < finger.angles) & (finger.angles < high)).all()
        assert np.ptp(finger.angles, axis=0).max() == 0
        assert np.abs(finger.tips).max() <= target.tip_arc
        assert finger.angles.shape == (len(target.times), joints)
        assert finger.tips.shape == (1, 2)
        for frame in finger.frames:
            np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-12)
            assert np.linalg.det(frame) == pytest.approx(1)


RANGES = [(60, 90), (89, 90), (90, 90), (45, 45), (0, 10), (30, 35), (0, 90)]


def allowing(target: Target, bend: float, least: float, largest: float) -> Target:
    """A target whose task allows other bends and angles of axes, degrees."""
    task = parse_task(BALL + f"hand: {{bend: {bend}, axes: {{from_link: [{least}, {largest}]}}}}\n")
    return dataclasses.replace(target, model=build_model(task))


@pytest.mark.parametrize(("least", "largest"), RANGES)
@pytest.mark.parametrize("bend", [0, 0.5, 30, 90])
def test_seeds_are_bent_and_hinged_as_the_task_allows(
    target: Target, bend: float, least: float, largest: float
) -> None:
    wanted, seen = allowing(target, bend, least, largest), []
    fingers = [draw(wanted, (6, trial), 3) for trial in range(30)]
    for finger in fingers:
        for j, (vector, axis) in enumerate(zip(finger.bends, finger.axis_vectors, strict=True)):
            assert np.degrees(np.linalg.norm(vector)) <= bend + 1e-9
            before = Rotation.from_rotvec([*vector, 0.0]).inv().apply([0, 0, 1])
            for link in [np.array([0, 0, 1])] if j == 0 else [np.array([0, 0, 1]), before]:
                angle = np.degrees(np.arctan2(np.linalg.norm(np.cross(link, axis)), abs(link @ axis)))
                # Of axis vectors, whose coordinates are rounded at zero.
                assert least - 1e-3 <= angle <= largest + 1e-3
                seen.append(angle)
    # All of a range is drawn from, or at least not one axis for all.
    assert max(seen) - min(seen) >= 0.4 * min(largest - least, 2)
    directions = np.array([finger.axis_vectors for finger in fingers])
    assert np.linalg.norm(directions.mean(axis=0)[:, :2], axis=1).max() < 0.5


def test_straight_seeds_with_free_axes_are_drawn_from_the_stream_as_ever(target: Target) -> None:
    free = allowing(target, 0, 0, 90)
    low, high = free.joint_limits
    for trial in range(20):
        finger, rng = draw(free, (7, trial), 3), np.random.default_rng((7, trial))
        direction, distance = rng.uniform(0, 2 * np.pi), np.sqrt(rng.uniform())
        reach = free.palm_radius - free.model.link_radius
        np.testing.assert_allclose(finger.base, reach * distance * np.array([np.cos(direction), np.sin(direction)]))
        away = free.points[:, 1].mean(axis=0) - np.append(finger.base, foot(free))
        lengths = rng.uniform(0.8, 1.6, 3) * np.linalg.norm(away) / 3
        np.testing.assert_allclose(finger.lengths, np.clip(lengths, *free.link_length))
        np.testing.assert_array_equal(finger.angles[0], rng.uniform(0.6 * low, 0.6 * high, 3))
        np.testing.assert_array_equal(finger.tips, free.tip_arc * rng.uniform(-0.7, 0.7, (1, 2)))
        normals = rng.normal(size=(3, 3))
        np.testing.assert_allclose(finger.frames[:, :, 2], normals / np.linalg.norm(normals, axis=1, keepdims=True))
        assert not finger.bends.any()
        assert not finger.axes.any()


def test_bends_cover_their_disc_evenly(target: Target) -> None:
    for bend, most in ((90, 45), (30, 30)):  # seeds start bent by no more than 45 degrees
        wanted = allowing(target, bend, 60, 90)
        bends = np.vstack([draw(wanted, (8, trial)).bends for trial in range(200)])
        shares = (np.degrees(np.linalg.norm(bends, axis=1)) / most) ** 2
        ways = np.arctan2(bends[:, 1], bends[:, 0]) / (2 * np.pi) + 0.5
        assert kstest(shares, "uniform").pvalue > 0.01
        assert kstest(ways, "uniform").pvalue > 0.01


def test_bases_cover_the_disc_and_axes_their_part_of_the_sphere_evenly(target: Target) -> None:
    fingers = [draw(target, (9, trial)) for trial in range(400)]
    reach = target.palm_radius - target.model.link_radius
    shares = [(np.linalg.norm(f.base) / reach) ** 2 for f in fingers]
    heights = [(f.axis_vectors[0, 2] / target.model.axis_cosines[1] + 1) / 2 for f in fingers]
    assert kstest(shares, "uniform").pvalue > 0.01
    assert kstest(heights, "uniform").pvalue > 0.01
