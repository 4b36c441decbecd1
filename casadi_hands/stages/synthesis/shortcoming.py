"""What a finger that stays above the threshold cannot do: reach its contact, or press there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from casadi_hands.kinematics import STAND
from casadi_hands.kinematics.numeric import contact_kinematics
from casadi_hands.stages.synthesis.score import TIP_WEIGHT, worst_miss
from casadi_hands.stages.synthesis.stage import Synthesised
from casadi_hands.stages.synthesis.target import Target

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shortcoming:
    """What keeps a finger's score up.

    Attributes:
        kind: ``reach``: its contact is beyond its longest links; ``miss``: it is not where its contact is; ``press``:
            its joints supply too little of its force.
        contact: index of the finger's contact.
        joints: of the finger.
        by: lengths beyond reach or missed, or the mean force that no joint actuates, m·g.
        time: s, when this is worst; None of a mean.
    """

    kind: Literal["reach", "miss", "press"]
    contact: int
    joints: int
    by: float
    time: float | None = None


def beyond_reach(target: Target, contact: int, joints: int) -> Array:
    """How far (N,) a contact lies beyond the longest finger at each keyframe, lengths; negative within reach.

    The finger stands anywhere on the palm's disc, its links are as long as allowed and in one line, and the contact
    is on its tip's surface. Joint limits and what is in the way only make the true reach smaller.
    """
    points = target.points[:, contact]
    outside = np.maximum(np.hypot(points[:, 0], points[:, 1]) - target.palm_radius, 0.0)
    radii = target.radii(joints)
    reach = joints * target.link_length[1] + radii[-1]
    height = points[:, 2] - STAND * radii[0]
    return np.where(target.active[:, contact], np.hypot(outside, height) - reach, -np.inf)


def shortcoming(target: Target, hand: Synthesised, contact: int, score: float) -> Shortcoming:
    """Find what keeps a finger's score up.

    Args:
        target: what the fingers follow.
        hand: with as many joints as allowed.
        contact: of the finger.
        score: the finger's.
    """
    finger = hand.fingers[hand.contacts.index(contact)]
    beyond = beyond_reach(target, contact, finger.joints)
    goals = list(target.model.schedule.goals)
    # A goal is what the user can change; what lies between goals is told where only that is out of reach.
    k = goals[int(beyond[goals].argmax())] if beyond[goals].max() > 0 else int(beyond.argmax())
    if beyond[k] > 0:
        return Shortcoming("reach", contact, finger.joints, float(beyond[k]), float(target.times[k]))
    points, _ = contact_kinematics(finger, target.string_of(contact), target.radii(finger.joints))
    squares = ((points - target.points[:, contact]) ** 2).sum(axis=1)[target.active[:, contact]]
    missing = TIP_WEIGHT * float(squares.mean())
    if missing > score / 2:
        return Shortcoming("miss", contact, finger.joints, *worst_miss(target, hand, contact))
    return Shortcoming("press", contact, finger.joints, score - missing)
