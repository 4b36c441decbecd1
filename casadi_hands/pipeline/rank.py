"""How far a judged design is from what is aimed at, and what may be nearer."""

from __future__ import annotations

import math

from casadi_hands.export.design import Design

AIM = 3.0  # deg from any goal in the replay as planned, beyond which more is tried
NEARLY = 0.1  # of the replays: where no more drop the object, a grip in between may do


def rank_of(design: Design) -> tuple[float, ...]:
    """How far a judged design is from what is aimed at, best first.

    By limits that the files miss, limits that replays miss, motors where joints share them, drops, turns from goals
    beyond `AIM`, and the stiffness that the grasp asks for.
    """
    in_replays = design.missed_in_replays
    missed = len(design.missed) - len(in_replays)
    played = (math.inf, math.inf, math.inf, math.inf)
    if design.drops is not None:
        played = len(in_replays), _motors(design), design.drops, max(design.replay_angle, AIM)
    stiffness = design.certificate.get("least_stiffness", {}).get("value")
    return missed, *played, math.inf if stiffness is None else stiffness


def _motors(design: Design) -> float:
    """How many motors share the joints: fewer than these is what was asked for."""
    return math.inf if design.hand is None or design.hand.drive is None else design.hand.motors


def _nearly(design: Design) -> bool:
    """Whether all that a design misses is that a few replays fewer should drop the object."""
    dropped = design.certificate.get("replay_dropped", {}).get("value") or 0.0
    return design.missed == {"replay_dropped"} and dropped <= NEARLY


def in_between(one: Design, other: Design) -> bool:
    """Whether a grip between two may do: one of these nearly does, or each keeps the limits that the other misses."""
    return _nearly(one) or _nearly(other) or not one.missed & other.missed
