"""A finger that can be built: its joints' axes stand off its links as hinges do, and its links are bent no further."""

from __future__ import annotations

from functools import cache

import casadi as ca

from casadi_hands.kinematics.symbols import axes_of, cosines_from_links, turns_of
from casadi_hands.nlp import Kernel
from casadi_hands.problem.model import Model
from casadi_hands.terms import constraints as limits


@cache
def buildable(joints: int, hinged: bool, bent: bool) -> Kernel:
    """One finger's shape: ``from_link`` (2n - 1, if hinged) and ``bent`` (n, if it may be), both squares."""
    kernel = Kernel("buildable")
    frames = kernel.parameter("frames", 9 * joints)
    axes, bends = kernel.variable("axes", 2 * joints), kernel.variable("bends", 2 * joints)
    if hinged:
        kernel.constrain(limits.AXIS_FROM_LINK, cosines_from_links(axes_of(axes, frames), turns_of(bends)) ** 2)
    if bent:
        kernel.constrain(limits.BENT, ca.sum1(ca.reshape(bends, 2, joints) ** 2).T)
    return kernel


def buildable_bounds(model: Model) -> dict[str, tuple[float, float]]:
    """Bounds of the constraints of ``buildable``."""
    least, largest = model.axis_cosines
    return {"from_link": (least**2, largest**2), "bent": (0.0, model.bend**2)}
