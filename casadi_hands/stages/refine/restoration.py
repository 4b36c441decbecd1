"""Restoration: the motion nearest to one that nearly meets its constraints, among those that meet them.

Good motions may be far from the best one for hundreds of iterations; one that meets the constraints is near them, and
found in a few where nothing costs but a proximal term: that is as curved as can be, whatever the constraints do.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from numpy.typing import ArrayLike

from casadi_hands.nlp import Kernel, Parameter, Problem, Rows
from casadi_hands.nlp.layout import Label
from casadi_hands.terms.finger import PROXIMITY

# What all else decides.
FOLLOWING = (
    *("rate", "wrench", "middle_torque", "spin", "holding", "twist_torque", "slip", "sticking", "motors"),
    *("coordinate_speed", "drag"),
)
FORCE_SHARE = 0.1  # lengths that are as far to go as a force of one weight


class Proximity:
    """What all variables of a refine problem, but those that follow from the others, cost where they change.

    Args:
        problem: all else is bound to; the term ``anchor`` is added to it, and parameters that say where it is least.

    Attributes:
        idle: these parameters, for solves in which the term has no weight.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._names = [name for name in problem.variables.names() if name not in FOLLOWING]
        for name in self._names:
            indices = problem.variables[name]
            where = problem.parameter(f"near.{name}", indices.shape)
            share = FORCE_SHARE if name.startswith(("force", "torsion")) else 1.0
            value = Rows.of(indices.reshape(-1, 1), problem.variables.size, Label("value"))
            near = Parameter(where.positions.reshape(-1, 1), Label("near"))
            problem.bind(_near(share), value=value, near=near)
        self.idle: dict[str, ArrayLike] = {f"near.{name}": 0.0 for name in self._names}

    def at(self, values: Mapping[str, ArrayLike]) -> dict[str, ArrayLike]:
        """Parameters and weights with which nothing costs but the change from these values of all variables."""
        weights: dict[str, ArrayLike] = {f"weight.{term}": 0.0 for term in self._problem.terms}
        return weights | {"weight.anchor": 1.0} | {f"near.{name}": values[name] for name in self._names}


@cache
def _near(share: float) -> Kernel:
    """One variable near to where it begins; with a larger share the same change costs more."""
    kernel = Kernel("anchor")
    kernel.cost(PROXIMITY, share * (kernel.variable("value", 1) - kernel.parameter("near")))
    return kernel
