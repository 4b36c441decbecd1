"""Each return status of IPOPT has a meaning, and what a library says of an error names none of its files."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from casadi_hands.nlp import Constraint, Kernel, Options, Problem, Solution, Solver, SolverError, Term
from casadi_hands.nlp.failure import words_of
from casadi_hands.nlp.status import STATUSES, status_of


def test_every_status_of_the_ipopt_that_casadi_brings_has_a_meaning() -> None:
    header = Path(ca.__file__).parent / "include" / "coin-or" / "IpReturnCodes_inc.h"
    codes = re.search(r"enum ApplicationReturnStatus\s*\{(.*?)\};", header.read_text(encoding="utf-8"), re.DOTALL)
    assert codes
    names = re.findall(r"^\s*(\w+)\s*=\s*-?\d+", codes[1], re.MULTILINE)
    assert len(names) > 15
    assert set(names) == set(STATUSES)


def test_an_unknown_status_is_broken_and_told() -> None:
    found = status_of("Moon_In_The_Way")
    assert found.kind == "broken"
    assert "'Moon_In_The_Way'" in found.words


def line(least: float = -np.inf, most: float = np.inf, outward: bool = False) -> Solver:
    """A point on a line: (x - 2)², x + y within bounds, a limit on y that is never reached."""
    problem = Problem()
    x, y = problem.variable("x", (1, 1), -10, 10), problem.variable("y", (1, 1), -0.5, 3)
    kernel = Kernel("line")
    at, beside = kernel.variable("x", 1), kernel.variable("y", 1)
    kernel.cost(Term("near"), ca.log(at) if outward else at - 2)
    kernel.cost(Term("small"), beside)
    kernel.constrain(Constraint("sum"), at + beside)
    kernel.constrain(Constraint("free"), beside)
    problem.bind(kernel, {"sum": (least, most), "free": (-5.0, 5.0)}, x=x, y=y)
    return Solver(problem)


def solved(solver: Solver, options: Options | None = None, x: float = 1.0) -> Solution:
    weights = {"weight.near": 1.0, "weight.small": 1.0}
    exact = Options(tol=1e-9, acceptable_tol=1e-9, constr_viol_tol=1e-9)
    return solver.solve({"x": x}, weights, options or exact)


@pytest.mark.parametrize(
    ("solve", "name", "kind"),
    [
        (lambda: solved(line()), "Solve_Succeeded", "solved"),
        (lambda: solved(line(), Options(max_iter=1)), "Maximum_Iterations_Exceeded", "stopped"),
        (lambda: solved(line(least=20)), "Infeasible_Problem_Detected", "stuck"),
        (lambda: solved(line(outward=True), x=-1.0), "Invalid_Number_Detected", "stuck"),
        (lambda: solved(line(least=20), Options(most_multiplier=1.0)), "User_Requested_Stop", "stopped"),
    ],
)
def test_statuses_as_they_come(solve: Callable[[], Solution], name: str, kind: str) -> None:
    solution = solve()
    assert solution.status == name
    assert status_of(name).kind == kind
    assert np.isfinite(solution.values["x"]).all()


def test_after_a_status_that_leaves_nothing_to_judge_the_solver_says_so() -> None:
    options = Options(extra=(("linear_solver", "pardiso"), ("pardisolib", "none")))
    with pytest.raises(SolverError, match=r"^IPOPT was given an option that it does not have$"):
        solved(line(), options)


def test_multipliers_are_what_a_wider_limit_gains() -> None:
    """The least of (x - 2)² + y² where x + y <= 1 is at (1.5, -0.5), by hand, where y is at its bound, too."""
    tight = solved(line(most=1))
    np.testing.assert_allclose([tight.values["x"], tight.values["y"]], [[[1.5]], [[-0.5]]], atol=1e-4)
    # The derivative of 0.25 by the limit is 2 (1.5 - 2) in size; y's bound bears what is left of it, 2 · 0.5 - 1 = 0.
    assert tight.multipliers["line.sum"] == pytest.approx(np.array([[1.0]]), abs=1e-3)
    assert tight.multipliers["line.free"] == pytest.approx(np.array([[0.0]]), abs=1e-6)
    assert tight.bound_multipliers["x"] == pytest.approx(np.array([[0.0]]), abs=1e-6)
    wider = solved(line(most=1.01))
    assert (tight.objective - wider.objective) / 0.01 == pytest.approx(1.0, abs=0.02)


def test_limits_that_contradict_each_other_have_the_largest_multipliers() -> None:
    stuck = solved(line(least=20), Options(most_multiplier=1e4))
    sizes = {
        "sum": stuck.multipliers["line.sum"].max(),
        "x": stuck.bound_multipliers["x"].max(),
        "y": stuck.bound_multipliers["y"].max(),
    }
    # x <= 10 and y <= 3 keep x + y from 20: all three pull at each other with one force.
    assert min(sizes.values()) == pytest.approx(max(sizes.values()), rel=0.01)
    assert stuck.multipliers["line.free"].max() < 1e-3 * max(sizes.values())


def test_an_equation_has_no_multiplier_of_a_limit() -> None:
    assert solved(line(least=1, most=1)).multipliers["line.sum"].max() == 0


X = ca.MX.sym("x", 2)


def plain(**options: object) -> ca.Function:
    quiet = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False}
    return ca.nlpsol("s", "ipopt", {"x": X, "f": ca.sumsqr(X)}, {**quiet, **options})


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: plain()(x0=[1, 2, 3]), "Input 0 (x0) has mismatching shape. Got 3-by-1"),
        (lambda: plain()(lbx=[1, 1], ubx=[0, 0]), "LBX[0] <= UBX[0] was violated"),
        (lambda: plain(**{"ipopt.nonsense": 1}), "No such IPOPT option: nonsense"),
        (lambda: plain(error_on_fail=True, **{"ipopt.max_iter": 0})(x0=[1, 2]), "nlpsol process failed"),
        (lambda: ca.Function("f", [X], [X])(1, 2), "Incorrect number of inputs: Expected 1, got 2"),
        (lambda: ca.external("f", "/nowhere/none.so"), "Cannot load shared library"),
        (lambda: ca.Function("f", [X], [ca.inv(ca.MX(2, 3))]), "dimension mismatch"),
    ],
)
def test_no_file_of_a_library_is_named(call: Callable[[], object], words: str) -> None:
    with pytest.raises(RuntimeError) as caught:
        call()
    told = words_of(caught.value)
    assert words.lower() in told.lower()
    assert not re.search(r"\.(cpp|hpp|h|so|py)\b|/\w+/|Error in|Assertion|\n", told), told
    assert len(told) <= 300


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("/build/src/casadi/core/nlpsol.cpp:731: out of luck", "out of luck"),
        (r"C:\casadi\core\nlpsol.cpp:7: out of luck", "out of luck"),
        ('Traceback (most recent call last):\n  File "/usr/lib/x.py", line 3, in f\nout of luck', "out of luck"),
        ("std::bad_alloc", "std::bad_alloc"),
        ("", "it gives no reason (RuntimeError)"),
        (".../casadi/core/nlpsol.cpp:731:", "it gives no reason (RuntimeError)"),
        ("a / b is 1/2 at 3.5 m/s", "a / b is 1/2 at 3.5 m/s"),
    ],
)
def test_words_without_places(text: str, words: str) -> None:
    assert words_of(RuntimeError(text)) == words
