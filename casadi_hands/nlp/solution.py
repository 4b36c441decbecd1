"""What a solve returns, by name."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from casadi_hands.declared import Term

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Solution:
    """What one solve returned, by name; a solve that stopped early is a value too.

    All numbers are computed at ``values``. A term, objective or violation that is not a number is infinite, so that
    such a solution ranks last and meets nothing.

    Attributes:
        values: variable -> array.
        terms: cost term -> weighted value.
        objective: sum of the terms.
        excess: ``kernel.constraint`` -> how far each of its values is beyond its bounds; 0 within.
        constraints: ``kernel.constraint`` -> its values, one row an instance.
        status: IPOPT's own words; never taken as proof.
        iterations: number of iterations; 0 where IPOPT did not start.
        seconds: wall time.
        declared: cost term -> as it was declared.
        multipliers: ``kernel.constraint`` -> sizes of the Lagrange multipliers of its values: what the objective gains
            for each unit that a limit is wider. 0 where a value is free, and of equations. Where constraints
            contradict each other, the limits that do have the largest.
        bound_multipliers: variable -> the same of its own bounds.
    """

    values: dict[str, Vector]
    terms: dict[str, float]
    objective: float
    excess: dict[str, Vector] = field(repr=False)
    constraints: dict[str, Vector] = field(repr=False)
    status: str
    iterations: int
    seconds: float
    declared: dict[str, Term] = field(default_factory=dict, repr=False)
    multipliers: dict[str, Vector] = field(default_factory=dict, repr=False)
    bound_multipliers: dict[str, Vector] = field(default_factory=dict, repr=False)

    @property
    def violations(self) -> dict[str, float]:
        """Largest violation of each ``kernel.constraint``."""
        return {name: float(excess.max(initial=0.0)) for name, excess in self.excess.items()}

    @property
    def violation(self) -> float:
        """Largest violation of a constraint."""
        return max(self.violations.values(), default=0.0)
