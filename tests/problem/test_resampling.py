"""Motions at other samples and over a part of their way, against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.motion import Schedule
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.resampling import at_rest, extrapolated, resampled, resampled_model, shortened
from casadi_hands.problem.scenario import Scenario
from tests.stages.example import everything, project, rod, standing
from tests.stages.refining import carrying

Array = np.ndarray


@pytest.fixture(scope="module")
def start() -> WholeHand:
    return carrying().start


def smooth(times: Array, columns: int) -> Array:
    """A motion that rests at both ends."""
    phase = np.pi * times / times[-1]
    return np.outer(1 - np.cos(phase), np.arange(1, columns + 1))


def test_keyframes_stay_and_samples_are_at_most_a_step_apart() -> None:
    schedule = Schedule.of([0.0, 0.6, 1.5], 1.5, 2, 0.1)
    fewer = schedule.stepped(0.2)
    np.testing.assert_array_equal(fewer.keyframes, schedule.keyframes)
    np.testing.assert_allclose(fewer.samples, [0, 0.2, 0.4, 0.6, 0.75, 0.9, 1.05, 1.2, 1.35, 1.5])
    np.testing.assert_allclose(fewer.samples[fewer.keyframe_samples], fewer.keyframes)
    assert (fewer.goals, fewer.step) == (schedule.goals, 0.2)


def test_a_task_at_fewer_samples_has_the_same_palm_and_pushes_there() -> None:
    _, model = everything()
    fewer = resampled_model(model, model.schedule.stepped(0.2))
    assert len(fewer.schedule.samples) < len(model.schedule.samples)
    for k, time in enumerate(fewer.schedule.samples):
        at = int(np.argmin(np.abs(model.schedule.samples - time)))
        if abs(model.schedule.samples[at] - time) < 1e-9:
            np.testing.assert_allclose(fewer.palm_position[k], model.palm_position[at], atol=1e-12)
            np.testing.assert_allclose(fewer.palm_quaternion[k], model.palm_quaternion[at], atol=1e-12)
            np.testing.assert_array_equal(disturbance(fewer).force[k], model.disturbance.force[at])
    assert disturbance(fewer).force.any()
    np.testing.assert_allclose(np.linalg.norm(fewer.palm_quaternion, axis=1), 1, atol=1e-12)


def disturbance(model: Model) -> Scenario:
    assert model.disturbance is not None
    return model.disturbance


def test_no_push_is_lost_between_knots_and_of_two_the_larger_is_kept() -> None:
    _, model = everything()
    samples = model.schedule.samples
    push, twist = np.zeros((len(samples), 3)), np.zeros((len(samples), 3))
    # Sample by sample one that no knot falls into, one at a knot, and two before the same next knot.
    push[2], push[6], push[11], twist[12] = [0, 0, 1], [0, 2, 0], [3, 0, 0], [0, 0, 4]
    pushed = replace(model, scenarios=(model.scenarios[0], Scenario("_perturbed", push, twist)))
    knots = np.array([0, 1, 3, 6, 7, 9, 13])
    schedule = replace(model.schedule, samples=samples[[*knots, *range(14, len(samples))]])
    fewer = resampled_model(pushed, schedule)
    wanted = {1: push[2], 3: push[6]}
    for k in range(len(schedule.samples)):
        np.testing.assert_array_equal(disturbance(fewer).force[k], wanted.get(k, np.zeros(3)), str(k))
    np.testing.assert_array_equal(disturbance(fewer).torque[5], twist[12])
    assert np.count_nonzero(disturbance(fewer).torque.any(axis=1)) == 1
    # At its own samples the task stays what it is; in halved intervals a push lasts to its next sample.
    np.testing.assert_array_equal(disturbance(resampled_model(pushed, model.schedule)).force, push)
    halved = resampled_model(pushed, model.schedule.halved(np.ones(len(samples) - 1, bool)))
    np.testing.assert_array_equal(disturbance(halved).force, np.repeat(push, 2, axis=0)[:-1])


def test_a_smooth_motion_comes_back_from_fewer_samples(start: WholeHand) -> None:
    _, model = everything()
    fewer = resampled_model(model, model.schedule.stepped(0.2))
    times = model.schedule.samples
    contacts = start.point.shape[1]
    moving = replace(
        start,
        position=smooth(times, 3),
        vector=0.5 * smooth(times, 3),
        angles=tuple(smooth(times, a.shape[1]) for a in start.angles),
        point=smooth(times, 3 * contacts).reshape(-1, contacts, 3),
        force=np.outer(times, np.ones(3 * contacts)).reshape(-1, contacts, 3),
    )
    there = resampled(moving, model, fewer)
    np.testing.assert_allclose(there.position, smooth(fewer.schedule.samples, 3), atol=2e-3)
    np.testing.assert_allclose(there.force[:, 0, 0], fewer.schedule.samples, atol=1e-12)
    back = resampled(there, fewer, model)
    for name in ("position", "vector", "point", "force"):
        scale = np.abs(getattr(moving, name)).max()
        np.testing.assert_allclose(getattr(back, name), getattr(moving, name), atol=0.01 * scale)
    for given, found in zip(moving.angles, back.angles, strict=True):
        np.testing.assert_allclose(found, given, atol=0.05)


def test_next_to_a_touch_or_a_lift_a_finger_turns_evenly(start: WholeHand) -> None:
    _, model = everything()
    finer = resampled_model(model, model.schedule.halved(np.ones(len(model.schedule.samples) - 1, bool)))
    there = resampled(start, model, finer)
    middles = [(angles[1:] + angles[:-1]) / 2 for angles in start.angles]
    even = [
        np.isclose(found[1::2], middle, rtol=0, atol=1e-12).all(axis=1)
        for found, middle in zip(there.angles, middles, strict=True)
    ]
    assert not even[0].any()  # it never lifts
    # The other lifts at the fourth sample and touches at the seventh.
    assert np.flatnonzero(even[1]).tolist() == [3, 4, 6, 7]


def test_a_contact_touches_at_a_sample_as_from_the_last_before_it(start: WholeHand) -> None:
    _, model = everything()
    fewer = resampled_model(model, model.schedule.stepped(0.2))
    there = resampled(start, model, fewer)
    for k, time in enumerate(fewer.schedule.samples):
        last = int(np.flatnonzero(model.schedule.samples <= time + 1e-9)[-1])
        np.testing.assert_array_equal(there.active[k], start.active[last])
    assert not there.active.all()


def palm_frames(model: Model) -> tuple[Rotation, np.ndarray]:
    return Rotation.from_quat(model.palm_quaternion, scalar_first=True), model.palm_position


def test_goals_of_a_part_of_the_way_are_on_it() -> None:
    model = standing(everything()[1])
    half = shortened(model, 0.5)
    first, last = model.goal_positions[0], model.goal_positions[-1]
    np.testing.assert_allclose(half.goal_positions[0], first)
    np.testing.assert_allclose(half.goal_positions[-1], (first + last) / 2)
    np.testing.assert_allclose(2 * half.goal_vectors, model.goal_vectors + model.goal_vectors[0])
    np.testing.assert_array_equal(shortened(model, 1.0).goal_positions, model.goal_positions)


def test_a_part_of_the_way_is_as_seen_from_a_palm_that_moves() -> None:
    _, model = everything()
    turns, places = palm_frames(model)
    at = model.schedule.goal_samples
    half = shortened(model, 0.5)

    def seen(positions: np.ndarray) -> np.ndarray:
        return turns[at].inv().apply(positions - places[at])

    assert np.ptp(places[at], axis=0).max() > 0.1
    assert (turns[at[-1]] * turns[0].inv()).magnitude() > 0.1
    whole, part = seen(model.goal_positions), seen(half.goal_positions)
    np.testing.assert_allclose(part, (whole + whole[0]) / 2, atol=1e-9)
    # Half the turn about the same axis, by the palm's own turn more.
    for k, (vector, short) in enumerate(zip(model.goal_vectors, half.goal_vectors, strict=True)):
        palm = turns[at[k]] * turns[0].inv()
        whole_turn = palm.inv() * Rotation.from_rotvec(vector)
        half_turn = palm.inv() * Rotation.from_rotvec(short)
        np.testing.assert_allclose((half_turn * half_turn * whole_turn.inv()).magnitude(), 0, atol=1e-9)


def test_motions_go_on_as_they_have_grown(start: WholeHand) -> None:
    _, model = everything()
    still = at_rest(model, start)
    # At rest as seen from the palm, which moves.
    palm = replace(model, palm_position=start.palm_position, palm_quaternion=start.palm_quaternion)
    turns, places = palm_frames(palm)
    seen = turns.inv().apply(still.position - places)
    np.testing.assert_allclose(seen, np.tile(seen[0], (len(seen), 1)), atol=1e-12)
    np.testing.assert_allclose(still.position[0], start.position[0], atol=1e-12)
    held = turns.inv() * Rotation.from_rotvec(still.vector)
    np.testing.assert_allclose((held[0].inv() * held).magnitude(), 0, atol=1e-7)
    # From rest to a motion, and half as far again, with contacts on the object.
    farther = extrapolated(model, still, start, 0.5)
    np.testing.assert_allclose(farther.position, start.position + 0.5 * (start.position - still.position))
    np.testing.assert_allclose(farther.angles[1], start.angles[1] + 0.5 * (start.angles[1] - start.angles[1][0]))
    for contact, capsule in enumerate(map(rod, model.touched[: model.contacts])):
        expected = 1.5 * start.point[3, contact] - 0.5 * start.point[0, contact]
        np.testing.assert_allclose(farther.point[3, contact], project(expected, capsule)[0], atol=1e-9)
    np.testing.assert_array_equal(farther.force, start.force)


def test_a_palm_whose_quaternions_change_sign_is_between_its_neighbours(start: WholeHand) -> None:
    _, model = everything()
    finer = resampled_model(model, model.schedule.halved(np.ones(len(model.schedule.samples) - 1, bool)))
    # Facing down, w is about 0: normalised to w >= 0, neighbours differ in sign.
    lean = 0.02 * np.sin(7 * model.schedule.samples)
    turns = Rotation.from_rotvec(np.outer(np.pi + lean, [1, 0, 0])).as_quat(scalar_first=True)
    turns *= np.where(turns[:, :1] < 0, -1, 1)
    assert (np.diff(np.sign(turns[:, 1])) != 0).any()
    there = resampled(replace(start, palm_quaternion=turns), model, finer)
    wanted = Rotation.from_rotvec(np.outer(np.pi + 0.02 * np.sin(7 * finer.schedule.samples), [1, 0, 0]))
    found = Rotation.from_quat(there.palm_quaternion, scalar_first=True)
    np.testing.assert_allclose((wanted.inv() * found).magnitude(), 0, atol=2e-3)
