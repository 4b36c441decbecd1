"""Joints that hardly move are left out where a hand without them is certified; nothing is solved."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from casadi_hands.export.design import Design
from casadi_hands.pipeline.pruning import HOPELESS, Pruner, fewer_joints
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


def pruned(start: Design, certified: dict[tuple[int, ...], Design], score: float = 0.2) -> tuple[Design, Search]:
    search: Any = Search(score)
    record = Record(start.task, None, lambda _: None)
    failed = moving([[MOVING], [MOVING]], "feasible")
    found = Pruner(record, search, lambda candidate: certified.get(candidate.joints, failed)).run(start)
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
