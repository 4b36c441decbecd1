"""How different hands are, against closed forms and SciPy's rotations."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.pipeline.alternatives.likeness import difference
from tests.export.example import example_hand
from tests.pipeline.alternatives.example import changed, shifted

LENGTH = 0.06


def with_axis(axis: np.ndarray) -> object:
    first, second = example_hand().fingers[2].links
    return changed(2, links=(first, replace(second, axis=tuple(axis))))


def test_a_hand_does_not_differ_from_itself() -> None:
    assert difference(example_hand(), example_hand(), LENGTH) == 0.0


def test_the_largest_difference_counts() -> None:
    first, second = example_hand().fingers[0].links
    longer = changed(0, links=(first, replace(second, length=second.length + 0.012)))
    assert difference(example_hand(), longer, LENGTH) == pytest.approx(0.2)
    assert difference(example_hand(), shifted(-0.009), LENGTH) == pytest.approx(0.15)
    assert difference(shifted(0.009), longer, LENGTH) == pytest.approx(0.2)
    assert difference(longer, shifted(0.009), LENGTH) == pytest.approx(0.2)


@pytest.mark.parametrize("angle", [1e-9, 0.3, np.pi / 2])
def test_axes_differ_by_the_angle_between_them(angle: float) -> None:
    turned = Rotation.from_rotvec([0, 0.6 * angle, 0.8 * angle]).apply([1, 0, 0])
    assert difference(example_hand(), with_axis(turned), LENGTH) == pytest.approx(angle, rel=1e-6)


def test_bends_differ_by_their_distance() -> None:
    first, second = example_hand().fingers[2].links
    hands = [changed(2, links=(first, replace(second, bend=bend))) for bend in ((0.5, 0.1), (0.2, -0.3))]
    assert difference(*hands, LENGTH) == pytest.approx(0.5)
    assert difference(example_hand(), hands[1], LENGTH) == pytest.approx(math.hypot(0.2, 0.3))


def test_an_axis_turned_around_is_the_same_axis() -> None:
    turned = Rotation.from_rotvec([0, 0, 0.25]).apply([-1, 0, 0])
    assert difference(example_hand(), with_axis(turned), LENGTH) == pytest.approx(0.25)


def test_a_scene_ten_times_larger_differs_as_much() -> None:
    def scaled(hand):
        fingers = tuple(
            replace(
                finger,
                base=tuple(10 * x for x in finger.base),
                links=tuple(replace(link, length=10 * link.length) for link in finger.links),
            )
            for finger in hand.fingers
        )
        return replace(hand, fingers=fingers)

    expected = difference(example_hand(), shifted(0.02), LENGTH)
    assert difference(scaled(example_hand()), scaled(shifted(0.02)), 10 * LENGTH) == pytest.approx(expected)


def test_other_fingers_or_joints_make_another_hand() -> None:
    hand = example_hand()
    assert difference(hand, changed(1, links=hand.fingers[1].links[:1]), LENGTH) == math.inf
    assert difference(hand, replace(hand, fingers=hand.fingers[:2]), LENGTH) == math.inf
    assert difference(hand, changed(1, name="ring"), LENGTH) == math.inf
