"""Fingers by number, and regions in place of points."""

from __future__ import annotations

import pytest
import yaml

from casadi_hands.errors import TaskError
from casadi_hands.task import parse_task, task_to_yaml
from casadi_hands.task.region import Region
from tests.task.test_refusals import FINGERS, GOOD, message

NAMED = GOOD.replace("radius: 0.02}", "radius: 0.02, name: bar}")
WHOLE = (
    "a mapping of names, such as thumb: {touches: [0, 0.02, 0]}; "
    "or their number, 1 to 8, {count: [least, most]} of such with least <= most, or auto"
)


@pytest.mark.parametrize(
    ("written", "names", "optional"),
    [("3", 3, 0), ("{count: 2}", 2, 0), ("{count: [2, 4]}", 4, 2), ("auto", 5, 3)],
)
def test_fingers_by_number(written: str, names: int, optional: int) -> None:
    task = parse_task(GOOD.replace(FINGERS, f"fingers: {written}\n"))
    assert list(task.fingers) == [f"finger{i}" for i in range(1, names + 1)]
    assert [bool(finger.optional) for finger in task.fingers.values()] == [i >= names - optional for i in range(names)]
    assert all(finger.touches == Region() for finger in task.fingers.values())
    assert not task.is_placed
    assert parse_task(task_to_yaml(task)) == task


@pytest.mark.parametrize(
    ("written", "words"),
    [
        ("anywhere", "anywhere"),
        ("{near: [0, 0.02, 0], within: 0.01}", "within 10 mm of [0.0, 0.02, 0.0] m"),
        ("{on: bar}", "on bar"),
        ("{on: [bar], near: [0, 0.02, 0], within: 0.01}", "within 10 mm of [0.0, 0.02, 0.0] m, on bar"),
        ("{not_on: bar}", "not on bar"),
    ],
)
def test_regions(written: str, words: str) -> None:
    task = parse_task(NAMED.replace("[0, 0.02, -0.01]", written))
    assert str(task.fingers["thumb"].touches) == words
    assert not task.is_placed
    assert parse_task(task_to_yaml(task)) == task
    with pytest.raises(TaskError, match="not placed yet"):
        _ = task.fingers["thumb"].point


def test_files_of_programs_that_take_on_for_true() -> None:
    written = yaml.safe_dump(yaml.safe_load(NAMED.replace("[0, 0.02, -0.01]", "{on: bar}")))
    assert "true: bar" in written
    assert str(parse_task(written).fingers["thumb"].touches) == "on bar"


def test_regions_move_with_the_object_frame() -> None:
    text = NAMED.replace("[0, 0.02, -0.01]", "{near: [0, 0.02, 0], within: 0.01}")
    task = parse_task(text.replace("mass: 0.1", "mass: 0.1\n  center_of_mass: [0, 0, 0.01]"))
    assert task.fingers["thumb"].touches.near == (0, 0.02, -0.01)


def test_links_reach_all_of_an_object_that_may_be_touched_anywhere() -> None:
    corners = "{a: {touches: [0.02, 0, 0.04]}, b: {touches: [0.02, 0, -0.04]}}"  # the farthest at the farthest goal
    given, anywhere = (parse_task(GOOD.replace(FINGERS, f"fingers: {written}\n")) for written in (corners, "2"))
    assert anywhere.hand.link_length == pytest.approx(given.hand.link_length)


REFUSED = {
    "a number of fingers": ("fingers: 0", f"14: fingers: given 0; allowed: {WHOLE}"),
    "half a finger": ("fingers: 2.5", f"14: fingers: given 2.5; allowed: {WHOLE}"),
    "a flag": ("fingers: true", f"14: fingers: given true; allowed: {WHOLE}"),
    "too many": ("fingers: 9", f"14: fingers: given 9; allowed: {WHOLE}"),
    "a word": ("fingers: many", f"14: fingers: given 'many'; allowed: {WHOLE}"),
    "the wrong way round": ("fingers: {count: [5, 2]}", f"14: fingers: given a count of [5, 2]; allowed: {WHOLE}"),
    "one against gravity": (
        "fingers: 1",
        "14: fingers: given one finger; allowed: two or more; a single contact cannot hold an object against gravity",
    ),
}
REGIONS = {
    "another word": ("somewhere", ": given 'somewhere'; allowed: a list of 3 numbers"),
    "a shape without that name": ("{on: foo}", ".on: given 'foo'; allowed: the name of one of object.shapes: bar"),
    "nor not on it": ("{not_on: foo}", ".not_on: given 'foo'; allowed: the name of one of object.shapes: bar"),
    "a number of a shape": ("{on: 3}", ".on: given 3; allowed: the name of a shape, or a list of those"),
    "no distance": (
        "{near: [0, 0.02, 0]}",
        ": given a mapping of near; allowed: near: [x, y, z] and within: a distance, together",
    ),
    "no point": (
        "{within: 0.1}",
        ": given a mapping of within; allowed: near: [x, y, z] and within: a distance, together",
    ),
    "a distance below 0": (
        "{near: [0, 0.02, 0], within: -1}",
        ".within: given -1; allowed: a number greater than 0",
    ),
    "a flat point": ("{near: [0, 0.02], within: 1}", ".near: given [0, 0.02]; allowed: a list of 3 numbers"),
    "off the object": (
        "{near: [0, 0.05, 0], within: 0.01}",
        ".within: given 0.01; allowed: at least 0.03 m, at which the object's surface is from [0.0, 0.05, 0.0]",
    ),
    "an unknown field": (
        "{near: [0, 0.02, 0], within: 0.01, off: 3}",
        ".off: given an unknown field; allowed: near, within, on, not_on",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case: str) -> None:
    written, told = REFUSED[case]
    assert message(GOOD.replace(FINGERS, f"{written}\n")) == f"wrong.yaml:{told}"


@pytest.mark.parametrize("case", REGIONS)
def test_regions_refused(case: str) -> None:
    written, told = REGIONS[case]
    assert message(NAMED.replace("[0, 0.02, -0.01]", written)) == f"wrong.yaml:15: fingers.thumb.touches{told}"


def test_shapes_without_names_are_named_first() -> None:
    told = message(GOOD.replace("[0, 0.02, -0.01]", "{on: bar}"))
    assert told.endswith("none has any: give it one, as in `sphere: {..., name: knob}`")


def test_optional_is_a_flag() -> None:
    told = message(GOOD.replace("{touches: [0, 0.02, -0.01]}", "{touches: [0, 0.02, -0.01], optional: 3}"))
    assert told == "wrong.yaml:15: fingers.thumb.optional: given 3; allowed: true or false"


def test_a_finger_whose_point_is_given_is_not_optional() -> None:
    told = message(GOOD.replace("{touches: [0, 0.02, -0.01]}", "{touches: [0, 0.02, -0.01], optional: true}"))
    assert told.startswith("wrong.yaml:15: fingers.thumb: ")
    assert told.endswith(
        "allowed: `optional` beside a region or `anywhere`: a finger whose point is given is always built"
    )
