"""How different two hands for one task are."""

from __future__ import annotations

import math

import numpy as np

from casadi_hands.problem.hand import Finger, Hand

ALIKE = 0.3
"""Hands that differ by less are near-duplicates: 0.3 of half the object's extent, or 17 degrees, hardly show."""


def difference(first: Hand, second: Hand, length: float) -> float:
    """How different two hands are: the largest difference of any finger's base, link's length, bend or joint's axis.

    Distances of bases and differences of lengths are over ``length``, angles between axes and differences of bends in
    rad. An axis is a line: turned around, the joint counts its angle the other way and moves in the same way.

    Args:
        first: a hand.
        second: another.
        length: half the object's largest extent, m.

    Returns:
        The difference, without unit; infinite where the fingers or their numbers of joints differ.
    """
    if _structure(first) != _structure(second):
        return math.inf
    fingers = zip(first.fingers, second.fingers, strict=True)
    return max((_finger_difference(one, other, length) for one, other in fingers), default=0.0)


def _structure(hand: Hand) -> list[tuple[str, int]]:
    return [(finger.name, len(finger.links)) for finger in hand.fingers]


def _finger_difference(first: Finger, second: Finger, length: float) -> float:
    parts = [math.dist(first.base, second.base) / length]
    for one, other in zip(first.links, second.links, strict=True):
        parts.append(abs(one.length - other.length) / length)
        parts.append(math.dist(one.bend, other.bend))
        # By sine and cosine: the arc cosine alone loses small angles.
        sine = float(np.linalg.norm(np.cross(one.axis, other.axis)))
        parts.append(math.atan2(sine, abs(float(np.dot(one.axis, other.axis)))))
    return max(parts)
