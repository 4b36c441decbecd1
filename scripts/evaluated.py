"""What a stage's functions cost beside the same kernels, compiled with more optimising and called in a plain loop."""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from peers import Posed, recorded_solves
from profiled import CALLED

from casadi_hands.nlp import Problem, Solver, derivatives, machine_code
from casadi_hands.nlp.derivatives import KernelFunctions, kernel_functions
from casadi_hands.pipeline import solve
from casadi_hands.task import load_task

Vector = NDArray[np.float64]
FUNCTIONS = {"value": "nlp", "gradient": "grad_f", "Jacobian": "jac_g", "Hessian": "hess_lag"}
REPEATS, CALLS = 7, 20


def evaluation(task_file: Path) -> dict[str, dict[str, tuple[float, float, int]]]:
    """Seconds of one evaluation: stage -> function -> (of the whole problem, of its kernels alone in a loop, calls).

    Each stage's largest problem, where its first solve started. The loop gets what kernels read, and what they return
    is not put together. Calls are those of all the stage's solves.
    """
    largest: dict[str, tuple[Solver, Posed]] = {}
    calls: dict[str, Counter[str]] = defaultdict(Counter)
    stage = ""

    def hear(news: Any) -> None:
        nonlocal stage
        stage = news.stage

    with recorded_solves() as posed:
        recorded = Solver.solve

        def solved(solver: Solver, *given: Any, **named: Any) -> Any:
            solution = recorded(solver, *given, **named)
            stats = solver.nlpsol(posed[-1].options).stats()
            for function, names in CALLED.items():
                calls[stage][function] += sum(stats.get(f"n_call_{name}", 0) for name in names)
            size = solver.problem.variables.size
            if stage not in largest or size > largest[stage][0].problem.variables.size:
                largest[stage] = solver, posed[-1]
            return solution

        with patch.object(Solver, "solve", solved):
            solve(load_task(task_file), seed=0, jobs=1, progress=hear)
    return {
        name: {
            function: (*seconds, calls[name][function])
            for function, seconds in _compared(solver, each.start, each.parameters).items()
        }
        for name, (solver, each) in largest.items()
    }


def _compared(solver: Solver, x: Vector, p: Vector) -> dict[str, tuple[float, float]]:
    """Seconds of each function, and of its kernels alone."""
    problem = solver.problem
    multipliers = np.random.default_rng(0).normal(size=problem.constraints.size)
    with _optimised():
        kernels = kernel_functions([bound.kernel for bound in problem._bound])
    seconds = {}
    for name, function in FUNCTIONS.items():
        if name == "Jacobian" and not problem.constraints.size:
            continue
        more = [np.ones(1), multipliers] if name == "Hessian" else []
        ours = _seconds(solver.functions[function], [x, p, *more])
        loops = _loops(problem, kernels, name.lower(), x, p, multipliers)
        seconds[name] = ours, sum(_seconds(loop, inputs) for loop, inputs in loops)
    return seconds


def _loops(
    problem: Problem, kernels: Sequence[KernelFunctions], role: str, x: Vector, p: Vector, multipliers: Vector
) -> list[tuple[ca.Function, list[Vector]]]:
    """Each kernel's function for all its instances, with what they read."""
    loops = []
    for bound, kernel in zip(problem._bound, kernels, strict=True):
        if (role == "hessian" and not kernel.hessian_pattern.nnz()) or (role == "jacobian" and not _rows(kernel)):
            continue
        inputs = [
            bound.selector @ x + bound.offset,
            p[bound.parameters].reshape(-1),
            np.tile(p[bound.weights], bound.count),
        ]
        if role == "hessian":
            count = _rows(kernel) * bound.count
            inputs += [np.ones(bound.count), multipliers[bound.first_row : bound.first_row + count]]
        loops.append((getattr(kernel, role).map(bound.count), inputs))
    return loops


def _rows(kernel: KernelFunctions) -> int:
    return int(kernel.jacobian_pattern.size1())


@contextmanager
def _optimised() -> Any:
    """Kernels compiled with -O2 meanwhile, whatever their size."""
    with (
        patch.object(machine_code, "_OPTIMISED", ("-O2", "-O2")),
        patch.object(derivatives, "_known", {}),
    ):
        yield


def _seconds(function: ca.Function, inputs: Sequence[Vector]) -> float:
    """Of one call, the least of some repeated measurements."""
    buffer: Any  # CasADi's types ask for a size that its methods do not take
    buffer, call = function.buffer()
    arrays = [np.ascontiguousarray(each, float) for each in inputs]
    results = [np.zeros(function.nnz_out(i)) for i in range(function.n_out())]
    for index, array in enumerate(arrays):
        assert array.size == function.nnz_in(index)
        if array.size:
            buffer.set_arg(index, array.data)
    for index, array in enumerate(results):
        if array.size:
            buffer.set_res(index, array.data)
    call()
    best = np.inf
    for _ in range(REPEATS):
        began = time.perf_counter()
        for _ in range(CALLS):
            call()
        best = min(best, (time.perf_counter() - began) / CALLS)
    return float(best)
