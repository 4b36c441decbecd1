"""How firmly a hand is to grip: as much as errors of its joints take away, and no more.

A firm grip keeps an object that errors push about, and asks for stiff joints: what forces do when contacts roll and
levers turn grows with them. So the least normal force follows from the motors: where joints are held by K and their
sensors are off by a little, a fingertip presses that much times K less.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.placement import forces_of_joint_errors
from casadi_hands.stages.refine.values import Margin
from casadi_hands.task.thickness import FIRMEST, SENSOR

WEAKEST, AMPLE = 0.3, 1.5  # weights: the lower bound on the normal force to begin with is between these
FIRMER = 2.0  # times the one to begin with, that it is then at least
SURER = 0.4  # share of the friction that may be used then
SPARING = 0.65  # share of the friction that may be used where the grip is to ask for less stiffness
SMALL = Margin(friction=0.8, normal_force=0.25)


@dataclass(frozen=True)
class Margins:
    """Margins for one hand.

    Attributes:
        ample: to begin with.
        larger: for where replays drop the object.
        firmer: between both, for where hands cannot grip so firmly.
        looser: between the first and the softer one.
        softer: for where they do because joints that are hardly stiff enough let it whirl away.
    """

    ample: Margin
    larger: Margin
    firmer: Margin
    looser: Margin
    softer: Margin


def margins_for(model: Model, whole: WholeHand) -> Margins:
    """Margins for a hand, by what errors of its joints do to its fingers' normal forces at most samples."""
    changes = [0.0]
    for i, contact in enumerate(whole.contacts):
        touching = whole.active[:, contact]
        if touching.any():
            changes.append(float(np.median(forces_of_joint_errors(model, whole, i, SENSOR)[touching])))
    asked = round(min(max(*changes, WEAKEST), FIRMEST), 2)
    ample = Margin(normal_force=min(asked, AMPLE))
    larger = replace(ample, friction=SURER, normal_force=max(asked, FIRMER * ample.normal_force))
    softer = Margin(SPARING, WEAKEST)
    return Margins(ample, larger, _between(ample, larger), _between(ample, softer), softer)


def _between(one: Margin, other: Margin) -> Margin:
    """A margin between two."""
    force = float(np.sqrt(one.normal_force * other.normal_force))
    return Margin((one.friction + other.friction) / 2, round(force, 2))
