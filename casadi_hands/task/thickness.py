"""How thick fingers are where the task does not say: as the palm has them, or as its object needs them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
from pydantic import ValidationError

from casadi_hands.task.fields import Vector
from casadi_hands.task.hand import USUAL_STIFFNESS
from casadi_hands.task.limits import USUAL_DEFLECTION
from casadi_hands.task.material import DEFAULT_MATERIAL, MATERIALS, Material

OF_PALM = 0.13
"""Of the palm's radius: the default of ``hand.link_radius`` where that is stiff enough."""
_ROOM = 0.45  # of the distance between contacts: the most that a fingertip may take up
SENSOR = np.deg2rad(0.75)
"""Error of a joint's sensor, rad, that must not take a finger off the object."""
FIRMEST = 6.0
"""Weights, the most that a fingertip is asked to press with for that."""
_LARGEST = 0.5  # of the characteristic length: thicker, fingertips are as large as the object


def usual_force(weight: float, friction: float, reach: float) -> float:
    """What a fingertip may have to press with, N: to bear the object alone, or so that errors of joints leave it there.

    Joints of the usual stiffness are meant; the task's own may be softer.

    Args:
        weight: of the object, N.
        friction: coefficient.
        reach: of the finger, m.
    """
    return max(weight / friction, min(FIRMEST * weight, USUAL_STIFFNESS * float(SENSOR) / reach))


def usual_link_radius(
    palm_radius: float, length: float, force: float, reach: float, material: Any, touched: Sequence[Vector]
) -> float:
    """The default of ``hand.link_radius``, m.

    A straight finger of that radius, held at its root, bends under the force by no more than what `limits` allows the
    tip: a round beam's deflection F L³ / (3 E I), I = π r⁴ / 4.

    Args:
        palm_radius: m.
        length: the object's characteristic length, m.
        force: that a fingertip may have to bear, N.
        reach: of the finger, m.
        material: as the task gives it, maybe wrongly.
        touched: points of the contacts that are given, m.
    """
    try:
        stiffness = Material.model_validate(MATERIALS[DEFAULT_MATERIAL] if material is None else material).stiffness
    except ValidationError:  # which the task is refused for
        stiffness = MATERIALS[DEFAULT_MATERIAL].stiffness
    needed = (4 * force * reach**3 / (3 * np.pi * stiffness * USUAL_DEFLECTION * length)) ** 0.25
    apart = min((float(np.linalg.norm(np.subtract(a, b))) for a, b in combinations(touched, 2)), default=np.inf)
    return max(OF_PALM * palm_radius, min(float(needed), _ROOM * apart, _LARGEST * length))
