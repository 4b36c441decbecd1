"""Keyframes and samples: what every schedule must have."""

import numpy as np
import pytest

from casadi_hands.motion import Schedule

CASES = [
    ([0.0, 1.0, 3.0, 4.0], 4.0, 2, 0.1),
    ([0.0, 0.7], 0.7, 1, 0.1),
    ([0.0, 2.0], 3.0, 3, 0.04),
    ([0.0, 0.33, 5.0], 5.05, 2, 0.1),
]


@pytest.mark.parametrize(("goals", "duration", "between", "step"), CASES)
def test_goals_are_keyframes_and_keyframes_are_samples(goals, duration, between, step) -> None:
    schedule = Schedule.of(goals, duration, between, step)
    np.testing.assert_allclose(schedule.keyframes[list(schedule.goals)], goals, atol=1e-12)
    np.testing.assert_allclose(schedule.samples[schedule.keyframe_samples], schedule.keyframes, atol=1e-12)
    stretches = len(goals) - 1 + (duration > goals[-1])
    assert len(schedule.keyframes) == stretches * (between + 1) + 1


@pytest.mark.parametrize(("goals", "duration", "between", "step"), CASES)
def test_samples_increase_by_no_more_than_a_step_up_to_the_end(goals, duration, between, step) -> None:
    schedule = Schedule.of(goals, duration, between, step)
    gaps = np.diff(schedule.samples)
    assert gaps.min() > 0
    assert gaps.max() <= step * (1 + 1e-6)
    assert (schedule.samples[0], schedule.samples[-1]) == (goals[0], pytest.approx(duration))
    assert schedule.step == step


def test_stops_between_goals_part_their_stretches_and_others_change_nothing() -> None:
    schedule = Schedule.of([0.0, 1.0, 3.0], 4.0, 1, 0.1, stops=[0.0, 0.4, 1.0, 3.5, 4.0])
    np.testing.assert_allclose(schedule.keyframes, [0, 0.2, 0.4, 0.7, 1, 2, 3, 3.25, 3.5, 3.75, 4])
    assert schedule.goals == (0, 4, 6)
    plain = Schedule.of([0.0, 1.0, 3.0], 4.0, 1, 0.1)
    again = Schedule.of([0.0, 1.0, 3.0], 4.0, 1, 0.1, stops=[0.0, 1.0, 3.0])
    np.testing.assert_array_equal(again.samples, plain.samples)
    assert again.goals == plain.goals


def test_times_beside_the_samples_mirror_at_the_ends() -> None:
    schedule = Schedule.of([0.0, 0.3], 0.3, 0, 0.1)
    np.testing.assert_allclose(schedule.at(-1), [0.1, 0, 0.1, 0.2], atol=1e-12)
    np.testing.assert_allclose(schedule.at(0.5), [0.05, 0.15, 0.25, 0.25], atol=1e-12)


def test_no_sample_more_than_needed() -> None:
    # 0.3 / 0.1 is above 3 in floating point.
    schedule = Schedule.of([0.0, 0.6], 0.6, 1, 0.1)
    np.testing.assert_allclose(schedule.samples, np.arange(7) / 10, atol=1e-12)


def test_flags_hold_from_a_keyframe_up_to_the_next() -> None:
    schedule = Schedule.of([0.0, 0.6], 0.6, 1, 0.1)
    assert schedule.sample_keyframes.tolist() == [0, 0, 0, 1, 1, 1, 2]


def test_offsets_shift_time() -> None:
    schedule = Schedule.of([0.0, 1.0, 2.0], 2.0, 2, 0.1)
    values = np.random.default_rng(1).normal(size=len(schedule.keyframes))
    # Samples here are 1/12 s apart, less than the step; with a step of just that, neighbours are one step apart.
    assert schedule.samples[1] == pytest.approx(1 / 12)
    fine = Schedule.of([0.0, 1.0, 2.0], 2.0, 2, schedule.samples[1])
    np.testing.assert_allclose((fine.spline(1) @ values)[:-1], (fine.spline() @ values)[1:], atol=1e-12)


def test_times_between_keyframes() -> None:
    schedule = Schedule.of([0.0, 0.6, 1.8], 1.8, 1, 0.1)
    expected = [0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2, 1.4, 1.6, 1.8]
    np.testing.assert_allclose(schedule.between(2), expected, atol=1e-12)


def test_halved_intervals_get_a_sample_in_their_middle_and_keyframes_stay() -> None:
    schedule = Schedule.of([0.0, 0.4], 0.4, 1, 0.1)
    halved = schedule.halved(np.array([True, False, False, True]))
    np.testing.assert_allclose(halved.samples, [0, 0.05, 0.1, 0.2, 0.3, 0.35, 0.4])
    np.testing.assert_allclose(halved.samples[halved.keyframe_samples], schedule.keyframes)
    assert (halved.goals, halved.step) == (schedule.goals, schedule.step)
