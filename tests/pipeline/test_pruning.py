"""Joints are left out where a hand without them is certified; nothing is solved."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from casadi_hands.export.design import Design
from casadi_hands.pipeline.pruning import HOPELESS, Pruner, fewer_joints, spare_joints
from casadi_hands.pipeline.record import Record
from tests.export.example import example_hand, example_motion, example_task

MOVING = 30.0


def moving(degrees: list[list[float]], status: Any = "certified") -> Design:
    """A design whose fingers' joints move so far."""
    hand, motion = example_hand(), example_motion()
    fingers = tuple(
        replace(finger, links=finger.links[:1] * len(moved))
        for finger, moved in zip(hand.fingers, degrees, strict=False)
    )
    angles = np.radians(np.outer([0, 1], np.concatenate(degrees)))
    return Design(
        example_task(),
        status,
        hand=replace(hand, fingers=fingers),
        motion=replace(motion, joint_angles=angles),
    )


@pytest.mark.parametrize(
    ("degrees", "tried"),
    [
        ([[MOVING, MOVING], [MOVING, 5.1]], []),
        ([[MOVING, MOVING], [MOVING, 4.9]], [(2, 1)]),
        ([[MOVING], [0.0]], []),
        ([[1.0, MOVING, 2.0], [0.5, MOVING]], [(2, 1), (2, 2), (3, 1)]),
        ([[1.0, 2.0], [3.0, 4.0]], [(1, 1), (1, 2)]),
    ],
)
def test_fingers_with_idle_joints_are_to_have_one_less(
    degrees: list[list[float]], tried: list[tuple[int, ...]]
) -> None:
    assert fewer_joints(moving(degrees)) == tried


@pytest.mark.parametrize(
    ("degrees", "tried"),
    [
        ([[MOVING, MOVING], [MOVING]], []),
        ([[MOVING, MOVING, MOVING], [MOVING, 1.0]], [(2, 2)]),
        ([[40, 50, 60], [50, 20, 60]], [(2, 2), (3, 2), (2, 3)]),
        ([[20, 50, 60, 70], [50, 40, 60]], [(3, 2), (3, 3), (4, 2)]),
    ],
)
def test_fingers_of_more_than_two_joints_may_have_one_to_spare(
    degrees: list[list[float]], tried: list[tuple[int, ...]]
) -> None:
    assert spare_joints(moving(degrees)) == tried


class Search:
    """Hands as they are asked for."""

    contacts = (0, 1)

    def __init__(self, score: float) -> None:
        self.asked, self.score = list[dict[int, int]](), score

    def with_joints(self, joints: dict[int, int]) -> list[Any]:
        self.asked.append(joints)
        return [SimpleNamespace(joints=tuple(joints.values()), scores=(0.1, self.score))]

    def take_runs(self) -> list[Any]:
        return [{"stage": "synthesis"}]


def pruned(
    start: Design,
    certified: dict[tuple[int, ...], Design],
    score: float = 0.2,
    spare: bool = False,
    failed: list[tuple[int, ...]] | None = None,
) -> tuple[Design, Search]:
    search: Any = Search(score)
    record = Record(start.task, None, lambda _: None)
    refused = moving([[MOVING], [MOVING]], "feasible")

    def certify(candidate: Any) -> Design:
        return certified.get(candidate.joints, refused)

    found = Pruner(record, search, certify, spare, failed or ()).run(start)
    assert len(record.design.stages) == len(search.asked)
    return found, search


def test_hands_are_made_simpler_until_all_joints_move() -> None:
    start = moving([[MOVING, 1.0, MOVING], [2.0, MOVING]])
    simpler = moving([[MOVING, 1.0], [MOVING]])
    simplest = moving([[MOVING], [MOVING]])
    found, search = pruned(start, {(2, 1): simpler, (1, 1): simplest})
    assert found is simplest
    assert search.asked == [{0: 2, 1: 1}, {0: 1, 1: 1}]


@pytest.mark.parametrize("few", [False, True])
def test_where_all_at_once_are_not_certified_some_are_tried(few: bool) -> None:
    start = moving([[MOVING, 2.0, MOVING], [1.0, MOVING]])
    two = moving([[MOVING, MOVING], [MOVING, MOVING]])
    one = moving([[MOVING, MOVING, MOVING], [MOVING]])
    found, search = pruned(start, {(3, 1): one} if few else {(2, 2): two})
    assert found is (one if few else two)
    assert search.asked == [{0: 2, 1: 1}, {0: 2, 1: 2}, {0: 3, 1: 1}][: 3 if few else 2]


def test_the_hand_stays_where_none_with_fewer_is_certified() -> None:
    start = moving([[MOVING, 1.0], [2.0, MOVING]])
    found, search = pruned(start, {})
    assert found is start
    assert search.asked == [{0: 1, 1: 1}, {0: 1, 1: 2}]


def test_fingers_that_leave_the_object_to_their_structure_are_not_refined() -> None:
    start, simple = moving([[MOVING, 1.0], [MOVING, MOVING]]), moving([[MOVING], [MOVING, MOVING]])
    assert pruned(start, {(1, 2): simple}, HOPELESS + 0.01)[0] is start
    assert pruned(start, {(1, 2): simple}, HOPELESS - 0.01)[0] is simple


def test_only_certified_hands_are_made_simpler() -> None:
    start = moving([[MOVING, 1.0], [MOVING, MOVING]], "feasible")
    found, search = pruned(start, {})
    assert found is start
    assert search.asked == []


def of(*joints: int, moved: float = MOVING) -> Design:
    """A design with so many joints a finger, which all move."""
    return moving([[moved] * n for n in joints])


def asked(search: Search) -> list[tuple[int, ...]]:
    return [tuple(joints.values()) for joints in search.asked]


def test_fewer_joints_are_tried_where_hands_with_them_may_do() -> None:
    start, fewer = of(3, 3), of(2, 3)
    found, search = pruned(start, {(2, 3): fewer}, spare=True)
    assert found is fewer
    # From there not 2+2 again.
    assert asked(search) == [(2, 2), (2, 3)]
    assert pruned(start, {(2, 3): fewer})[0] is start


def test_what_was_not_certified_is_not_tried_again_nor_what_has_fewer_joints_everywhere() -> None:
    start, fewer = of(4, 3), of(3, 3)
    found, search = pruned(start, {(3, 3): fewer}, spare=True, failed=[(3, 2)])
    assert found is fewer
    # Nor is 2+2, as no finger of it has more joints than with 3+2.
    assert asked(search) == [(3, 3), (2, 3)]


def test_an_idle_joint_goes_whatever_came_of_hands_with_more() -> None:
    start, fewer = moving([[MOVING, MOVING], [MOVING, 1.0]]), moving([[MOVING, MOVING], [MOVING]])
    found, search = pruned(start, {(2, 1): fewer}, spare=True, failed=[(2, 3)])
    assert found is fewer
    assert asked(search) == [(2, 1)]
    assert pruned(start, {(2, 1): fewer}, failed=[(2, 1)])[0] is start


def test_another_hand_that_failed_with_as_many_joints_says_nothing() -> None:
    start, fewer = of(3, 3), of(2, 2)
    found, search = pruned(start, {(2, 2): fewer}, spare=True, failed=[(3, 3)])
    assert found is fewer
    assert asked(search) == [(2, 2)]
