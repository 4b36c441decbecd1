"""Solves against SciPy on the same problem, and results by name."""

from __future__ import annotations

import os
import subprocess
import sys

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import NonlinearConstraint, minimize

from casadi_hands.nlp import Constraint, Kernel, Options, Problem, Solution, Solver, Term

EXACT = Options(max_iter=200, tol=1e-10, acceptable_tol=1e-10, constr_viol_tol=1e-10)
TARGETS = np.array([[0.2, 1.4], [-0.3, 0.8], [1.5, 0.1]])
WEIGHTS = {"weight.near": 2.0, "weight.smooth": 0.7}


def chain() -> Problem:
    """Three points near targets, smooth, each outside a circle and within a box."""
    problem = Problem()
    points = problem.variable("points", (3, 2), -1.0, [[1.1, 2.0]], quantity="x")
    near, smooth, outside = Kernel("near"), Kernel("smooth"), Kernel("outside")
    near.cost(Term("near"), near.variable("x", 2) - near.parameter("target", 2))
    problem.bind(near, x=points, target=problem.parameter("targets", (3, 2), quantity="target"))
    before, after = (smooth.variable(f"x{i}", 2, "x", i) for i in range(2))
    smooth.cost(Term("smooth", form="sum"), (after - before) ** 2)
    problem.bind(smooth, x=(points.take([0, 1]), points.take([1, 2])))
    outside.constrain(Constraint("radius"), ca.sumsqr(outside.variable("x", 2)))
    problem.bind(outside, {"radius": (1.0, np.inf)}, x=points)
    return problem


def solve(**changes: object) -> Solution:
    start = {"points": TARGETS * 1.2}
    return Solver(chain()).solve(start, {"targets": TARGETS, **WEIGHTS}, EXACT, **changes)  # type: ignore[arg-type]


def objective(x: np.ndarray) -> float:
    points = x.reshape(3, 2)
    return float(2.0 * ((points - TARGETS) ** 2).sum() + 0.7 * (np.diff(points, axis=0) ** 2).sum())


@pytest.fixture(scope="module")
def solution() -> Solution:
    return solve()


@pytest.mark.filterwarnings("ignore:delta_grad")
@pytest.mark.parametrize("method", ["SLSQP", "trust-constr"])
def test_same_optimum_as_scipy(method: str, solution: Solution) -> None:
    bounds = [(-1, 1.1), (-1, 2)] * 3
    outside = NonlinearConstraint(lambda x: (x.reshape(3, 2) ** 2).sum(axis=1), 1, np.inf)
    options = {"maxiter": 500} if method == "SLSQP" else {"maxiter": 2000, "gtol": 1e-9, "xtol": 1e-10}
    start = np.clip((TARGETS * 1.2).ravel(), -1, [1.1, 2] * 3)
    tolerance = 1e-12 if method == "SLSQP" else None
    found = minimize(
        objective, start, method=method, bounds=bounds, constraints=outside, options=options, tol=tolerance
    )
    assert solution.status == "Solve_Succeeded"
    np.testing.assert_allclose(solution.values["points"].ravel(), found.x, atol=1e-4)
    assert solution.objective == pytest.approx(found.fun, abs=1e-6)


def test_results_by_name(solution: Solution) -> None:
    points = solution.values["points"]
    assert points.shape == (3, 2)
    assert solution.terms["near"] == pytest.approx(2.0 * ((points - TARGETS) ** 2).sum(), rel=1e-12)
    assert solution.terms["smooth"] == pytest.approx(0.7 * (np.diff(points, axis=0) ** 2).sum(), rel=1e-12)
    assert sum(solution.terms.values()) == pytest.approx(solution.objective, rel=1e-12)
    assert solution.violation < 1e-8


def test_box_bounds_are_kept_declared_and_changed(solution: Solution) -> None:
    assert solution.values["points"][:, 0].max() == pytest.approx(1.1, abs=1e-6)
    changed = solve(upper={"points": 0.9}, lower={"points": [[-0.2, 0.3]]})
    assert (changed.values["points"] <= 0.9 + 1e-7).all()
    assert (changed.values["points"] >= np.array([-0.2, 0.3]) - 1e-7).all()
    fixed = np.array([[0.5, 1.0], [0.0, 1.2], [1.0, 1.0]])
    held = solve(upper={"points": fixed}, lower={"points": fixed})
    np.testing.assert_allclose(held.values["points"], fixed, atol=1e-7)
    assert held.objective == pytest.approx(objective(fixed.ravel()), abs=1e-6)


def test_violation_of_an_impossible_problem_is_reported_not_hidden() -> None:
    inside = solve(upper={"points": 0.5}, lower={"points": -0.5})
    # The farthest corner of the box is at a squared radius of 0.5 where 1 is asked.
    assert inside.violation == pytest.approx(0.5, abs=1e-3)
    assert inside.status != "Solve_Succeeded"


def test_another_weight_is_another_solution_of_the_same_solver() -> None:
    solver = Solver(chain())
    values = {"targets": TARGETS, **WEIGHTS}
    loose = solver.solve({}, values, EXACT)
    stiff = solver.solve({}, {**values, "weight.smooth": 70.0}, EXACT)
    assert np.abs(np.diff(stiff.values["points"], axis=0)).sum() < np.abs(np.diff(loose.values["points"], axis=0)).sum()
    assert solver.evaluate(loose.values, values) == pytest.approx(loose.terms)


def test_a_missing_parameter_and_unknown_names_are_named() -> None:
    solver = Solver(chain())
    with pytest.raises(KeyError, match=r"parameters without a value: targets, weight\.smooth"):
        solver.solve({}, {"weight.near": 1.0})
    with pytest.raises(KeyError, match=r"parameters without a value: targets, weight\.smooth"):
        solver.evaluate({}, {"weight.near": 1.0})
    with pytest.raises(KeyError, match="'pionts' is not one of points"):
        solver.solve({"pionts": 0.0}, {"targets": TARGETS, **WEIGHTS})
    with pytest.raises(KeyError, match="'points' is not one of targets"):
        solver.solve({}, {"targets": TARGETS, **WEIGHTS, "points": 0.0})


def test_an_iteration_cap_ends_with_a_value() -> None:
    stopped = Solver(chain()).solve({}, {"targets": TARGETS, **WEIGHTS}, Options(max_iter=1))
    assert stopped.status == "Maximum_Iterations_Exceeded"
    assert stopped.iterations == 1
    assert np.isfinite(stopped.values["points"]).all()


NOT_STARTED = {
    "a start that is no number": ({"points": np.nan}, {}),
    "a target that is no number": ({}, {"targets": np.nan}),
    "an infinite target": ({}, {"targets": np.inf}),
    "a weight that is no number": ({}, {"weight.near": np.nan}),
}


@pytest.mark.parametrize("case", NOT_STARTED)
def test_a_solve_that_ipopt_does_not_start_ranks_last(case: str, solution: Solution) -> None:
    start, parameters = NOT_STARTED[case]
    solver = Solver(chain())
    for _ in range(2):  # the second time after a solve that went well
        stopped = solver.solve(start, {"targets": TARGETS, **WEIGHTS, **parameters}, EXACT)
        assert stopped.status == "Invalid_Number_Detected"
        assert stopped.objective == np.inf
        assert stopped.terms["near"] == np.inf
        assert stopped.iterations == 0
        assert min([stopped, solution], key=lambda each: each.objective) is solution
        # At the origin, where a start left out begins, each point is a whole squared radius inside its circle.
        expected = np.inf if start else 1.0
        assert stopped.violation == stopped.violations["outside.radius"] == expected
        assert solver.solve({}, {"targets": TARGETS, **WEIGHTS}, EXACT).objective == pytest.approx(solution.objective)


def test_numbers_are_those_of_the_point_returned_where_ipopt_evaluates_nothing() -> None:
    # Two equations in one unknown: IPOPT gives up at once, and its record says nothing of f and g.
    problem = Problem()
    x = problem.variable("x", (1, 1))
    kernel = Kernel("two")
    local = kernel.variable("x", 1)
    kernel.cost(Term("square"), local)
    kernel.constrain(Constraint("equations"), ca.vertcat(local, local**2 + 1))
    problem.bind(kernel, {"equations": (2.0, 2.0)}, x=x)
    stopped = Solver(problem).solve({"x": 1.5}, {"weight.square": 1.0})
    assert stopped.status == "Not_Enough_Degrees_Of_Freedom"
    assert stopped.values["x"].tolist() == [[1.5]]
    assert stopped.objective == stopped.terms["square"] == 1.5**2
    assert stopped.constraints["two.equations"].tolist() == [[1.5, 3.25]]
    assert stopped.violation == 1.25
    assert stopped.iterations == 0


def test_a_constraint_that_is_no_number_is_violated_without_bound() -> None:
    problem = Problem()
    x = problem.variable("x", (2, 1))
    kernel = Kernel("root")
    kernel.constrain(Constraint("root"), ca.sqrt(kernel.variable("x", 1)))
    problem.bind(kernel, {"root": (-np.inf, np.inf)}, x=x)
    stopped = Solver(problem).solve({"x": [[-1.0], [4.0]]}, {})
    assert stopped.violation == stopped.violations["root.root"] == np.inf
    assert stopped.constraints["root.root"][1, 0] == 2.0
    assert stopped.objective == 0


def test_constraints_by_name_and_with_other_bounds(solution: Solution) -> None:
    radii = (solution.values["points"] ** 2).sum(axis=1)
    np.testing.assert_allclose(solution.constraints["outside.radius"].ravel(), radii, atol=1e-12)
    assert solution.violations["outside.radius"] == pytest.approx(max(1 - radii.min(), 0), abs=1e-12)
    # The same solver, each point now on the circle.
    ring = solve(constraints={"outside.radius": (1.0, 1.0)})
    np.testing.assert_allclose((ring.values["points"] ** 2).sum(axis=1), 1, atol=1e-8)
    inside = solve(upper={"points": 0.5}, lower={"points": -0.5}, constraints={"outside.radius": (0.6, np.inf)})
    assert inside.violations["outside.radius"] == pytest.approx(0.1, abs=1e-3)


def test_a_solve_ends_where_multipliers_show_that_constraints_contradict_each_other() -> None:
    # Every point outside the unit circle and within a box that lies inside it.
    inside = {"lower": {"points": np.full((3, 2), -0.5)}, "upper": {"points": np.full((3, 2), 0.5)}}
    start, given = {"points": TARGETS}, {"targets": TARGETS, **WEIGHTS}
    runs = [
        Solver(chain()).solve(start, given, Options(max_iter=200, most_multiplier=limit), **inside)  # type: ignore[arg-type]
        for limit in (np.inf, 10.0)
    ]
    assert [run.status == "User_Requested_Stop" for run in runs] == [False, True]
    assert 0 < runs[1].iterations < runs[0].iterations
    assert runs[1].violation > 0.4
    # One that can be met is not disturbed.
    assert solve().status == "Solve_Succeeded"
    watched = Solver(chain()).solve(start, given, Options(max_iter=200, most_multiplier=1e7))
    assert watched.status == "Solve_Succeeded"


def test_an_interrupt_while_multipliers_are_watched_is_not_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[int] = []

    def look(_: object) -> np.ndarray:
        seen.append(1)
        if len(seen) == 3:
            raise KeyboardInterrupt
        return np.zeros(1)

    start, given, options = {"points": TARGETS}, {"targets": TARGETS, **WEIGHTS}, Options(most_multiplier=1e7)
    solver = Solver(chain())
    with monkeypatch.context() as patched:
        patched.setattr("casadi_hands.nlp.watch.np.abs", look)
        with pytest.raises(KeyboardInterrupt):
            solver.solve(start, given, options)
    assert len(seen) == 3
    assert solver.solve(start, given, options).status == "Solve_Succeeded"


def test_a_kernel_without_instances_changes_nothing_and_its_constraints_have_no_values() -> None:
    problem = Problem()
    x = problem.variable("x", (3, 2), -1, 1)
    kernel, idle = Kernel("near"), Kernel("idle")
    for one in (kernel, idle):
        a = one.variable("x", 2)
        one.cost(Term(f"from_{one.name}"), a - 0.5)
        one.constrain(Constraint("sum"), ca.sum1(a))
    problem.bind(kernel, {"sum": (-np.inf, 0.8)}, x=x)
    problem.bind(idle, {"sum": (-np.inf, 0.0)}, x=x.take([]))
    solution = Solver(problem).solve({}, {"weight.from_near": 1.0}, constraints={"idle.sum": (0.0, 0.0)})
    np.testing.assert_allclose(solution.values["x"], 0.4, atol=1e-4)
    assert list(solution.terms) == ["from_near"]
    assert solution.constraints["idle.sum"].shape == (0, 1)
    assert solution.violations["idle.sum"] == 0


def test_a_solve_starts_no_threads() -> None:
    # In a process of its own, where nothing has loaded the solver's linear algebra, which may start a thread a core.
    script = (
        "import os, pinocchio, casadi as ca\n"
        "from casadi_hands.nlp import Kernel, Problem, Solver, Term\n"
        "problem = Problem(); x = problem.variable('x', (1, 2))\n"
        "kernel = Kernel('k'); kernel.cost(Term('near'), kernel.variable('x', 2) - 1)\n"
        "problem.bind(kernel, x=x); before = len(os.listdir('/proc/self/task'))\n"
        "assert 'OPENBLAS_NUM_THREADS' not in os.environ\n"
        "Solver(problem).solve({}, {'weight.near': 1.0})\n"
        "assert 'OPENBLAS_NUM_THREADS' not in os.environ\n"
        "print(len(os.listdir('/proc/self/task')) - before)\n"
    )
    free = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run([sys.executable, "-c", script], env=free, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "0", done.stderr
