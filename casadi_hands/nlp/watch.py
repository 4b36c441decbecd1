"""An end to solves whose constraints contradict each other, before they take minutes to say so."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from casadi import DM, Sparsity


class Watch(ca.Callback):
    """Stops IPOPT once a constraint's multiplier exceeds a limit.

    Where constraints cannot be met together, multipliers grow without bounds; the linear systems become so nearly
    singular that their factors fill up, and an iteration takes a hundred times longer.

    Args:
        variables, constraints: their numbers.
        limit: of a multiplier's size.
    """

    def __init__(self, variables: int, constraints: int, limit: float) -> None:
        super().__init__()
        scalar, x, g = Sparsity.scalar(), Sparsity.dense(variables), Sparsity.dense(constraints)
        self._sparsities = {"f": scalar, "x": x, "lam_x": x, "g": g, "lam_g": g}
        self._limit = limit
        self.interrupted = False
        self.construct("watch", {})

    def get_n_in(self) -> int:
        """One input for each output of a solver."""
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        """Whether to stop."""
        return 1

    def get_name_in(self, index: int) -> str:
        """Name of an input: the solver's output."""
        return str(ca.nlpsol_out(index))

    def get_name_out(self, index: int) -> str:
        """Name of the output, as the solver wants it."""
        return "ret"

    def get_sparsity_in(self, index: int) -> Sparsity:
        """All dense; there are no multipliers of parameters."""
        return self._sparsities.get(ca.nlpsol_out(index), Sparsity(0, 0))

    def eval(self, outputs: Sequence[DM]) -> list[DM]:
        """1 to stop, after an iteration; an interrupt, which CasADi would swallow, is kept in ``interrupted``."""
        try:
            multipliers = np.abs(outputs[ca.nlpsol_out().index("lam_g")].full())
            return [DM(float(multipliers.max(initial=0.0) > self._limit))]
        except KeyboardInterrupt:
            self.interrupted = True
            return [DM(1.0)]
