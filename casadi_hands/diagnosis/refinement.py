"""What a refinement that did not become exact was left with, as a reason."""

from __future__ import annotations

from collections.abc import Sequence

from casadi_hands.diagnosis.moment import moment
from casadi_hands.diagnosis.own_terms import unmet_bounds
from casadi_hands.diagnosis.reason import Reason, joints_of
from casadi_hands.problem.model import Model
from casadi_hands.problem.units import Units
from casadi_hands.stages.own_terms import KERNEL
from casadi_hands.stages.refine.result import Refined
from casadi_hands.stages.refine.settings import ACCEPTED
from casadi_hands.terms import constraints as limits

_JOINTS = "more joints (search.max_joints)"
# Bounds of variables: what to say of them, and the field that they come from.
_BOUNDS = {
    "angles": ("are the limits of the joints of {}", "hand.joint_limits"),
    "lengths": ("is how long or short links of {} may be", "hand.link_length"),
    "base": ("is that {} must stand on the palm", "palm.radius"),
    "bends": ("is how far links of {} may be bent", "hand.bend"),
    "force": ("is how hard {} may press", "hand.contact_force"),
    "force_disturbed": ("is how hard {} may press", "hand.contact_force"),
    "ratios": ("is what ratios joints of {} may have", "hand.ratios"),
}


def failing_fingers(model: Model, refined: Refined) -> set[str]:
    """Names of the fingers that kept a motion from being exact; none if it cannot be laid to fingers."""
    if refined.met or _misses_own(refined):
        return set()
    if refined.slips_hopelessly:
        most = max(refined.slips.values())
        return {name for name, slip in refined.slips.items() if slip > 0.3 * most}
    return {model.contact_names[contact] for contact in refined.worst.contacts}


def refined_reason(model: Model, refined: Refined) -> list[Reason]:
    """Why a refined motion is not exact; nothing if it is."""
    if refined.exact:
        return []
    if refined.met:
        what = f"fingers can roll with the object over {refined.homotopy:.0%} of the way to its goals, and no farther"
        advice = f"{_JOINTS}, thicker links (hand.link_radius) or a smaller turn of the object"
        return [Reason(what, advice, frozenset(("goal_position", "goal_angle")))]
    joints = {
        model.contact_names[c]: f.joints for c, f in zip(refined.hand.contacts, refined.hand.fingers, strict=True)
    }
    if _misses_own(refined):
        return list(own_reasons(model, refined))
    if refined.slips_hopelessly:
        most = max(refined.slips, key=lambda name: refined.slips[name])
        slip = 1e3 * refined.slips[most] * model.units.length
        what = f"finger '{most}' with {joints_of(joints[most])} cannot roll with the object: it slips {slip:.1f} mm"
        what += _in_the_way(model, refined)
        follow = ("friction_excess", "pull", "unsupplied_force", "disturbance_radius", "penetration")
        return [Reason(what, limits.NO_SLIP.advice, frozenset((*limits.NO_SLIP.explains, *follow)))]
    worst, who = refined.worst, sorted(failing_fingers(model, refined))
    limit = worst.declared
    cannot = limit.cannot or f"meet {worst.constraint}"
    subject = _subject(who)
    when = "" if worst.time is None else f" at {moment(model.schedule, worst.time)}"
    what = (
        f"no exact motion was found with {'+'.join(map(str, joints.values()))} joints: "
        f"{subject} cannot {cannot}{when}{_by(worst.violation, limit.unit, model.units)}{_in_the_way(model, refined)}"
    )
    return [Reason(what, limit.advice or f"{_JOINTS} or slower goals", frozenset(limit.explains))]


def _subject(fingers: Sequence[str]) -> str:
    """``finger 'left'``, ``fingers 'left' and 'right'``, ``the object``."""
    if not fingers:
        return "the object"
    return f"finger{'s' if len(fingers) > 1 else ''} " + " and ".join(f"'{finger}'" for finger in fingers)


def _in_the_way(model: Model, refined: Refined) -> str:
    """Which limit keeps a constraint from being met, where it can be told in a person's words."""
    tight = refined.tightest
    if tight is None:
        return ""
    who = _subject(sorted(model.contact_names[c] for c in tight.contacts if c < model.contacts))
    when = "" if tight.time is None else f" at {moment(model.schedule, tight.time)}"
    if tight.declared is not None:
        return f"; in the way is that {who} must {tight.declared.cannot}{when}" if tight.declared.cannot else ""
    if tight.limit == "pose":
        return f"; in the way is that the object must be{when}"
    if tight.limit not in _BOUNDS:
        return ""
    what, field = _BOUNDS[tight.limit]
    return f"; in the way {what.format(who)} ({field}){when}"


def own_reasons(model: Model, refined: Refined) -> tuple[Reason, ...]:
    """Which bounds of a person's own a refined motion misses."""
    joints = "+".join(str(finger.joints) for finger in refined.hand.fingers)
    before = f"no exact motion was found with {joints} joints: it"
    return unmet_bounds(model, "refine", refined.hand.solution, ACCEPTED, before)


def _misses_own(refined: Refined) -> bool:
    """Whether a bound of a person's own is what a refined motion misses most."""
    return not refined.met and refined.worst.constraint.startswith(f"{KERNEL}.")


def _by(violation: float, unit: str, units: Units) -> str:
    """By how much a constraint is violated, in SI or weights; nothing if that would say nothing to a reader."""
    if unit == "length":
        return f", by {1e3 * violation * units.length:.2g} mm"
    if unit == "force":
        return f", by {violation:.2g} weights"
    if unit == "torque":
        return f", by {violation * units.torque:.2g} N·m"
    return f", by {violation:.2g} rad/s" if unit == "speed" else ""
