"""Fingers that the task has let go and touch again."""

from __future__ import annotations

import io

import numpy as np
import pytest
from rich.console import Console

from casadi_hands.cli.task_summary import check_summary
from casadi_hands.errors import TaskError
from casadi_hands.problem.holds import shortened_task
from casadi_hands.problem.si import build_model
from casadi_hands.task import Task, parse_task, task_to_yaml
from tests.pencil import pencil

WALK = pencil(
    8,
    """\
  east: {touches: [0.006, 0, 0.04], regrasps: REGRASPS}
  west: {touches: [-0.006, 0, 0.04]}
  north: {touches: [0, 0.006, 0.04], regrasps: [{from: 4, to: 5, touches: [0, 0.006, 0.02]}]}
""",
)


TWICE = "[{from: 1, to: 2, touches: [0.008, 0, 0]}, {from: 6, to: 7, touches: [0.006, 0, -0.02]}]"
ONCE = WALK.replace("REGRASPS", "[{from: 1, to: 2, touches: [0.006, 0, 0]}]")


def walk(regrasps: str = TWICE) -> Task:
    return parse_task(WALK.replace("REGRASPS", regrasps))


def test_they_come_back_as_they_were_with_points_on_the_surface() -> None:
    task = walk()
    assert task.fingers["east"].points[1:] == ((0.006, 0.0, 0.0), (0.006, 0.0, -0.02))
    assert task.fingers["west"].regrasps is None
    assert parse_task(task_to_yaml(task)) == task


def test_they_move_with_the_object_frame() -> None:
    moved = parse_task(ONCE.replace("mass: 0.03", "mass: 0.03, center_of_mass: [0, 0, 0.01]"))
    np.testing.assert_allclose(moved.fingers["east"].points, [[0.006, 0, 0.03], [0.006, 0, -0.01]], atol=1e-12)


def test_the_model_lifts_them_and_puts_them_where_they_shall_touch() -> None:
    model = build_model(walk())
    assert model.regrasp is not None
    assert model.regrasp.asked
    times = model.schedule.keyframes
    for time in (1, 2, 4, 5, 6, 7):
        assert np.abs(times - time).min() < 1e-9
    away = ((times > 1 - 1e-9) & (times < 2 - 1e-9)) | ((times > 6 - 1e-9) & (times < 7 - 1e-9))
    np.testing.assert_array_equal(model.regrasp.lifted[:, 0], away)
    assert not model.regrasp.lifted[:, 1].any()
    heights = model.regrasp.patches[:, 0, 2] * model.units.length
    np.testing.assert_allclose(heights, np.select([times < 2 - 1e-9, times < 7 - 1e-9], [0.04, 0.0], -0.02), atol=1e-9)


def test_a_still_stretch_in_which_fingers_regrasp_is_not_shortened() -> None:
    task = walk()
    assert shortened_task(task) == (task, ())


def test_farther_points_ask_for_longer_links() -> None:
    near, far = (walk(f"[{{from: 1, to: 2, touches: [0.006, 0, {z}]}}]") for z in (0.03, -0.05))
    assert far.hand.link_length[1] > near.hand.link_length[1]


@pytest.mark.parametrize(
    ("regrasps", "message"),
    [
        ("[]", r"fingers\.east\.regrasps: given 0 of them; allowed: at least 1"),
        ("[{from: 2, to: 1, touches: [0.006, 0, 0]}]", r"a time `from` before the time `to`"),
        ("[{from: 0.1, to: 1, touches: [0.006, 0, 0]}]", r"regrasps\[0\]\.from: given 0\.1; allowed: at least 0\.3:"),
        ("[{from: 1, to: 1.2, touches: [0.006, 0, 0]}]", r"regrasps\[0\]\.to: given 1\.2; allowed: at least 1\.3:"),
        ("[{from: 6, to: 7.9, touches: [0.006, 0, 0]}]", r"regrasps\[0\]\.to: given 7\.9; allowed: at most 7\.7:"),
        (
            "[{from: 1, to: 2, touches: [0.006, 0, 0]}, {from: 2.1, to: 3, touches: [0.006, 0, 0]}]",
            r"regrasps\[1\]\.from: given 2\.1; allowed: at least 2\.3: .* after it touched at 2 s",
        ),
        ("[{from: 1, to: 4.5, touches: [0.006, 0, 0]}]", r"two contacts hold the object; north let go, too"),
        ("[{from: 2, to: 3.95, touches: [0.006, 0, 0]}]", r"to: given 3\.95; allowed: 4, when something else happens"),
        ("[{from: 1, to: 2, touches: [0.06, 0, 0]}]", r"regrasps\[0\]\.touches: .*of the object's surface"),
        ("[{from: 1, to: 2}]", r"regrasps\[0\]\.touches: "),
    ],
)
def test_what_cannot_be_is_refused(regrasps: str, message: str) -> None:
    with pytest.raises(TaskError, match=message):
        walk(regrasps)


def test_only_fingers_that_touch_points_regrasp() -> None:
    with pytest.raises(TaskError, match=r"regrasps\[0\]\.touches: given after anywhere"):
        parse_task(ONCE.replace("[0.006, 0, 0.04]", "anywhere"))


def test_the_summary_tells_of_them() -> None:
    task = walk()
    printed = io.StringIO()
    Console(file=printed, width=400).print(check_summary(task)[0])
    assert "lets go at 1 s, from 2 s at [6, 0, 0] mm, lets go at 6 s, from 7 s at [6, 0, -20] mm" in printed.getvalue()
