"""The optimisers that the benchmark compares: on one problem with a known minimum they all find it, from one start."""

from __future__ import annotations

from functools import partial

import casadi as ca
import numpy as np
import pytest
from peers import Method, Posed, by_scipy, opti, opti_cost, ours, recorded_binds, recorded_solves
from scipy.optimize import minimize, rosen

from casadi_hands.nlp import Constraint, Kernel, Options, Problem, Solver, Term

OPTIONS = Options(tol=1e-9, acceptable_tol=1e-9)
START = np.array([0.1, 0.6, -0.2, 0.4])
MOVED = 0.2  # that kernels read the variables by
METHODS: dict[str, Method] = {
    "ours": ours,
    "limited memory": partial(ours, limited_memory=True),
    "L-BFGS-B": partial(by_scipy, name="L-BFGS-B"),
    "L-BFGS-B, interpreted": partial(by_scipy, name="L-BFGS-B", interpreted=True),
    "BFGS": partial(by_scipy, name="BFGS"),
    "opti": opti,
    "expanded": partial(opti, expand=True),
}


class Valley:
    """Rosenbrock's function of four variables about a shifted origin, with a constraint that its minimum breaks."""

    def __init__(self) -> None:
        kernel = Kernel("valley")
        # Its symbols in another order than they are bound in, where names alone tell them apart.
        width = kernel.parameter("width")
        x, y = (kernel.variable(f"x{i}", 1, "x", i) for i in range(2))
        shift = kernel.parameter("shift")
        kernel.cost(Term("bend"), y - shift - (x - shift) ** 2)
        kernel.cost(Term("way"), (1 - (x - shift)) / width)
        kernel.constrain(Constraint("sum"), x + y)
        problem = Problem()
        point = problem.variable("point", (4, 1), quantity="x")
        problem.variable("unused", (1, 1), -1, 1)
        for name in ("shift", "width"):
            problem.parameter(name, (1, 1))
        moved = point.plus(np.full((4, 1), MOVED))
        both, limits = (moved.take([0, 1, 2]), moved.take([1, 2, 3])), {"sum": (-50.0, 0.5 + 2 * MOVED)}
        problem.bind(kernel, limits, "dale", x=both, **problem.given("shift", "width"))
        self.solver = Solver(problem)

    def solve(self) -> None:
        parameters = {"shift": 0.3 + MOVED, "width": 1.0, "weight.bend": 100.0, "weight.way": 1.0}
        upper = {"point": np.array([[0.8], [5], [5], [5]])}
        self.solver.solve({"point": START[:, None] + 0.3}, parameters, OPTIONS, {"point": np.array(-5.0)}, upper=upper)


@pytest.fixture(scope="module")
def posed() -> Posed:
    valley = Valley()
    with recorded_solves() as programs:
        valley.solve()
    (only,) = programs
    return only


def test_programs_are_recorded_as_they_were_posed(posed: Posed) -> None:
    np.testing.assert_array_equal(posed.start, [*(START + 0.3), 0])
    np.testing.assert_array_equal(posed.lower, [-5, -5, -5, -5, -1])
    np.testing.assert_array_equal(posed.upper, [0.8, 5, 5, 5, 1])
    np.testing.assert_array_equal(posed.parameters, [0.3 + MOVED, 1, 100, 1])
    assert posed.options is OPTIONS


@pytest.mark.parametrize("name", METHODS)
def test_all_find_the_minimum_within_bounds_from_the_same_start(name: str, posed: Posed) -> None:
    # Unshifted, the first variable is at most 0.5, so that the minimum is not the valley's own.
    bounds = [(-5.3, 0.5), *[(-5.3, 4.7)] * 3]
    expected = minimize(rosen, START, method="SLSQP", bounds=bounds, options={"ftol": 1e-14, "maxiter": 1000}).fun
    assert expected > 0.1
    run = METHODS[name](Valley, [posed, posed], 20.0)
    assert run.building > 0
    for attempt in run.attempts:
        assert attempt.objective == pytest.approx(expected, rel=1e-5)
        assert attempt.trace[0][1] == pytest.approx(rosen(START), rel=1e-6)
        # No more of the clock: how long the rest of a solve takes is up to the machine.
        assert 0 < attempt.trace[-1][0] <= attempt.seconds * (1 + 1e-9)
        assert attempt.trace[-1][1] == attempt.objective
        assert (np.diff([objective for _, objective in attempt.trace]) <= 0).all()
        assert 5 < attempt.iterations < 500


def test_constraints_count_only_where_asked_for(posed: Posed) -> None:
    free, held = (ours(Valley, [posed], 20.0, constrained=constrained).attempts[0] for constrained in (False, True))
    sums = [{"type": "ineq", "fun": lambda x, i=i: 0.5 - 0.6 - x[i] - x[i + 1]} for i in range(3)]
    bounds = [(-5.3, 0.5), *[(-5.3, 4.7)] * 3]
    options = {"ftol": 1e-14, "maxiter": 1000}
    best = minimize(rosen, START, method="SLSQP", bounds=bounds, constraints=sums, options=options).fun
    assert held.trace[-1][1] != pytest.approx(free.objective, rel=0.1)
    assert held.objective == pytest.approx(best, rel=1e-4)


@pytest.mark.parametrize("name", ["L-BFGS-B", "BFGS"])
def test_a_limit_of_time_leaves_the_best_until_then(name: str, posed: Posed) -> None:
    (attempt,) = by_scipy(Valley, [posed], 0.0, name=name).attempts
    assert attempt.how == "stopped at the limit"
    assert attempt.objective == pytest.approx(rosen(START), rel=1e-9)


def test_the_cost_written_for_opti_is_the_problem_s(posed: Posed) -> None:
    with recorded_binds() as binds:
        problem = Valley().solver.problem
    x, p = ca.MX.sym("x", 5), ca.MX.sym("p", 4)
    cost = ca.Function("cost", [x, p], [opti_cost(problem, binds, x, p)])
    for point in np.random.default_rng(0).uniform(-2, 2, (5, 4)):
        assert float(cost([*(point + 0.3), 0.1], posed.parameters)) == pytest.approx(rosen(point), rel=1e-12)
