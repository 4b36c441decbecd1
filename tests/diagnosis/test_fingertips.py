"""Fingertips without room where they touch."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnosis.balls import PALM, RADIUS, ring, seen, told

TIP = 0.003
HAND = f"hand: {{link_radius: {TIP}}}"


def pair(apart: float) -> list[list[float]]:
    """Contacts on the equator, the first two with tips whose centres are so many link diameters apart, and a third."""
    angle = 2 * np.arcsin(apart * TIP / (RADIUS + TIP))
    at = [0.0, float(np.degrees(angle)), 180.0]
    return [[float(RADIUS * np.cos(np.radians(a))), float(RADIUS * np.sin(np.radians(a))), 0.0] for a in at]


@pytest.mark.parametrize(("apart", "certain"), [(0.3, True), (0.74, True), (0.76, False), (0.99, False)])
def test_fingertips_in_each_other(apart: float, certain: bool) -> None:
    text, sure = told(seen(touches=pair(apart), more=HAND))
    assert sure is certain
    assert text.startswith(f"the fingertips of 'f0' and 'f1' overlap by {6 * (1 - apart):.4g} mm where they touch")
    # What is advised does.
    thinner = float(text.rsplit(" ", 1)[1])
    assert seen(touches=pair(apart), more=f"hand: {{link_radius: {thinner}}}") == []


def test_thick_fingertips_in_each_other_are_told_of_by_their_own_field() -> None:
    # Links of 2 mm would have room.
    assert seen(touches=pair(0.76), more="hand: {link_radius: 0.002}") == []
    hand = "hand: {link_radius: 0.0015}\nfingertip: {radius: "
    text, sure = told(seen(touches=pair(0.7), more=f"{hand}{TIP}}}"))
    assert sure
    assert "and fingertips are 6 mm thick (2 × fingertip.radius)" in text
    name, thinner = text.rsplit(" ", 3)[1], float(text.rsplit(" ", 1)[1])
    assert name == "fingertip.radius"
    assert seen(touches=pair(0.7), more=f"{hand}{thinner}}}") == []
    # Where links are too thick for it, too, they are named.
    text, _ = told(seen(touches=pair(0.4), more=f"{hand}{TIP}}}"))
    assert "fingertip.radius and hand.link_radius below 0.00" in text


def test_fingertips_beside_each_other() -> None:
    assert seen(touches=pair(1.01), more=HAND) == []


def test_a_contact_under_an_object_on_the_ground() -> None:
    goals = [f"position: [0, 0, {RADIUS}]", "position: [0, 0, 0.05]"]
    palm = "radius: 0.0264, position: [0, 0, 0.12], facing: [0, 0, -1]"
    under = [*ring(0, 0), [0.0, 0.0, -RADIUS]]
    text, certain = told(seen(palm, goals, under, f"ground: {{}}\n{HAND}"))
    assert certain
    assert text.startswith("the fingertip of 'f2', 3 mm in radius (hand.link_radius), is 6 mm inside the ground at the")
    # Off the ground it has room, though it is a long way around.
    text, certain = told(
        seen(palm, ["position: [0, 0, 0.04]", "position: [0, 0, 0.05]"], under, f"ground: {{}}\n{HAND}")
    )
    assert not certain
    assert "away from the palm, 180° around (fingers.f2.touches)" in text


def test_a_contact_beside_an_object_on_the_ground_has_room() -> None:
    goals = [f"position: [0, 0, {RADIUS}]", "position: [0, 0, 0.05]"]
    palm = "radius: 0.0264, position: [0, 0, 0.12], facing: [0, 0, -1]"
    assert seen(palm, goals, more=f"ground: {{}}\n{HAND}") == []


def test_a_contact_between_object_and_palm() -> None:
    near = "radius: 0.0264, position: [0, 0, 0.225], facing: [0, 0, -1]"
    goals = ["position: [0, 0, 0.2]", "position: [0, 0, 0.15]"]
    first = seen(near, goals, [*ring(0, 0), [0, 0, RADIUS]], HAND)[0]
    assert not first.certain  # the palm leaves room beside itself, where the contact may be moved
    assert "is 3 mm inside the palm at the start" in first.reason.what


@pytest.mark.parametrize(("elevation", "around"), [(-44.0, False), (-46.0, True)])
def test_contacts_around_the_object(elevation: float, around: bool) -> None:
    found = seen(touches=ring(elevation, elevation, elevation), more=HAND)
    assert [each.certain for each in found] == [False] * around
    assert all(f"{90 - elevation:.0f}° around" in each.reason.what for each in found)


def test_a_palm_below_sees_it_from_there() -> None:
    below = "radius: 0.0264, position: [0, 0, 0.1], facing: [0, 0, 1]"
    assert below != PALM
    assert seen(below, touches=ring(-60, -60, -60), more=HAND) == []
