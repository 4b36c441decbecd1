"""The optimisers a user would otherwise run, on the problems that a solve poses: same cost, same bounds, same start.

All of them minimise the stage's cost within box bounds. The friction cones and the least number of contacts, which the
program's own stage 1 has as constraints too, are left out for all: friction is then the penalty of eq. 2.8 alone.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from typing import Any
from unittest.mock import patch

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from casadi_hands.nlp import Kernel, Options, Parameter, Problem, Rows, Solution, Solver, derivatives, machine_code
from casadi_hands.nlp.arguments import arguments_by_name
from casadi_hands.nlp.assembly import to_dm

Vector = NDArray[np.float64]
Trace = list[tuple[float, float]]
_IPOPT_INFINITY = 1e20  # Opti's parameters have to be finite


@dataclass(frozen=True)
class Posed:
    """One nonlinear program: start (n,), parameters (m,), box bounds (n,) and the settings that a solve uses."""

    start: Vector
    parameters: Vector
    lower: Vector
    upper: Vector
    options: Options


@dataclass(frozen=True)
class Attempt:
    """What an optimiser made of one program.

    Attributes:
        objective: lowest cost that it saw.
        iterations: that it counts.
        seconds: solving, without building.
        trace: (seconds, lowest cost until then); for IPOPT, whose iterations are not timed, in equal steps.
        how: its own word for how it ended.
    """

    objective: float
    iterations: int
    seconds: float
    trace: Trace
    how: str


@dataclass(frozen=True)
class Run:
    """All programs of one structure: seconds to build it, once, and an attempt for each."""

    building: float
    attempts: list[Attempt]


Build = Callable[[], Any]
"""Makes a stage; its ``solver`` holds the problem."""
Method = Callable[[Build, Sequence[Posed], float], Run]


@contextmanager
def recorded_solves() -> Iterator[list[Posed]]:
    """The programs solved meanwhile, as they were posed but for their constraints."""
    posed: list[Posed] = []
    original = Solver.solve

    def solve(self: Solver, start: Any, parameters: Any, options: Any = None, *rest: Any, **named: Any) -> Solution:
        given = dict(zip(("lower", "upper"), rest, strict=False)) | named
        variables, zero = self.problem.variables, np.zeros(self.problem.variables.size)
        low, high = self.problem.lower, self.problem.upper
        low, high = variables.pack(given.get("lower") or {}, low), variables.pack(given.get("upper") or {}, high)
        x = np.clip(variables.pack(start, zero), low, high)
        p = self.problem.parameters.pack(parameters, np.zeros(self.problem.parameters.size))
        posed.append(Posed(x, p, low, high, options or Options()))
        return original(self, start, parameters, options, *rest, **named)

    Solver.solve = solve  # type: ignore[method-assign]
    try:
        yield posed
    finally:
        Solver.solve = original  # type: ignore[method-assign]


def ours(
    build: Build, programs: Sequence[Posed], limit: float, *, constrained: bool = False, limited_memory: bool = False
) -> Run:
    """The program's own way: IPOPT on the assembled problem.

    Args:
        build: makes the stage.
        programs: to solve, one after the other.
        limit: s for each.
        constrained: with the stage's constraints, as a solve has them.
        limited_memory: with IPOPT's L-BFGS approximation instead of exact Hessians.
    """
    began = time.perf_counter()
    solver: Solver = build().solver
    problem = solver.problem
    free = {} if constrained else {name: (-np.inf, np.inf) for name in problem.constraint_rows}
    extra: tuple[tuple[str, Any], ...] = (("max_wall_time", limit),)
    if limited_memory:
        # The stages' caps are for exact Hessians: approximate ones take many more, and far cheaper, iterations.
        extra += (("hessian_approximation", "limited-memory"), ("max_iter", 100_000))
    attempts = []
    for posed in programs:
        options = replace(posed.options, extra=posed.options.extra + extra)
        values, low, high = (problem.variables.unpack(v) for v in (posed.start, posed.lower, posed.upper))
        solution = solver.solve(values, problem.parameters.unpack(posed.parameters), options, low, high, free)
        record = solver.nlpsol(options).stats()
        attempts.append(_ipopt_attempt(record, solution.seconds))
    solving = sum(attempt.seconds for attempt in attempts)
    return Run(time.perf_counter() - began - solving, attempts)


def _ipopt_attempt(record: dict[str, Any], seconds: float) -> Attempt:
    costs = np.minimum.accumulate(record["iterations"]["obj"]) if "iterations" in record else np.array([np.inf])
    times = np.linspace(0, seconds, len(costs))
    trace = list(zip(times.tolist(), costs.tolist(), strict=True))
    return Attempt(float(costs[-1]), len(costs) - 1, seconds, trace, record["return_status"])


class _OutOfTimeError(Exception):
    """The limit was reached."""


def by_scipy(build: Build, programs: Sequence[Posed], limit: float, *, name: str, interpreted: bool = False) -> Run:
    """A method of ``scipy.optimize.minimize``, given our exact gradients.

    L-BFGS-B takes the bounds. BFGS has none: it gets x = middle + half width · sin y for bounded variables.

    Args:
        build: makes the stage.
        programs: to solve, one after the other.
        limit: s for each.
        name: of the method.
        interpreted: with kernels as CasADi runs them where nothing is compiled.
    """
    began = time.perf_counter()
    with _interpreted() if interpreted else nullcontext():
        gradient = build().solver.functions["grad_f"]
    attempts = [_scipy_attempt(name, gradient, posed, limit) for posed in programs]
    return Run(time.perf_counter() - began - sum(attempt.seconds for attempt in attempts), attempts)


@contextmanager
def _interpreted() -> Iterator[None]:
    """Build problems meanwhile as where there is no compiler."""
    with patch.object(machine_code, "compiler", lambda: None), patch.object(derivatives, "_known", {}):
        yield


def _scipy_attempt(name: str, gradient: ca.Function, posed: Posed, limit: float) -> Attempt:
    trace: Trace = []
    buffer: Any  # CasADi's types ask for a size that its methods do not take
    buffer, call = gradient.buffer()
    x, value, slope = np.array(posed.start), np.zeros(1), np.zeros(len(posed.start))
    for index, array in enumerate((x, posed.parameters)):
        buffer.set_arg(index, array.data)
    for index, array in enumerate((value, slope)):
        buffer.set_res(index, array.data)
    unbounded = name == "BFGS"
    boxed = np.isfinite(posed.upper - posed.lower) & unbounded
    half = np.where(boxed, posed.upper - posed.lower, 0.0) / 2
    middle = np.where(boxed, posed.lower, 0.0) + half

    def cost(y: Vector) -> tuple[float, Vector]:
        x[:] = np.where(boxed, middle + half * np.sin(y), y)
        call()
        seconds = time.perf_counter() - began
        trace.append((seconds, min(float(value[0]), trace[-1][1] if trace else np.inf)))
        if seconds > limit:
            raise _OutOfTimeError
        return float(value[0]), np.where(boxed, slope * half * np.cos(y), slope)

    shifted = np.divide(posed.start - middle, half, out=np.zeros(len(x)), where=boxed)
    start = np.where(boxed, np.arcsin(np.clip(shifted, -1, 1)), posed.start)
    bounds = None if unbounded else list(zip(posed.lower, posed.upper, strict=True))
    # Their own tolerances stop them; counts are no limit, so that only the time is.
    options = {"maxiter": 1_000_000} if unbounded else {"maxiter": 1_000_000, "maxfun": 1_000_000}
    began = time.perf_counter()
    iterations, how = [0], "stopped at the limit"

    def count(_: Vector) -> None:
        iterations[0] += 1

    with suppress(_OutOfTimeError):
        how = minimize(cost, start, jac=True, method=name, bounds=bounds, options=options, callback=count).message
    return Attempt(trace[-1][1], iterations[0], time.perf_counter() - began, trace, how)


@dataclass(frozen=True)
class Bind:
    """What ``Problem.bind`` was called with; arguments are in the order of the kernel's symbols."""

    kernel: Kernel
    variables: list[Rows]
    parameters: list[NDArray[np.int64]]

    @classmethod
    def of(cls, kernel: Kernel, arguments: Mapping[str, Any]) -> Bind:
        """Arguments as they are given, by name."""
        given = arguments_by_name(kernel, arguments)
        rows = [rows for local in kernel.local_variables if isinstance(rows := given[local.name], Rows)]
        read = [p.positions for local in kernel.local_parameters if isinstance(p := given[local.name], Parameter)]
        return cls(kernel, rows, read)


@contextmanager
def recorded_binds() -> Iterator[list[Bind]]:
    """What ``Problem.bind`` is called with meanwhile."""
    binds: list[Bind] = []
    original = Problem.bind

    def bind(self: Problem, kernel: Kernel, bounds: Any = None, block: str = "", /, **arguments: Any) -> None:
        binds.append(Bind.of(kernel, arguments))
        original(self, kernel, bounds, block, **arguments)

    Problem.bind = bind  # type: ignore[method-assign]
    try:
        yield binds
    finally:
        Problem.bind = original  # type: ignore[method-assign]


def opti_cost(problem: Problem, binds: Sequence[Bind], x: ca.MX, p: ca.MX) -> ca.MX:
    """The cost as it is usually written: for each term and sample a call of its function, summed up."""
    total = ca.MX(0)
    for bind in binds:
        kernel = bind.kernel
        if not kernel.terms:
            continue
        weights = ca.SX.sym("weights", len(kernel.terms))
        value = ca.dot(weights, ca.vertcat(*kernel.terms.values()))
        function = ca.Function(kernel.name, [kernel.variables, kernel.parameters, weights], [value])
        weighted = p[[int(problem.parameters[f"weight.{term}"][0]) for term in kernel.terms]]
        reads = [_times(rows, problem.variables.size, x) for rows in bind.variables]
        for k in range(bind.variables[0].count):
            local = ca.vertcat(*[read[:, k] for read in reads])
            positions = [int(i) for rows in bind.parameters for i in rows[k if len(rows) > 1 else 0]]
            total += function(local, p[positions] if positions else ca.MX.zeros(0, 1), weighted)
    return total


def _times(rows: Rows, size: int, x: ca.MX) -> ca.MX:
    """What instances read, (d, K); columns of variables that were declared later are added."""
    matrix = rows.matrix.copy()
    matrix.resize((matrix.shape[0], size))
    return ca.reshape(ca.mtimes(to_dm(matrix), x) + rows.offset, rows.width, rows.count)


def opti(build: Build, programs: Sequence[Posed], limit: float, *, expand: bool = False) -> Run:
    """CasADi's usual way: the cost in one ``Opti`` problem, derivatives of the whole by CasADi, the same IPOPT.

    Args:
        build: makes the stage, of which only the kernels are used.
        programs: to solve, one after the other.
        limit: s for each.
        expand: turn the whole into scalar operations first, Opti's own option.
    """
    with recorded_binds() as binds:
        problem: Problem = build().solver.problem
    began = time.perf_counter()
    opti = ca.Opti()
    x = opti.variable(problem.variables.size)
    p, low, high = (opti.parameter(size) for size in (problem.parameters.size, x.numel(), x.numel()))
    opti.minimize(opti_cost(problem, binds, x, p))
    opti.subject_to(opti.bounded(low, x, high))
    # Bounds as bounds and not as rows of g, as all others have them.
    settings = {"expand": expand, "detect_simple_bounds": True, "print_time": False, "error_on_fail": False}
    attempts: list[Attempt] = []
    solving, used, repeated = 0.0, None, False
    for posed in programs:
        named = {**posed.options.ipopt(), "max_wall_time": limit}
        opti.set_value(p, posed.parameters)
        for symbol, bound in ((low, posed.lower), (high, posed.upper)):
            opti.set_value(symbol, np.clip(bound, -_IPOPT_INFINITY, _IPOPT_INFINITY))
        opti.set_initial(x, posed.start)
        if named != used:
            opti.solver("ipopt", settings, named)
            used = named
            # The first solve builds the derivatives as well; what it takes longer than a second one is building.
            opti.solve_limited()
            repeated = True
        started = time.perf_counter()
        opti.solve_limited()
        seconds = time.perf_counter() - started
        attempts.append(_ipopt_attempt(opti.stats(), seconds))
        solving += (2 if repeated else 1) * seconds
        repeated = False
    return Run(time.perf_counter() - began - solving, attempts)
