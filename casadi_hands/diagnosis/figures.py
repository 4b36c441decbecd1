"""What statics, motors and the audit find wanting, as reasons."""

from __future__ import annotations

import re

import numpy as np

from casadi_hands.diagnosis.holding import firmest, holdings, least_friction, least_torque
from casadi_hands.diagnosis.moment import moment, real_moment
from casadi_hands.diagnosis.reason import Reason
from casadi_hands.diagnosis.shortcoming import WITHOUT_CONTACT
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.hand import Hand
from casadi_hands.problem.loads import HELD
from casadi_hands.problem.model import Model
from casadi_hands.problem.motors import joint_motors
from casadi_hands.problem.result import Result
from casadi_hands.verify import Audit
from casadi_hands.verify.replays.series import stronger_motors
from casadi_hands.verify.report import Figure, show

# Figures that follow where the hand cannot holding: a refinement in vain ends anywhere.
_HOLDING = WITHOUT_CONTACT | {"torque"}


def friction_reason(model: Model, floating: Floating) -> Reason | None:
    """Whether the contacts cannot hold the object with this friction, or only with fingers that press very hard."""
    found = holdings(model, floating)
    k = int(np.argmax([np.linalg.norm(holding.missing) for holding in found]))
    worst, when = found[k], moment(model.schedule, model.schedule.keyframes[k])
    if not worst.held:
        sliding = model.attachment is not None and not model.attachment.turning
        parts = np.split(worst.missing, [3 if model.attachment is None else int(sliding)])
        force, torque = (float(np.linalg.norm(part)) for part in parts)
        missing = [f"a force of {force:.2f} weights"] if force > HELD / 2 else []
        missing += [f"a torque of {1e3 * torque * model.units.torque:.3g} mN·m"] if torque > HELD / 2 else []
        what = (
            f"at {when} the contacts cannot hold the object with friction {model.friction:g}: "
            f"{' and '.join(missing)} {'are' if len(missing) > 1 else 'is'} missing"
        )
    else:
        k = int(np.argmax([holding.hardest for holding in found]))
        worst, when = found[k], moment(model.schedule, model.schedule.keyframes[k])
        if worst.hardest <= firmest(model):
            return None
        what = (
            f"at {when} the contacts hold the object with friction {model.friction:g} only if they press with "
            f"{worst.hardest:.1f} weights and more"
        )
    least = least_friction(model, floating)
    contacts = "contacts that surround the object better or oppose each other"
    advice = (
        contacts
        if least is None
        else f"friction of {least:.2g} or more, with which {firmest(model):.3g} weights would do, or {contacts}"
    )
    return Reason(what, advice, _HOLDING, root=True)


def torque_reason(model: Model, design: Result) -> Reason | None:
    """Whether holding the object as in a design's motion takes more torque than the motors have."""
    given = design.task.actuator.torque
    if given is None or design.hand is None:
        return None
    load = least_torque(model, design)
    if load is None or load.torque <= given:
        return None
    who = f"joint finger{load.finger}_joint{load.joint} of finger '{design.hand.fingers[load.finger].name}'"
    what = (
        f"{who} needs {load.torque:.3g} N·m at {real_moment(model.schedule, load.time)} however the hand found shares "
        f"the load, and the motors give {given:.3g} N·m"
    )
    advice = "stronger motors (actuator.torque), a lighter object, more friction or a palm nearer by"
    return Reason(what, advice, _HOLDING, root=True)


def speed_reason(model: Model, design: Result) -> Reason | None:
    """Whether a design's motion, which no limit of speed was asked of, is faster than its motors."""
    fastest, motion, hand = design.task.actuator.speed, design.motion, design.hand
    if fastest is None or motion is None or hand is None:
        return None
    speeds = np.abs(np.diff(motion.joint_angles, axis=0)) / np.diff(motion.time)[:, None]
    k, j = np.unravel_index(int(speeds.argmax()), speeds.shape)
    if speeds[k, j] <= fastest:
        return None
    what = (
        f"{_with_finger(f'joint {motion.joint_names[j]}', hand)} turns with {speeds[k, j]:.3g} rad/s at "
        f"{real_moment(model.schedule, motion.time[k])} in the motion found, and the motors give {fastest:.3g} rad/s"
    )
    return Reason(what, "faster motors (actuator.speed) or slower goals", frozenset(("speed",)))


# The audit's figures.

GRASP_ADVICE = "more friction, more fingers, or contacts that surround the object better (fingers: auto finds some)"
_ADVICE = {
    "structure": "a smaller time_step or another seed (--seed), and report it: the program should write no such files",
    "goal_position": "goals within reach, or limits.goal_position as wide as you can accept",
    "goal_angle": "a smaller turn between goals, or limits.goal_angle as wide as you can accept",
    "rest": "more fingers: a finger can only push, and the object must start and end at rest",
    "residual": "slower goals or more fingers",
    "residual_disturbed": "weaker perturbations, more friction or more fingers",
    "residual_between": "a smaller time_step or slower goals",
    "friction_excess": "more friction or slower goals",
    "pull": "contacts that oppose each other better",
    "torsion_excess": "softer fingertips (fingertip.torsion) or more fingers",
    "torsion_shortfall": "harder fingertips (fingertip.torsion) or more joints (search.max_joints)",
    "slide_shortfall": "a smaller time_step, or more joints (search.max_joints)",
    "attachment_shortfall": "a smaller time_step, or a motion that does not pause or turn back between goals",
    "gap": "more joints (search.max_joints) or contacts nearer the palm",
    "gap_between": "a smaller time_step or more joints (search.max_joints)",
    "slip": "more joints (search.max_joints), or limits.slip as wide as you can accept",
    "penetration": "thinner links (hand.link_radius), a palm farther away or contacts farther apart",
    "joint_limit": "wider hand.joint_limits or more joints (search.max_joints)",
    "speed": "faster motors (actuator.speed) or slower goals",
    "torque": "stronger motors (actuator.torque) or a lighter object",
    "coupling": "more motors (motors), wider ratios (hand.ratios), or limits.coupling as wide as you can accept",
    "motors": "more motors (motors), wider ratios (hand.ratios) or another seed (--seed)",
    "unsupplied_force": "more joints (search.max_joints)",
    "disturbance_radius": "more fingers, or contacts farther apart",
    "least_stiffness": "stiffer motors (actuator.stiffness), larger fingertips (fingertip.radius) or more fingers",
    "bearing_force": "thicker links (hand.link_radius), a stronger material (hand.material) or a lighter object",
    "bearing_moment": "thicker or shorter links (hand.link_radius, hand.link_length) or a stronger material "
    "(hand.material)",
    "link_stress": "thicker or shorter links (hand.link_radius, hand.link_length) or a stronger material "
    "(hand.material)",
    "tip_deflection": "thicker or shorter links (hand.link_radius, hand.link_length), a stiffer material "
    "(hand.material), or limits.tip_deflection as wide as you can accept",
    "replay_position": "another seed (--seed), more fingers, or limits.replay_position as wide as you can accept",
    "replay_angle": "a finger off the line between two contacts, or limits.replay_angle as wide as you can accept",
    "replay_dropped": GRASP_ADVICE,
}


def missed_figures(design: Result, verdict: Audit) -> list[tuple[str, Reason]]:
    """A reason for each figure of the audit that is missed, in the audit's order."""
    missed = []
    for name, figure in verdict.figures.items():
        if figure.holds:
            continue
        what = "; ".join(verdict.problems) if name == "structure" else _with_limit(design, figure)
        missed.append((name, Reason(what, _ADVICE.get(name, "another seed (--seed)"))))
    return missed


def motor_remedy(directory: str, design: Result) -> str | None:
    """Which motors would bring a design through its replay as planned, where weak or soft ones keep it from that.

    Args:
        directory: the design's files.
        design: that misses limits in replays.
    """
    hand = design.hand
    assert hand is not None
    stiffest = max(motor.stiffness for motor in joint_motors(design.task, hand))
    for change, seen in stronger_motors(directory):
        if all(figure.holds for figure in seen.figures()):
            motors = f"{change.effort * hand.effort:.3g} N·m (actuator.torque)"
            if change.stiffness == 1:
                how = f"pressing {change.squeeze:g} times as hard, with motors of {motors}"
            else:
                how = f"with motors of {motors} and up to {change.stiffness * stiffest:.3g} N·m/rad"
            return f"In the same replay {how}, this hand reaches every goal"
    return None


def _with_limit(design: Result, figure: Figure) -> str:
    """A figure's finding and limit; of motors in their own units too, and with the finger's name."""
    text = figure.text if design.hand is None else _with_finger(figure.text, design.hand)
    given = {"torque": design.task.actuator.torque, "speed": design.task.actuator.speed}.get(figure.name)
    if given is not None:
        unit = "N·m" if figure.name == "torque" else "rad/s"
        text += f", {figure.value * given:.3g} {unit} of {given:.3g} {unit}"
    return text if figure.limit is None else f"{text}, where the limit is {show(figure.limit, figure.unit)}"


def _with_finger(text: str, hand: Hand) -> str:
    """The text with the finger's name behind a joint's where it is not yet."""

    def named(match: re.Match[str]) -> str:
        return f"{match[0]} of finger '{hand.fingers[int(match[1])].name}'"

    return re.sub(r"joint finger(\d+)_joint\d+(?! of finger)", named, text)
