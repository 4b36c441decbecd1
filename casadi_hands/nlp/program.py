"""A program with all its numbers: what a solver is handed, and what it looks like at its start."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sparse
from casadi import DM, Function
from numpy.typing import NDArray

from casadi_hands.nlp.problem import Problem

Vector = NDArray[np.float64]


class Values(NamedTuple):
    """A program's functions at a point.

    Attributes:
        f: the objective.
        g: (m,) the constraints.
        terms: cost term -> weighted value.
        gradient: (n,) of the objective.
        jacobian: (m, n) of the constraints.
        beyond: (m,) how far each constraint is beyond its bounds; 0 within.
    """

    f: float
    g: Vector
    terms: dict[str, float]
    gradient: Vector
    jacobian: sparse.csc_array
    beyond: Vector


@dataclass(frozen=True, eq=False)
class Program:
    """Minimise f(x, p) subject to lbx ≤ x ≤ ubx and lbg ≤ g(x, p) ≤ ubg, from x0.

    Attributes:
        problem: the names of what stands where, the terms and the constraints.
        x0: (n,) start, within the bounds.
        p: parameters, weights among them.
        lbx: (n,).
        ubx: (n,).
        lbg: (m,).
        ubg: (m,).
    """

    problem: Problem
    x0: Vector
    p: Vector
    lbx: Vector
    ubx: Vector
    lbg: Vector
    ubg: Vector

    @property
    def numbers(self) -> dict[str, Vector]:
        """All arrays by the names that CasADi's solvers know them by."""
        return {name: getattr(self, name) for name in ("x0", "p", "lbx", "ubx", "lbg", "ubg")}

    @cached_property
    def functions(self) -> dict[str, Function]:
        """As ``Problem.functions`` gives them, without machine code; they give the same numbers, more slowly.

        ``nlp`` (x, p) -> (f, g); ``grad_f`` (x, p) -> (f, grad_f_x); ``jac_g`` (x, p) -> (g, jac_g_x); ``terms``
        (x, p) -> (f, g, terms); ``hess_lag`` (x, p, lam_f, lam_g) -> the upper triangle of the Hessian of
        lam_f·f + lam_gᵀg.
        """
        return self.problem.functions(portable=True)

    @cached_property
    def at_start(self) -> Values:
        """Values and first derivatives at the start."""
        f, g, terms = (np.array(value).reshape(-1) for value in self.functions["terms"](self.x0, self.p))
        gradient = np.array(self.functions["grad_f"](self.x0, self.p)[1]).reshape(-1)
        jacobian = _to_scipy(self.functions["jac_g"](self.x0, self.p)[1])
        beyond = np.maximum(np.maximum(self.lbg - g, g - self.ubg), 0.0)
        named = dict(zip(self.problem.terms, terms.tolist(), strict=True))
        return Values(float(f[0]), g, named, gradient, jacobian, beyond)


def _to_scipy(matrix: DM) -> sparse.csc_array:
    """A CasADi matrix as a SciPy one; entries that happen to be zero are kept."""
    pattern = matrix.sparsity()
    return sparse.csc_array((np.array(matrix.nonzeros()), pattern.row(), pattern.colind()), shape=matrix.shape)
