"""Palms that do not stand where their fingers have the object in reach, goal by goal."""

from __future__ import annotations

import pytest

from tests.diagnosis.balls import PALM, seen, told

AT = "position: [0, 0, 0.2]"
RADIUS = 0.003432  # of links, m


@pytest.mark.parametrize(
    ("palm", "better"),
    [
        ("position: [0.15, 0, 0.2], facing: [1, 0, 0]", "[-1, 0, 0]"),
        ("position: [0, 0, 0.3], facing: [0.7, 0, 0.7]", "[0, 0, -1]"),
        ("position: [0, 0, 0.1], facing: [0, 0, -1]", "[0, 0, 1]"),
    ],
)
def test_a_palm_that_faces_away_is_told_where_to_face(palm: str, better: str) -> None:
    text, certain = told(seen(palm, [AT, AT]))
    assert certain
    assert text.startswith("the object is behind the palm at every goal, by ")
    assert text.endswith(f"try palm.facing {better}")


def test_an_object_that_goes_behind_the_palm_s_disc() -> None:
    text, certain = told(seen(goals=[AT, "position: [0, 0, 0.4]"]))
    assert certain
    assert text.startswith("the object is behind the palm at goal 2 (3 s), by 78 mm; try")
    # Beside the disc some finger may reach it.
    text, certain = told(seen(goals=[AT, "position: [0.1, 0, 0.4]"]))
    assert not certain
    assert "behind the palm at goal 2" in text
    assert seen(goals=[AT, "position: [0.1, 0, 0.3]"]) == []


def test_a_palm_that_turns_away_on_its_way() -> None:
    text, certain = told(seen(f"{PALM}, motion: [{{at: 3, position: [0, 0, 0.3], facing: [0, 0, 1]}}]", [AT, AT]))
    assert certain
    assert text.startswith("the object is behind the palm at goal 2 (3 s), by 78 mm")


def test_an_object_beside_the_palm() -> None:
    found = seen("position: [0, 0, 0.3], facing: [1, 0, 0]")
    assert not any(each.certain for each in found)
    assert found[0].reason.what.endswith("(palm.facing), and it is 90° off")
    assert found[0].reason.advice == "palm.facing [0, 0, -1]"


@pytest.mark.parametrize(("short", "reaches"), [(0.001, True), (-0.001, False)])
def test_out_of_reach_at_one_goal_only(short: float, reaches: bool) -> None:
    # The palm's radius, three links of 0.1 and the tip's radius reach 0.329832; the ball's top is 0.022 up.
    far = f"position: [0, 0, {0.3 - 0.329832 - 0.022 + short}]"
    found = seen(goals=[AT, far, AT], more=f"hand: {{link_radius: {RADIUS}, link_length: [0.02, 0.1]}}")
    assert [each.certain for each in found] == ([] if reaches else [True])
    assert all("out of reach at goal 2 (3 s): it is 330.8 mm from" in each.reason.what for each in found)


def test_a_palm_that_leaves_its_object() -> None:
    leaves = f"{PALM}, motion: [{{at: 3, position: [0, 0, 1.3]}}]"
    text, certain = told(seen(leaves, [AT, AT], more=f"hand: {{link_radius: {RADIUS}, link_length: [0.02, 0.1]}}"))
    assert certain
    assert text.startswith("the object is out of reach at goal 2 (3 s): it is 1078 mm from the palm's centre")
    assert "reaches 329.8 mm" in text


def test_a_palm_that_moves_into_its_object() -> None:
    text, certain = told(seen(f"{PALM}, motion: [{{at: 3, position: [0, 0, 0.2]}}]", [AT, "position: [0, 0, 0.19]"]))
    assert certain
    assert text.startswith("the object is 12 mm inside the palm at goal 2 (3 s); try")


def test_a_contact_farther_from_the_rim_than_a_finger_is_long() -> None:
    # One link of 40 mm and a tip of 3.4 mm; the nearest of the ball's points is 78 mm below a palm of 80 mm radius.
    wide = "radius: 0.08, position: [0, 0, 0.3], facing: [0, 0, -1]"
    hand = "hand: {link_length: [0.02, 0.04], link_radius: 0.003432}\nsearch: {max_joints: 1}"
    found = seen(wide, [AT, AT], more=hand)
    assert found[0].certain
    # From the rim at 80 mm, 1.05 tips below the palm, to (22, 0, -100) mm: √(58² + 96.4²) = 112.5 mm.
    assert "that is 112.5 mm from the nearest place for its first joint on the palm's rim" in found[0].reason.what
    assert "(fingers.f0.touches), and a finger of 1 links of" in found[0].reason.what
    assert found[0].reason.what.endswith("reaches 43.43 mm")
