"""Designs that differ from the example of the export in one thing each."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from casadi_hands.export.design import Design
from casadi_hands.problem.hand import Finger, Hand
from tests.export.example import example_design, example_hand, example_motion


def figure(value: float | None, limit: float | None, holds: bool = True) -> dict[str, Any]:
    return {"value": value, "limit": limit, "holds": holds, "unit": "", "where": ""}


def certified(hand: Hand | None = None, friction_use: float = 0.5, torque: float = 0.1) -> Design:
    """A certified design with a share of friction in use and a largest torque (N·m)."""
    return replace(
        example_design(),
        status="certified",
        reason="",
        hand=hand or example_hand(),
        certificate={"friction_use": figure(friction_use, None), "torque": figure(torque, None)},
    )


def without_hand() -> Design:
    """What there is after the first stage: the object's motion."""
    free = replace(example_motion(), joint_angles=np.zeros((21, 0)), joint_names=())
    return replace(example_design(), hand=None, motion=free, certificate={})


def changed(finger: int, **changes: Any) -> Hand:
    """The example's hand with fields of one finger changed."""
    hand = example_hand()
    fingers: list[Finger] = list(hand.fingers)
    fingers[finger] = replace(fingers[finger], **changes)
    return replace(hand, fingers=tuple(fingers))


def shifted(by: float, finger: int = 1) -> Hand:
    """The example's hand with the base of one finger moved along x, m."""
    x, y, z = example_hand().fingers[finger].base
    return changed(finger, base=(x + by, y, z))
