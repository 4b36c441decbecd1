"""The audit of regrasps that the task asks for."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from casadi_hands.task import parse_task
from casadi_hands.verify.checks.motion import regrasp_problems
from tests.pencil import pencil

TASK = parse_task(
    pencil(
        4,
        """\
  east: {touches: [0.006, 0, 0.04], regrasps: [{from: 1, to: 2, touches: [0.006, 0, 0]}]}
  west: {touches: [-0.006, 0, 0.04]}
  north: {touches: [0, 0.006, 0.04]}
""",
    )
)


def folder(**changes: Any) -> Any:
    """What the check reads of a folder whose fingers do as the task says, but for some changes."""
    time = np.linspace(0, 4, 41)
    active = np.ones((41, 3), bool)
    active[10:20, 0] = False
    points = np.tile([[0.006, 0, 0.04], [-0.006, 0, 0.04], [0, 0.006, 0.04]], (41, 1, 1))
    points[20:, 0, 2] = 0.003
    motion = {"time": time, "contact_names": ("east", "west", "north"), "contact_active": active}
    return SimpleNamespace(task=TASK, motion=SimpleNamespace(**{**motion, "contact_point_object": points, **changes}))


def test_fingers_that_do_as_the_task_says() -> None:
    assert regrasp_problems(folder()) == []


def changed(name: str, key: Any, value: Any) -> dict[str, Any]:
    array = getattr(folder().motion, name).copy()
    array[key] = value
    return {name: array}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (changed("contact_active", (slice(10, 20), 0), True), "touches at 1 s, where it has let go"),
        (changed("contact_active", (15, 0), True), "touches at 1.5 s, where it has let go"),
        (changed("contact_active", (30, 0), False), "does not touch at 3 s, where it touches"),
        (changed("contact_point_object", (20, 0), [0.006, 0, 0.02]), "touches 20 mm from where"),
        ({"contact_names": ("thumb", "west", "north")}, "the hand has no such finger"),
    ],
)
def test_fingers_that_do_not(changes: dict[str, Any], words: str) -> None:
    [problem] = regrasp_problems(folder(**changes))
    assert problem.startswith("contact 'east'")
    assert words in problem
