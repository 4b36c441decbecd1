"""What stages, statics and the audit find wanting, as reasons."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from casadi_hands.design import Design, Hand
from casadi_hands.pipeline.holding import HELD, MOST_GRIP, grips, least_friction, least_torque
from casadi_hands.reasons import Reason, joints_of
from casadi_hands.search.shortcoming import moment
from casadi_hands.stages.floating import Floating
from casadi_hands.stages.model import Model, Units
from casadi_hands.stages.refine import Refined
from casadi_hands.verify import Audit
from casadi_hands.verify.report import Figure, show

_BALANCE = frozenset(("residual", "residual_between"))
_GRIP = _BALANCE | {"friction_excess", "pull", "gap_between", "slip", "unsupplied_force", "disturbance_radius"}


def friction_reason(model: Model, floating: Floating) -> Reason | None:
    """Whether the contacts cannot hold the object with this friction, or only with fingers that press very hard."""
    found = grips(model, floating)
    k = int(np.argmax([np.linalg.norm(grip.missing) for grip in found]))
    worst, when = found[k], moment(model.schedule, model.schedule.keyframes[k])
    if not worst.held:
        force, torque = (float(np.linalg.norm(part)) for part in (worst.missing[:3], worst.missing[3:]))
        missing = [f"a force of {force:.2f} weights"] if force > HELD / 2 else []
        missing += [f"a torque of {1e3 * torque * model.units.torque:.3g} mN·m"] if torque > HELD / 2 else []
        what = (
            f"at {when} the contacts cannot hold the object with friction {model.friction:g}: "
            f"{' and '.join(missing)} {'are' if len(missing) > 1 else 'is'} missing"
        )
    else:
        k = int(np.argmax([grip.hardest for grip in found]))
        worst, when = found[k], moment(model.schedule, model.schedule.keyframes[k])
        if worst.hardest <= MOST_GRIP:
            return None
        what = (
            f"at {when} the contacts hold the object with friction {model.friction:g} only if they press with "
            f"{worst.hardest:.1f} weights and more"
        )
    least = least_friction(model, floating)
    contacts = "contacts that surround the object better or oppose each other"
    advice = contacts if least is None else f"friction of at least {least:.2g}, or {contacts}"
    return Reason(what, advice, _GRIP | {"torque"}, root=True)


def torque_reason(model: Model, design: Design) -> Reason | None:
    """Whether holding the object as in a design's motion takes more torque than the motors have."""
    if design.task.actuator is None or design.hand is None:
        return None
    load = least_torque(model, design)
    given = design.task.actuator.torque
    if load is None or load.torque <= given:
        return None
    who = f"joint finger{load.finger}_joint{load.joint} of finger '{design.hand.fingers[load.finger].name}'"
    what = (
        f"{who} needs {load.torque:.3g} N·m at {moment(model.schedule, load.time)} however the hand found shares the "
        f"load, and the motors give {given:.3g} N·m"
    )
    advice = "stronger motors (actuator.torque), a lighter object, more friction or a palm nearer by"
    return Reason(what, advice, _GRIP | {"torque", "gap"}, root=True)


def speed_reason(model: Model, design: Design) -> Reason | None:
    """Whether a design's motion, which no limit of speed was asked of, is faster than its motors."""
    actuator, motion, hand = design.task.actuator, design.motion, design.hand
    if actuator is None or motion is None or hand is None:
        return None
    speeds = np.abs(np.diff(motion.joint_angles, axis=0)) / np.diff(motion.time)[:, None]
    k, j = np.unravel_index(int(speeds.argmax()), speeds.shape)
    if speeds[k, j] <= actuator.speed:
        return None
    what = (
        f"{_with_finger(f'joint {motion.joint_names[j]}', hand)} turns with {speeds[k, j]:.3g} rad/s at "
        f"{moment(model.schedule, motion.time[k])} in the motion found, and the motors give {actuator.speed:.3g} rad/s"
    )
    return Reason(what, "faster motors (actuator.speed) or slower goals", frozenset(("speed",)))


@dataclass(frozen=True)
class _Limit:
    """What a violated constraint of the refinement means.

    Attributes:
        cannot: continues ``finger 'x' cannot ...``.
        unit: of the violation: ``length``, ``force``, ``torque``, or none that a reader would know.
        advice: what to try.
        explains: figures of the audit that follow.
    """

    cannot: str
    unit: str
    advice: str
    explains: frozenset[str]


_REACH = "more joints (search.max_joints) or a contact on the palm's side of the object"
_ROOM = "thinner links (hand.link_radius), a palm farther away or contacts farther apart"
_MOVED = _Limit(
    "be moved as planned by the forces of its contacts", "", "slower goals, more friction or more fingers", _BALANCE
)
_LIMITS = {
    "physics.defect": _MOVED,
    "wrench.sum": _MOVED,
    "middle_torque.sum": _MOVED,
    "contact.on_surfaces": _Limit("reach its contact", "length", _REACH, _BALANCE | {"gap", "gap_between", "slip"}),
    "contact.opposed": _Limit(
        "reach its contact with its surface facing the object's", "", _REACH, frozenset(("gap", "gap_between", "slip"))
    ),
    "contact.facing": _Limit(
        "reach its contact from outside the object", "", _REACH, frozenset(("penetration", "gap", "gap_between"))
    ),
    "contact.pressing": _Limit(
        "press firmly enough", "force", "contacts that oppose each other better, or more friction", frozenset(("pull",))
    ),
    "contact.cone": _Limit(
        "press without slipping", "", "more friction or slower goals", frozenset(("friction_excess", "slip"))
    ),
    "contact.passive": _Limit(
        "supply its force with its joints",
        "force",
        "more joints (search.max_joints) or a contact that is pressed from another side",
        frozenset(("unsupplied_force",)),
    ),
    "contact.torque": _Limit(
        "supply its force within the torque limit",
        "torque",
        "stronger motors (actuator.torque), a lighter object or more friction",
        frozenset(("torque", "unsupplied_force")),
    ),
    "rolling.no_slip": _Limit(
        "roll with the object",
        "length",
        "more joints (search.max_joints) or a smaller turn of the object",
        frozenset(("slip", "gap_between", "residual_between")),
    ),
    "apart.clear": _Limit("stay clear of the other bodies", "length", _ROOM, frozenset(("penetration",))),
    "apart_touching.clear": _Limit("stay clear of the other bodies", "length", _ROOM, frozenset(("penetration",))),
    "fingers_apart.clear": _Limit("stay clear of each other", "length", _ROOM, frozenset(("penetration",))),
    "joint_motion.speed": _Limit(
        "keep within the joints' speed limit",
        "speed",
        "faster motors (actuator.speed) or slower goals",
        frozenset(("speed",)),
    ),
    "stay.on_palm": _Limit("start on the palm", "", "a larger palm (palm.radius)", frozenset()),
}


def failing_fingers(model: Model, refined: Refined) -> set[str]:
    """Names of the fingers that kept a motion from being exact; none if it cannot be laid to fingers."""
    if refined.slips_hopelessly:
        most = max(refined.slips.values())
        return {name for name, slip in refined.slips.items() if slip > 0.3 * most}
    numbers = map(int, re.findall(r"\d+", refined.worst[0].split(".")[0]))
    return {model.contact_names[number] for number in numbers if number < model.contacts}


def refined_reason(model: Model, refined: Refined) -> list[Reason]:
    """Why a refined motion is not exact; nothing if it is."""
    if refined.exact:
        return []
    joints = {
        model.contact_names[c]: f.joints for c, f in zip(refined.hand.contacts, refined.hand.fingers, strict=True)
    }
    if refined.slips_hopelessly:
        worst = max(refined.slips, key=lambda name: refined.slips[name])
        slip = 1e3 * refined.slips[worst] * model.units.length
        what = f"finger '{worst}' with {joints_of(joints[worst])} cannot roll with the object: it slips {slip:.1f} mm"
        return [Reason(what, _LIMITS["rolling.no_slip"].advice, _GRIP | {"gap", "penetration"})]
    (name, violation), who = refined.worst, sorted(failing_fingers(model, refined))
    kernel, constraint = name.split(".")
    limit = _LIMITS.get(f"{re.sub(r'[0-9_]+$', '', kernel)}.{constraint}")
    if limit is None:
        limit = _Limit(f"meet {name}", "", "more joints (search.max_joints) or slower goals", frozenset())
    fingers = " and ".join(f"'{finger}'" for finger in who)
    subject = f"finger{'s' if len(who) > 1 else ''} {fingers}" if who else "the object"
    when = _when(model, refined, kernel, constraint)
    what = (
        f"no exact motion was found with {'+'.join(map(str, joints.values()))} joints: "
        f"{subject} cannot {limit.cannot}{when}{_by(violation, limit.unit, model.units)}"
    )
    return [Reason(what, limit.advice, limit.explains)]


def _by(violation: float, unit: str, units: Units) -> str:
    """By how much a constraint is violated, in SI or weights; nothing if that would say nothing to a reader."""
    if unit == "length":
        return f", by {1e3 * violation * units.length:.2g} mm"
    if unit == "force":
        return f", by {violation:.2g} weights"
    if unit == "torque":
        return f", by {violation * units.torque:.2g} N·m"
    return f", by {violation:.2g} rad/s" if unit == "speed" else ""


def _when(model: Model, refined: Refined, kernel: str, constraint: str) -> str:
    """When a constraint is violated most; nothing where its rows are not known to be samples."""
    values = refined.runs[-1][1].constraints.get(f"{kernel}.{constraint}")
    if values is None:
        return ""
    rows = values.reshape(len(values), -1)
    # Bounded below: the least value is worst. All others are equations or bounded alike on both sides.
    row = int(
        rows.min(axis=1).argmin() if constraint in ("pressing", "cone", "clear") else abs(rows).max(axis=1).argmax()
    )
    knots = _knots(model, refined, kernel)
    return f" at {moment(model.schedule, model.schedule.samples[knots[row]])}" if len(knots) == len(values) else ""


def _knots(model: Model, refined: Refined, kernel: str) -> NDArray[np.int64]:
    """The samples that a kernel's instances stand for: all, all but the last, or those where its finger touches."""
    count = len(model.schedule.samples)
    number = re.search(r"(\d+)$", kernel)
    name = re.sub(r"[0-9_]+$", "", kernel)
    if name in ("contact", "apart_touching", "rolling") and number:
        active = refined.hand.active[:, int(number[1])]
        if name == "rolling":
            return np.flatnonzero(active[:-1])
        return np.flatnonzero(active | np.append(False, active[:-1]))
    return np.arange(count - 1 if name in ("physics", "middle_torque") else count)


# The audit's figures.

_ADVICE = {
    "structure": "solving the task again",
    "goal_position": "goals within reach, or limits.goal_position as wide as you can accept",
    "goal_angle": "a smaller turn between goals, or limits.goal_angle as wide as you can accept",
    "residual": "slower goals or more fingers",
    "residual_between": "a smaller time_step or slower goals",
    "friction_excess": "more friction or slower goals",
    "pull": "contacts that oppose each other better",
    "gap": "more joints (search.max_joints) or contacts nearer the palm",
    "gap_between": "a smaller time_step or more joints (search.max_joints)",
    "slip": "more joints (search.max_joints), or limits.slip as wide as you can accept",
    "penetration": _ROOM,
    "joint_limit": "wider hand.joint_limits or more joints (search.max_joints)",
    "speed": "faster motors (actuator.speed) or slower goals",
    "torque": "stronger motors (actuator.torque) or a lighter object",
    "unsupplied_force": "more joints (search.max_joints)",
    "disturbance_radius": "more fingers, or contacts farther apart",
}


def missed_figures(design: Design, verdict: Audit) -> list[tuple[str, Reason]]:
    """A reason for each figure of the audit that is missed, in the audit's order."""
    missed = []
    for name, figure in verdict.figures.items():
        if figure.holds:
            continue
        what = "; ".join(verdict.problems) if name == "structure" else _with_limit(design, figure)
        missed.append((name, Reason(what, _ADVICE.get(name, "another seed (--seed)"))))
    return missed


def _with_limit(design: Design, figure: Figure) -> str:
    """A figure's finding and limit; of motors in their own units too, and with the finger's name."""
    text = figure.text if design.hand is None else _with_finger(figure.text, design.hand)
    actuator = design.task.actuator
    if actuator is not None and figure.name in ("torque", "speed"):
        given, unit = (actuator.torque, "N·m") if figure.name == "torque" else (actuator.speed, "rad/s")
        text += f", {figure.value * given:.3g} {unit} of {given:.3g} {unit}"
    return text if figure.limit is None else f"{text}, where the limit is {show(figure.limit, figure.unit)}"


def _with_finger(text: str, hand: Hand) -> str:
    """The text with the finger's name behind a joint's where it is not yet."""

    def named(match: re.Match[str]) -> str:
        return f"{match[0]} of finger '{hand.fingers[int(match[1])].name}'"

    return re.sub(r"joint finger(\d+)_joint\d+(?! of finger)", named, text)
