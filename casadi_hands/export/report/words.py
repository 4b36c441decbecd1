"""What figures, joints and stages are called on the report, and texts of the witness with people's names in them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from casadi_hands.terms.catalogue import terms_of

if TYPE_CHECKING:
    from casadi_hands.problem.hand import Hand

_FIGURES = {
    "structure": "The files agree with each other",
    "goal_position": "Distance from the goals",
    "goal_angle": "Turn away from the goals",
    "rest": "Speed at the start and the end",
    "residual": "Force or torque that nothing exerts",
    "residual_between": "The same between samples",
    "residual_disturbed": "What contacts leave of the disturbances",
    "friction_excess": "Sideways force beyond friction",
    "friction_use": "Share of the friction in use",
    "torsion_excess": "Twisting moment beyond what a fingertip bears",
    "torsion_shortfall": "Twisting moment that does not oppose a spin",
    "torsion_use": "Share of the fingertips' torsion in use",
    "attachment_shortfall": "Force or moment that the joint to the world cannot exert",
    "pull": "Force by which a contact would have to suck",
    "slide_shortfall": "Friction that does not oppose a slide",
    "gap": "Gap between finger and object",
    "gap_between": "The same between samples",
    "slip": "Slip of a contact, from touch to lift",
    "spin": "Turn of a fingertip about its contact",
    "penetration": "Overlap of two bodies",
    "gap_mesh": "Gap between finger and the mesh itself",
    "penetration_mesh": "Overlap of a finger and the mesh itself",
    "joint_limit": "Angle beyond a joint's limit",
    "speed": "Speed of joints or motors",
    "torque": "Torque of joints or motors",
    "coupling": "Angle that shared motors miss",
    "motors": "Number of motors",
    "unsupplied_force": "Force that no joint works for",
    "disturbance_radius": "Smallest push that the grasp cannot resist",
    "least_stiffness": "Stiffness that joints must have",
    "least_tip_stiffness": "Stiffness that fingertips must have",
    "free_spin": "Spin that no joint resists",
    "bearing_force": "Force on a joint's bearing",
    "bearing_moment": "Moment across a joint's bearing",
    "link_stress": "Stress in a link",
    "tip_deflection": "How far a finger's end bends away",
    "replay_position": "Simulated: distance from the goals",
    "replay_angle": "Simulated: turn away from the goals",
    "replay_dropped": "Simulated: share of disturbed replays that drop the object",
}
_STAGES = {
    "floating": "Object moved by contacts alone",
    "synthesis": "Fingers grown for the contacts",
    "whole_hand": "Hand and object together",
    "refine": "Exact contacts, clearances and limits",
}
_KINDS = {"certified": "good", "feasible": "warn"}


def status_kind(status: str) -> str:
    """What a design's status is: good, warn or bad, as badges are."""
    return _KINDS.get(status, "bad")


def figure_title(name: str) -> str:
    """A figure of the certificate in a few words."""
    return _FIGURES.get(name, plain(name))


def stage_title(name: str) -> str:
    """A stage of the solve in a few words."""
    return _STAGES.get(name, plain(name))


def term_title(stage: str, name: str) -> str:
    """A cost term in a few words: as it is declared, in this stage or another."""
    found = [term for each in (stage, *_STAGES) for term in terms_of(each) if term.name == name]
    return next((term.about for term in found if term.about), plain(name))


def plain(name: str) -> str:
    """An identifier as words."""
    return name.replace("_", " ").capitalize()


def joint_title(hand: Hand, finger: int, joint: int) -> str:
    """A joint by its finger's name, counted from the palm, from 1."""
    return f"{hand.fingers[finger].name}, joint {joint + 1}"


def in_words(text: str, hand: Hand | None) -> str:
    """A finding of the witness with joints, links and motors as people count them: by finger, from 1."""
    if hand is not None:
        text = re.sub(r"joint finger(\d+)_joint(\d+)(?: of finger '[^']*')?", lambda m: _joint(hand, m), text)
    text = re.sub(r"\(link (\d+)\)", lambda m: f"(link {int(m[1]) + 1})", text)
    return re.sub(r"\bmotor(\d+)\b", lambda m: f"motor {int(m[1]) + 1}", text)


def _joint(hand: Hand, found: re.Match[str]) -> str:
    finger, joint = int(found[1]), int(found[2])
    name = hand.fingers[finger].name if finger < len(hand.fingers) else f"finger{finger}"
    return f"joint {joint + 1} of finger '{name}'"
