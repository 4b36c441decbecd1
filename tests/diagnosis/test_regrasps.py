"""Regrasps that a task asks for, told before they are tried."""

from __future__ import annotations

import pytest

from casadi_hands.diagnosis.impossible import findings
from casadi_hands.problem.si import build_model
from casadi_hands.task import parse_task

BAR = """\
object: {{mass: 0.1, shapes: [{{capsule: {{start: [0, 0, -0.04], end: [0, 0, 0.04], radius: 0.02}}}}]}}
palm: {{radius: 0.05, position: [0, 0, 0.3], facing: [1, 0, 0]}}
motion:
  - {{at: 0, position: [0.09, 0, 0.3]}}
  - {{at: 3, position: [0.09, 0.01, 0.3]}}
  - {{at: 6, position: [0.09, 0, 0.3]}}
fingers:
  thumb: {{touches: [0, 0.02, 0]{thumb}}}
  index: {{touches: [0, -0.02, 0.025]{index}}}
  middle: {{touches: [0, -0.02, -0.025]}}
friction: 0.7
"""


def told(thumb: str = "", index: str = "", changes: tuple[str, str] = ("", "")) -> list[str]:
    text = BAR.format(
        **{name: f", regrasps: [{{{r}}}]" if r else "" for name, r in (("thumb", thumb), ("index", index))}
    )
    task = parse_task(text.replace(*changes))
    found = [each for each in findings(task, build_model(task)) if "regrasps" in each.reason.text]
    assert not any(each.certain for each in found)
    return [each.reason.text for each in found]


def test_a_finger_that_others_hold_for_may_let_go() -> None:
    assert told() == []
    assert told(index="from: 1, to: 2, touches: [0, -0.02, 0.01]") == []


def test_fingertips_that_touch_anew_in_each_other() -> None:
    (text,) = told(index="from: 1, to: 2, touches: [0, -0.02, -0.022]")
    assert text.startswith("at 2 s (between goals 1 and 2) the fingertips of 'index' and 'middle' overlap by ")
    assert "their centres are 3 mm apart" in text


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            ("", ""),
            "from 1 s (between goals 1 and 2) on 'index' and 'middle' alone cannot hold the object with friction",
        ),
        (("friction: 0.7", "friction: 0.7\ngravity: [0, 0, 0]"), ""),
    ],
)
def test_fingers_that_are_left_on_one_side_hold_nothing(changes: tuple[str, str], words: str) -> None:
    """They can only push; where nothing weighs, there is nothing to hold."""
    found = told(thumb="from: 1, to: 2, touches: [0, 0.02, 0.02]", changes=changes)
    assert [text[: len(words)] for text in found] == ([words] if words else [])
    assert all("a force of 0.82 weights is missing" in text for text in found)
