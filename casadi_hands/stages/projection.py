"""The motion nearest to one that nearly meets its constraints, found by a problem that costs nothing but the way there.

Good motions may be far from the best one for hundreds of iterations; one that meets the constraints is near them, and
found in a few: the cost is as curved as can be, whatever the constraints do.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from numpy.typing import ArrayLike

from casadi_hands.nlp import Kernel, Options, Problem, Rows, Solution, Solver

ANCHORED_FORCE = 0.1  # half extents that are as far to go as a force of one weight


class Projector:
    """A refine problem in which all variables but those that follow from them cost what they change.

    Args:
        problem: complete; the anchors are added to it.
        options: IPOPT's.
    """

    def __init__(self, problem: Problem, options: Options) -> None:
        self._names = [name for name in problem.variables.names() if name not in ("rate", "wrench", "middle_torque")]
        for name in self._names:
            indices = problem.variables[name]
            where = problem.parameter(f"near.{name}", indices.shape)
            share = ANCHORED_FORCE if name.startswith("force") else 1.0
            row = Rows.of(indices.reshape(-1, 1), problem.variables.size)
            problem.bind(_anchor(share), [row], [where.reshape(-1, 1)])
        self._solver, self._options = Solver(problem), options

    def nearest(
        self,
        start: Solution,
        parameters: Mapping[str, ArrayLike],
        lower: Mapping[str, ArrayLike],
        upper: Mapping[str, ArrayLike],
        bounds: Mapping[str, tuple[ArrayLike, ArrayLike]],
    ) -> Solution:
        """What meets the constraints near a solution, if it does; its terms are of the way there alone.

        Args:
            start: the solution.
            parameters: of its problem; their weights do not count.
            lower: bounds of variables, where they differ from the declared ones.
            upper: likewise.
            bounds: of constraints, likewise.
        """
        weights: dict[str, ArrayLike] = {f"weight.{term}": 0.0 for term in self._solver.problem.terms}
        near = {f"near.{name}": start.values[name] for name in self._names}
        given = {**parameters, **weights, "weight.anchor": 1.0, **near}
        return self._solver.solve(start.values, given, self._options, lower, upper, bounds)


@cache
def _anchor(share: float) -> Kernel:
    """One variable near to where it begins; with a larger share the same change costs more."""
    kernel = Kernel("anchor")
    kernel.cost("anchor", share * (kernel.variable("value", 1) - kernel.parameter("where")))
    return kernel
