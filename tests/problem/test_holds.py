"""Long still stretches: what is left out of the problem, what is written, and that it is the same motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from casadi_hands.diagnosis.moment import moment, real_moment
from casadi_hands.problem.holds import KEPT, LONG, shortened_task, with_holds, without_holds
from casadi_hands.problem.outcome import floating_motion
from casadi_hands.problem.si import build_model
from casadi_hands.task import Task, load_task, parse_task
from tests.stages.example import made_up_floating

PROBLEMS = sorted((Path(__file__).parents[2] / "problems").glob("*.yaml"))
UP = "{at: 2, position: [0, 0, 0.02]}"
BALL = """\
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {position: [0, 0, 0.1], facing: [0, 0, -1]}
fingers: {left: {touches: [-0.03, 0, 0]}, right: {touches: [0.03, 0, 0]}}
"""


def lifted(goals: str, more: str = "") -> Task:
    return parse_task(f"{BALL}motion: [{{at: 0, position: [0, 0, 0]}}, {goals}]\n{more}")


HELD = f"{UP}, {{at: 62, position: [0, 0, 0.02]}}, {{at: 64, position: [0, 0, 0]}}"


@pytest.mark.parametrize("path", PROBLEMS, ids=lambda path: path.stem)
def test_the_gallery_is_solved_as_it_is(path: Path) -> None:
    task = load_task(path)
    assert shortened_task(task) == (task, ())


def test_of_a_minute_some_seconds_are_left() -> None:
    schedule = build_model(lifted(HELD)).schedule
    assert schedule.keyframes[-1] == pytest.approx(2 + KEPT + 2)
    assert schedule.holds == ((4, 60 - KEPT),)
    goals = schedule.keyframes[list(schedule.goals)]
    np.testing.assert_allclose(goals, [0, 2, 2 + KEPT, 4 + KEPT])
    np.testing.assert_allclose(schedule.real(goals), [0, 2, 62, 64])


def test_written_times_are_those_of_the_whole_motion() -> None:
    task = lifted(HELD)
    short, whole = build_model(task).schedule, build_model(task, whole=True).schedule
    times, index = short.filled()
    assert times[0] == 0
    assert times[-1] == pytest.approx(64)
    assert np.diff(times).max() <= task.time_step + 1e-9
    assert np.diff(times).min() > 1e-3
    for time in whole.keyframes[list(whole.goals)]:
        assert np.abs(times - time).min() < 1e-9
    assert (np.diff(index) >= 0).all()
    assert set(index) == set(range(len(short.samples)))
    # One sample is repeated all through the hold, and no other one.
    repeated = np.bincount(index)
    assert np.flatnonzero(repeated > 1).tolist() == short.hold_samples.tolist()
    np.testing.assert_allclose(times[np.append(True, np.diff(index) > 0)], short.real(short.samples))


@pytest.mark.parametrize("length", [LONG - 0.1, LONG, LONG + 0.1])
def test_only_long_stretches_are_shortened(length: float) -> None:
    goals = f"{UP}, {{at: {2 + length}, position: [0, 0, 0.02]}}"
    assert bool(shortened_task(lifted(goals))[1]) is (length > LONG)


MOVING = {
    "elsewhere": (f"{UP}, {{at: 62, position: [0, 0, 0.021]}}", ""),
    "turned": (f"{UP}, {{at: 62, position: [0, 0, 0.02], rotation: {{axis: [0, 0, 1], degrees: 5}}}}", ""),
    "pushed": (HELD, "perturbations: [{from: 30, to: 31, force: [0.1, 0, 0]}]"),
    "pushed as it begins": (HELD, "perturbations: [{from: 1, to: 2.5, force: [0.1, 0, 0]}]"),
    "on a palm that moves": (HELD, "palm: {position: [0, 0, 0.1], facing: [0, 0, -1], moves: true}"),
    "exerting": (f"{UP}, {{at: 62, position: [0, 0, 0.02], exert: {{force: [0, 0, -1]}}}}", ""),
    "exerting before": (f"{UP[:-1]}, exert: {{force: [0, 0, -1]}}}}, {{at: 62, position: [0, 0, 0.02]}}", ""),
}


@pytest.mark.parametrize("kind", MOVING)
def test_a_stretch_in_which_something_happens_is_kept(kind: str) -> None:
    goals, more = MOVING[kind]
    text = BALL if "palm:" not in more else "".join(line for line in BALL.splitlines(True) if "palm:" not in line)
    task = parse_task(f"{text}motion: [{{at: 0, position: [0, 0, 0]}}, {goals}]\n{more}\n")
    assert shortened_task(task) == (task, ())


def test_what_pushes_later_pushes_at_its_time() -> None:
    push = "perturbations: [{from: 63, to: 63.5, force: [0.1, 0, 0]}]"
    model = build_model(lifted(HELD, push))
    assert model.disturbance is not None
    acts = model.schedule.real(model.schedule.samples[model.disturbance.acts])
    assert (acts.min(), acts.max()) == pytest.approx((63, 63.5), abs=0.1)


def test_a_motion_is_written_constant_where_it_is_held() -> None:
    model = build_model(lifted(HELD))
    motion = floating_motion(model, made_up_floating(model))
    held = (motion.time >= model.schedule.real(model.schedule.keyframes)[4]) & (motion.time <= 60)
    assert held.sum() > 550
    for name in ("object_position", "object_orientation", "contact_force", "contact_active", "base_position"):
        values = getattr(motion, name)
        assert len(values) == len(motion.time), name
        assert (values[held] == values[held][0]).all(), name
    assert (np.abs(np.diff(motion.object_position, axis=0)).max(axis=1)[~held[1:]] > 0).all()
    assert with_holds(build_model(lifted(UP)).schedule, motion) is motion


def test_what_is_found_in_a_hold_is_told_of_its_neighbours() -> None:
    schedule = build_model(lifted(HELD)).schedule
    times, _ = schedule.filled()
    found = np.zeros((2, len(times) - 1))
    middle = int(np.searchsorted(times, 30.0))
    found[0, middle], found[1, 3], found[1, -1] = 5.0, 2.0, 1.0
    told = without_holds(schedule, found)
    (hold,) = schedule.hold_samples
    assert told.shape == (2, len(schedule.samples) - 1)
    assert np.flatnonzero(told[0]).tolist() == [hold - 1, hold]
    assert {k: told[1, k] for k in np.flatnonzero(told[1])} == {3: 2.0, len(schedule.samples) - 2: 1.0}


def test_times_are_told_as_the_task_has_them() -> None:
    schedule = build_model(lifted(HELD)).schedule
    assert moment(schedule, 2 + KEPT) == real_moment(schedule, 62.0) == "goal 3 (62 s)"
    assert moment(schedule, 3 + KEPT) == "63 s (between goals 3 and 4)"
    assert moment(schedule, 1.0) == "1 s (between goals 1 and 2)"
