"""What a refinement that did not become exact was left with, as a reason."""

from __future__ import annotations

import re
from dataclasses import dataclass

from casadi_hands.reasons import Reason, joints_of
from casadi_hands.search.shortcoming import moment
from casadi_hands.stages.model import Model, Units
from casadi_hands.stages.refine import Refined


@dataclass(frozen=True)
class _Limit:
    """What a violated constraint of the refinement means.

    Attributes:
        cannot: continues ``finger 'x' cannot ...``.
        unit: of the violation: ``length``, ``force``, ``torque``, ``speed``, or none that a reader would know.
        advice: what to try.
        explains: figures of the audit that follow.
    """

    cannot: str
    unit: str
    advice: str
    explains: tuple[str, ...]


_JOINTS = "more joints (search.max_joints)"
_REACH = f"{_JOINTS} or a contact on the palm's side of the object"
_ROOM = "thinner links (hand.link_radius), a palm farther away or contacts farther apart"
_GRIP = "more friction or contacts that oppose each other better"
_TORQUE = "stronger motors (actuator.torque), a lighter object or more friction"
_SIDE = f"{_JOINTS} or a contact that is pressed from another side"
_PACE = "slower goals, more friction or more fingers"
_PUSHED = "weaker perturbations, more friction or more fingers"
_BALANCE, _GAP = ("residual", "residual_between"), ("gap", "gap_between")
_MOVED = _Limit("be moved as planned by the forces of its contacts", "", _PACE, _BALANCE)
_CLEAR = _Limit("stay clear of the other bodies", "length", _ROOM, ("penetration",))
_EACH_OTHER = _Limit("stay clear of each other", "length", _ROOM, ("penetration",))
_GROUND = _Limit(
    "rest on the ground as planned", "", "goals at which it stands on the ground, or a rougher one", (*_GAP, "slip")
)
_LIMITS = {  # by the constraint's kernel, without the finger's number, and name
    "physics.defect": _MOVED,
    "wrench.sum": _MOVED,
    "middle_torque.sum": _MOVED,
    "equilibrium.sum": _Limit("be held still at the start and the end", "", _PACE, _BALANCE),
    "pushed.sum": _Limit("stay on its path under the perturbation", "", _PUSHED, ("disturbance_radius",)),
    "contact.on_object": _Limit("stay on the object's surface", "length", _REACH, (*_GAP, *_BALANCE, "slip")),
    "contact.on_link": _Limit("reach its contact", "length", _REACH, (*_GAP, *_BALANCE, "slip")),
    "contact.regular": _Limit("follow without being stretched out or folded", "", _REACH, (*_GAP, "slip")),
    "contact.pressing": _Limit("press firmly enough", "force", _GRIP, ("pull",)),
    "contact.cone": _Limit("press without slipping", "", _GRIP, ("friction_excess", "slip")),
    "contact.passive": _Limit("supply its force with its joints", "force", _SIDE, ("unsupplied_force",)),
    "contact.torque": _Limit(
        "supply its force within the torque limit", "torque", _TORQUE, ("torque", "unsupplied_force")
    ),
    "midway.passive": _Limit("supply its force with its joints", "force", _SIDE, ("unsupplied_force",)),
    "ground_held.pressing": _Limit("stay pressed on the ground under the perturbation", "force", _PUSHED, ()),
    "ground_held.cone": _Limit("stand on the ground without slipping under the perturbation", "", _PUSHED, ()),
    "held.pressing": _Limit("keep pressing under the perturbation", "force", _PUSHED, ()),
    "held.cone": _Limit("hold without slipping under the perturbation", "", _PUSHED, ()),
    "held.passive": _Limit("supply its force under the perturbation", "force", _SIDE, ()),
    "held.torque": _Limit("supply its force under the perturbation", "torque", _TORQUE, ()),
    "rolling.no_slip": _Limit(
        "roll with the object", "length", f"{_JOINTS} or a smaller turn of the object", ("slip", *_GAP, *_BALANCE)
    ),
    "apart.clear": _CLEAR,
    "apart_touching.clear": _CLEAR,
    "apart_between.clear": _CLEAR,
    "fingers_apart.clear": _EACH_OTHER,
    "fingers_between.clear": _EACH_OTHER,
    "object_apart.palm": _Limit("stay clear of the palm", "length", "goals farther from the palm", ("penetration",)),
    "object_apart.ground": _Limit("stay above the ground", "length", "goals above the ground", ("penetration",)),
    "tool_point.on_path": _Limit("draw its path", "length", _PACE, ("goal_position",)),
    "joint_motion.speed": _Limit(
        "keep within the joints' speed limit", "speed", "faster motors (actuator.speed) or slower goals", ("speed",)
    ),
    "stay.on_palm": _Limit("start on the palm", "", "a larger palm (palm.radius)", ()),
    "ground_rolling.no_slip": _Limit(
        "stand on the ground without slipping", "length", "a rougher ground (ground.friction)", (*_GAP, "slip")
    ),
    **dict.fromkeys(
        (f"ground.{constraint}" for constraint in ("on_surfaces", "opposed", "facing", "pressing", "cone")), _GROUND
    ),
}


def failing_fingers(model: Model, refined: Refined) -> set[str]:
    """Names of the fingers that kept a motion from being exact; none if it cannot be laid to fingers."""
    if refined.met:
        return set()
    if refined.slips_hopelessly:
        most = max(refined.slips.values())
        return {name for name, slip in refined.slips.items() if slip > 0.3 * most}
    numbers = map(int, re.findall(r"\d+", refined.worst.constraint.split(".")[0]))
    return {model.contact_names[number] for number in numbers if number < model.contacts}


def refined_reason(model: Model, refined: Refined) -> list[Reason]:
    """Why a refined motion is not exact; nothing if it is."""
    if refined.exact:
        return []
    if refined.met:
        what = f"fingers can roll with the object over {refined.share:.0%} of the way to its goals, and no farther"
        advice = f"{_JOINTS}, thicker links (hand.link_radius) or a smaller turn of the object"
        return [Reason(what, advice, frozenset(("goal_position", "goal_angle")))]
    joints = {
        model.contact_names[c]: f.joints for c, f in zip(refined.hand.contacts, refined.hand.fingers, strict=True)
    }
    if refined.slips_hopelessly:
        most = max(refined.slips, key=lambda name: refined.slips[name])
        slip = 1e3 * refined.slips[most] * model.units.length
        what = f"finger '{most}' with {joints_of(joints[most])} cannot roll with the object: it slips {slip:.1f} mm"
        follow = ("friction_excess", "pull", "unsupplied_force", "disturbance_radius", "penetration")
        rolling = _LIMITS["rolling.no_slip"]
        return [Reason(what, rolling.advice, frozenset((*rolling.explains, *follow)))]
    worst, who = refined.worst, sorted(failing_fingers(model, refined))
    kernel, constraint = worst.constraint.split(".")
    limit = _LIMITS.get(f"{re.sub(r'[0-9_]+$', '', kernel)}.{constraint}")
    if limit is None:
        limit = _Limit(f"meet {worst.constraint}", "", f"{_JOINTS} or slower goals", ())
    fingers = " and ".join(f"'{finger}'" for finger in who)
    subject = f"finger{'s' if len(who) > 1 else ''} {fingers}" if who else "the object"
    when = "" if worst.time is None else f" at {moment(model.schedule, worst.time)}"
    what = (
        f"no exact motion was found with {'+'.join(map(str, joints.values()))} joints: "
        f"{subject} cannot {limit.cannot}{when}{_by(worst.violation, limit.unit, model.units)}"
    )
    return [Reason(what, limit.advice, frozenset(limit.explains))]


def _by(violation: float, unit: str, units: Units) -> str:
    """By how much a constraint is violated, in SI or weights; nothing if that would say nothing to a reader."""
    if unit == "length":
        return f", by {1e3 * violation * units.length:.2g} mm"
    if unit == "force":
        return f", by {violation:.2g} weights"
    if unit == "torque":
        return f", by {violation * units.torque:.2g} N·m"
    return f", by {violation:.2g} rad/s" if unit == "speed" else ""
