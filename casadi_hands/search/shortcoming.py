"""What a finger that stays above the threshold cannot do: reach its contact, or press there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from casadi_hands.kinematics import STAND
from casadi_hands.motion import Schedule
from casadi_hands.reasons import Reason, joints_of
from casadi_hands.search.score import TIP_WEIGHT, worst_miss
from casadi_hands.stages.finger_numbers import contact_kinematics
from casadi_hands.stages.synthesis import Synthesised
from casadi_hands.stages.target import Target

Array = NDArray[np.float64]
# Figures that follow where a finger does not hold its contact, and where it is not even there.
WITHOUT_FORCE = frozenset(
    (
        "residual",
        "residual_between",
        "rest",
        "friction_excess",
        "pull",
        "gap_between",
        "slip",
        "unsupplied_force",
        "disturbance_radius",
    )
)
# Stretched out for its contact a finger may well leave its joints' limits and, which is of the structure, the palm.
WITHOUT_CONTACT = WITHOUT_FORCE | {"gap", "penetration", "joint_limit", "structure"}


def beyond_reach(target: Target, contact: int, joints: int) -> Array:
    """How far (N,) a contact lies beyond the longest finger at each keyframe, half extents; negative within reach.

    The finger stands anywhere on the palm's disc, its links are as long as allowed and in one line, and the contact
    is on its tip's surface. Joint limits and what is in the way only make the true reach smaller.
    """
    points = target.points[:, contact]
    outside = np.maximum(np.hypot(points[:, 0], points[:, 1]) - target.palm_radius, 0.0)
    reach = joints * target.link_length[1] + target.link_radius
    height = points[:, 2] - STAND * target.link_radius
    return np.where(target.active[:, contact], np.hypot(outside, height) - reach, -np.inf)


def shortcoming(target: Target, hand: Synthesised, contact: int, score: float) -> Reason:
    """Say what keeps a finger's score up.

    Args:
        target: what the fingers follow.
        hand: with as many joints as allowed.
        contact: of the finger.
        score: the finger's.
    """
    finger = hand.fingers[hand.contacts.index(contact)]
    who, length = f"finger '{target.model.contact_names[contact]}'", target.model.units.length
    beyond = beyond_reach(target, contact, finger.joints)
    goals = list(target.model.schedule.goals)
    # A goal is what the user can change; what lies between goals is told where only that is out of reach.
    k = goals[int(beyond[goals].argmax())] if beyond[goals].max() > 0 else int(beyond.argmax())
    if beyond[k] > 0:
        longest, when = 1e3 * target.link_length[1] * length, moment(target.model.schedule, target.times[k])
        what = (
            f"{who} cannot reach {when if k in goals else f'its contact at {when}'} with {joints_of(finger.joints)}: "
            f"its contact is {1e3 * beyond[k] * length:.1f} mm beyond links of at most {longest:.1f} mm each"
        )
        return Reason(what, "longer links (hand.link_length), a palm nearer by or a nearer goal", WITHOUT_CONTACT, True)
    points, _ = contact_kinematics(finger, target.string_of(contact), target.link_radius)
    squares = ((points - target.points[:, contact]) ** 2).sum(axis=1)[target.active[:, contact]]
    missing = TIP_WEIGHT * float(squares.mean())
    if missing > score / 2:
        miss, time = worst_miss(target, hand, contact)
        what = (
            f"{who} misses its contact by {1e3 * miss * length:.1f} mm at {moment(target.model.schedule, time)} "
            f"with {joints_of(finger.joints)}"
        )
        return Reason(
            what, "more joints (search.max_joints), more trials or a contact nearer the palm", WITHOUT_CONTACT
        )
    what = (
        f"{who} cannot press as its contact needs with {joints_of(finger.joints)}: no joint supplies "
        f"{score - missing:.2f} weights of the force, on average"
    )
    return Reason(what, "more joints (search.max_joints) or a contact that is pressed from another side", WITHOUT_FORCE)


def moment(schedule: Schedule, time: float) -> str:
    """A time in the task's terms: ``goal 2 (3 s)``, ``2.5 s (between goals 1 and 2)``."""
    times = schedule.keyframes[list(schedule.goals)]
    at = np.flatnonzero(np.abs(times - time) < 1e-6)
    if len(at):
        return f"goal {at[0] + 1} ({time:.3g} s)"
    passed = int((times < time).sum())
    if passed == len(times):
        return f"{time:.3g} s (after the last goal)"
    return f"{time:.3g} s (between goals {passed} and {passed + 1})" if passed else f"{time:.3g} s"
