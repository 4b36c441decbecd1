"""How far a judged design is from what is aimed at."""

from __future__ import annotations

import math

from casadi_hands.export.design import Design

AIM = 3.0  # deg from any goal in the replay as planned, beyond which more is tried


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
