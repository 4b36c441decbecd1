"""IPOPT on a problem's functions, with results by name; and what was handed to it, on demand."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from casadi_hands.nlp.failure import SolverError, words_of
from casadi_hands.nlp.problem import Problem
from casadi_hands.nlp.program import Program
from casadi_hands.nlp.solution import Solution
from casadi_hands.nlp.status import status_of
from casadi_hands.nlp.watch import Watch

Vector = NDArray[np.float64]
AT_BOUND = 1e-3  # of a bound, or in units of variables: nearer to it a variable counts as being at it


@dataclass(frozen=True)
class Options:
    """IPOPT's settings that the stages differ in; limits are iterations, never seconds.

    The defaults are the loose tolerances that the soft stages need and no more. A solve also ends once a constraint's
    multiplier exceeds ``most_multiplier``, see ``Watch``.
    """

    max_iter: int = 150
    tol: float = 1e-3
    acceptable_tol: float = 1e-2
    constr_viol_tol: float = 1e-4
    mu_init: float = 1e-1
    most_multiplier: float = np.inf
    extra: tuple[tuple[str, Any], ...] = ()

    def ipopt(self) -> dict[str, Any]:
        """The options as IPOPT names them."""
        named = {
            name: getattr(self, name) for name in ("max_iter", "tol", "acceptable_tol", "constr_viol_tol", "mu_init")
        }
        # AMD ordering is a quarter to a third faster than MUMPS's own choice on these banded systems; little more than
        # the memory that it says it needs, instead of ten times that, saves another tenth; no search for a better
        # order of rows saves up to a third of small ones. Second-order corrections were seen to lead astray where
        # friction's cones have their tips: solves took two to seven times as long, or never converged.
        return {
            "print_level": 0,
            "sb": "yes",
            "mumps_pivot_order": 0,
            "mumps_mem_percent": 10,
            "mumps_permuting_scaling": 0,
            "max_soc": 0,
            **named,
            **dict(self.extra),
        }


class Solve(NamedTuple):
    """A solve as it was posed, how it was solved, and what came out."""

    program: Program
    options: Options
    solution: Solution


_kept: ContextVar[list[Solve] | None] = ContextVar("kept", default=None)


@contextmanager
def keep_solves() -> Iterator[list[Solve]]:
    """Keeps every solve in this thread meanwhile, whichever solver's: what is posed deep within a stage can be had."""
    solves: list[Solve] = []
    token = _kept.set(solves)
    try:
        yield solves
    finally:
        _kept.reset(token)


class Solver:
    """A problem with its functions built, ready to be solved from any start with any parameters."""

    def __init__(self, problem: Problem) -> None:
        """Build the problem's functions; nothing may be added to it afterwards."""
        self.problem = problem
        self.functions = problem.functions()
        self._solvers: dict[Options, ca.Function] = {}
        self._watches: dict[Options, Watch] = {}  # kept, since a solver does not keep its own alive

    def nlpsol(self, options: Options) -> ca.Function:
        """CasADi's function that runs IPOPT so, built when it is first asked for; ``stats()`` are of its last run."""
        if options not in self._solvers:
            f = self.functions
            settings: dict[str, Any] = {
                "ipopt": options.ipopt(),
                "print_time": False,
                "error_on_fail": False,
                "show_eval_warnings": False,
                "no_nlp_grad": True,
                "calc_lam_p": False,
                "grad_f": f["grad_f"],
                "jac_g": f["jac_g"],
                "hess_lag": f["hess_lag"],
            }
            if np.isfinite(options.most_multiplier):
                sizes = self.problem.variables.size, self.problem.constraints.size
                self._watches[options] = settings["iteration_callback"] = Watch(*sizes, options.most_multiplier)
            _load_ipopt()
            self._solvers[options] = ca.nlpsol("solver", "ipopt", f["nlp"], settings)
        return self._solvers[options]

    def solve(
        self,
        start: Mapping[str, ArrayLike],
        parameters: Mapping[str, ArrayLike],
        options: Options | None = None,
        lower: Mapping[str, ArrayLike] | None = None,
        upper: Mapping[str, ArrayLike] | None = None,
        constraints: Mapping[str, tuple[ArrayLike, ArrayLike]] | None = None,
    ) -> Solution:
        """Solve from ``start``.

        Args:
            start: variable -> initial value; variables left out start at zero, within their bounds.
            parameters: parameter -> value, all of them; weights as ``weight.<term>``.
            options: IPOPT's settings.
            lower: variable -> lower bound, where it differs from the declared one.
            upper: variable -> upper bound, where it differs.
            constraints: ``kernel.constraint`` -> bounds, where they differ from those given when it was bound.

        Raises:
            KeyError: a name that is not in the problem, or a parameter left out.
            KeyboardInterrupt: the solve was interrupted.
            SolverError: IPOPT broke off with an error, or with a status after which there is nothing to judge.
        """
        program = self.program(start, parameters, lower, upper, constraints)
        options = options or Options()
        solver = self.nlpsol(options)
        watch = self._watches.get(options)
        if watch:
            watch.interrupted = False
        started = time.perf_counter()
        try:
            answer = solver(**program.numbers)
        except RuntimeError as error:
            raise SolverError(f"IPOPT: {words_of(error)}") from error
        seconds = time.perf_counter() - started
        stats = solver.stats()
        status = status_of(str(stats["return_status"]))
        if status.kind == "interrupted" or (watch and watch.interrupted):
            # CasADi turns an interrupt into this status, or into an end that was asked for, and goes on.
            raise KeyboardInterrupt
        if status.kind == "broken":
            raise SolverError(f"IPOPT {status.words}")
        solution = self._solution(answer, program, stats, seconds)
        if (kept := _kept.get()) is not None:
            kept.append(Solve(program, options, solution))
        return solution

    def program(
        self,
        start: Mapping[str, ArrayLike],
        parameters: Mapping[str, ArrayLike],
        lower: Mapping[str, ArrayLike] | None = None,
        upper: Mapping[str, ArrayLike] | None = None,
        constraints: Mapping[str, tuple[ArrayLike, ArrayLike]] | None = None,
    ) -> Program:
        """What `solve` hands to IPOPT for the same arguments.

        Raises:
            KeyError: as `solve`.
        """
        problem, p = self.problem, self._parameters(parameters)
        lbx = problem.variables.pack(lower or {}, problem.lower)
        ubx = problem.variables.pack(upper or {}, problem.upper)
        x0 = np.clip(problem.variables.pack(start, np.zeros(problem.variables.size)), lbx, ubx)
        lbg, ubg = problem.constraint_lower.copy(), problem.constraint_upper.copy()
        for name, (low, high) in (constraints or {}).items():
            lbg[problem.constraint_rows[name]], ubg[problem.constraint_rows[name]] = low, high
        return Program(problem, x0, p, lbx, ubx, lbg, ubg)

    def evaluate(self, values: Mapping[str, ArrayLike], parameters: Mapping[str, ArrayLike]) -> dict[str, float]:
        """The weighted value of every term at given variables; those left out are zero.

        Args:
            values: variable -> value.
            parameters: parameter -> value, all of them.

        Raises:
            KeyError: as `solve`.
        """
        x = self.problem.variables.pack(values, np.zeros(self.problem.variables.size))
        terms = np.asarray(self.functions["terms"](x, self._parameters(parameters))[2]).reshape(-1)
        return dict(zip(self.problem.terms, terms.tolist(), strict=True))

    def _parameters(self, given: Mapping[str, ArrayLike]) -> Vector:
        """All parameters in their order.

        Raises:
            KeyError: one that has no value, or a name that is not in the problem.
        """
        layout = self.problem.parameters
        missing = [name for name in layout.names() if name not in given]
        if missing:
            raise KeyError(f"parameters without a value: {', '.join(missing)}")
        return layout.pack(given, np.zeros(layout.size))

    def _solution(self, answer: dict[str, Any], program: Program, stats: dict[str, Any], seconds: float) -> Solution:
        problem, x = self.problem, np.asarray(answer["x"]).reshape(-1)
        # IPOPT's own f and g are left as they were where it stops before it evaluates them.
        f, g, terms = (np.array(value).reshape(-1) for value in self.functions["terms"](x, program.p))
        finite = np.isfinite(g)
        low, high = (bound - np.where(finite, g, 0.0) for bound in (program.lbg, program.ubg))
        beyond = np.where(finite, np.maximum(np.maximum(low, -high), 0.0), np.inf)
        terms[~np.isfinite(terms)] = np.inf
        lam_g = np.nan_to_num(np.array(answer["lam_g"], float).reshape(-1))
        pressed = np.where(program.lbg < program.ubg, np.abs(lam_g), 0.0)
        return Solution(
            values=problem.variables.unpack(x),
            terms=dict(zip(problem.terms, terms.tolist(), strict=True)),
            objective=float(f[0]) if np.isfinite(f[0]) else np.inf,
            excess={name: beyond[rows] for name, rows in problem.constraint_rows.items()},
            constraints={name: g[rows] for name, rows in problem.constraint_rows.items()},
            status=str(stats["return_status"]),
            # CasADi sets the count with the record of iterations; without one it is whatever memory held.
            iterations=int(stats["iter_count"]) if "iterations" in stats else 0,
            seconds=seconds,
            declared=problem.declared_terms,
            multipliers={name: pressed[rows] for name, rows in problem.constraint_rows.items()},
            bound_multipliers=problem.variables.unpack(self._of_bounds(x, program, lam_g)),
        )

    def _of_bounds(self, x: Vector, program: Program, lam_g: Vector) -> Vector:
        """Sizes of the multipliers of variables' bounds, from the gradient that they have to balance.

        IPOPT's own are the barrier's where it is stopped, however near a variable has come to its bound.
        """
        gradient = np.array(self.functions["grad_f"](x, program.p)[1]).reshape(-1)
        jacobian = self.functions["jac_g"](x, program.p)[1]
        force = -gradient - np.array(ca.mtimes(jacobian.T, lam_g)).reshape(-1)
        upper, lower = (
            np.abs(x - bound) <= AT_BOUND * np.maximum(1.0, np.abs(bound)) for bound in (program.ubx, program.lbx)
        )
        sizes = np.where(upper, np.maximum(force, 0.0), 0.0) + np.where(lower, np.maximum(-force, 0.0), 0.0)
        return np.where(np.isfinite(sizes) & (program.lbx < program.ubx), sizes, 0.0)


@cache
def _load_ipopt() -> None:
    """Load IPOPT so that its linear algebra has one thread: with more, sums are rounded otherwise from run to run.

    OpenBLAS reads the number once, when it is loaded; CasADi brings one of its own, and loads it with the solver.
    """
    name = "OPENBLAS_NUM_THREADS"
    before = os.environ.get(name)
    os.environ[name] = "1"
    try:
        ca.load_nlpsol("ipopt")
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before
