"""Assembled derivatives against CasADi's own automatic ones, on kernels bound in every way the stages use."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from casadi import DM, MX, Function

from casadi_hands.nlp import Constraint, Kernel, Parameter, Problem, Rows, Term


def spring() -> Kernel:
    """Two terms and a constraint in two local variables; one parameter for each instance, one for all."""
    kernel = Kernel("spring")
    a, b = kernel.variable("a", 2), kernel.variable("b", 3)
    own, shared = kernel.parameter("own", 2), kernel.parameter("shared")
    kernel.cost(Term("stretch"), ca.vertcat(ca.sin(a[0]) * b[2] - own[0], a[1] * b[0] * shared))
    kernel.cost(Term("bump", form="sum"), ca.exp(ca.dot(a, own)) + b[1] ** 2)
    kernel.constrain(Constraint("circle"), ca.vertcat(ca.sumsqr(a) * b[0], b[1]))
    kernel.constrain(Constraint("product"), a[0] * b[2] * own[1])
    return kernel


def pull() -> Kernel:
    """Shares the term ``stretch``; no constraints, no parameters."""
    kernel = Kernel("pull")
    b = kernel.variable("b", 3)
    kernel.cost(Term("stretch"), ca.cos(b[0]) * b[1])
    kernel.cost(Term("far", form="sum"), b[2] ** 2 * b[0])
    return kernel


def only_bounds() -> Kernel:
    """A constraint and no cost."""
    kernel = Kernel("only_bounds")
    a = kernel.variable("a", 2)
    kernel.constrain(Constraint("hyperbola"), a[0] * a[1])
    return kernel


def cross() -> Kernel:
    """Two variables that may read the same."""
    kernel = Kernel("cross")
    a, b = kernel.variable("a", 2), kernel.variable("b", 2, "a")
    kernel.cost(Term("cross", form="sum"), ca.sin(a[0]) * b[0] + a[1] ** 2 * b[1] + a[0] * b[1])
    return kernel


class Example:
    """The same program twice: assembled, and written out instance by instance for CasADi to differentiate."""

    def __init__(self) -> None:
        rng = np.random.default_rng(4)
        self.problem = problem = Problem()
        first = problem.variable("first", (4, 2), quantity="a")
        second = problem.variable("second", (3, 3), -1, 1, quantity="b")
        own = problem.parameter("own", (5, 2))
        shared = problem.parameter("shared", (1, 1))
        self.mixing = [rng.normal(size=(5, 4)), rng.normal(size=(5, 3))]
        self.bindings: list[tuple[Kernel, list[np.ndarray], list[np.ndarray]]] = []
        mixed = first.combine(self.mixing[0])
        # By name, so in any order.
        self._bind(spring(), {"b": second.combine(self.mixing[1]), "a": mixed}, {"shared": shared, "own": own})
        self._bind(pull(), {"b": second.take([0, 2, 2, 1])})
        # The same expressions as another kernel's, twice; and the same variables.
        self._bind(cross(), {"a": mixed, "b": mixed})
        self._bind(cross(), {"a": first, "b": first})
        self._bind(only_bounds(), {"a": first.combine(np.abs(self.mixing[0]))})

    def _bind(self, kernel: Kernel, read: dict[str, Rows], given: dict[str, Parameter] | None = None) -> None:
        width, given = sum(g.numel() for g in kernel.constraints.values()), given or {}
        bounds = {name: (-np.inf, np.arange(g.numel()) + 0.5) for name, g in kernel.constraints.items()}
        self.problem.bind(kernel, bounds, **given, **read)
        rows = [read[local.name] for local in kernel.local_variables]
        parameters = [given[local.name].positions for local in kernel.local_parameters]
        size = self.problem.variables.size
        dense = [np.zeros((r.count, r.width, size)) for r in rows]
        for full, r in zip(dense, rows, strict=True):
            full[..., : r.matrix.shape[1]] = r.matrix.toarray().reshape(r.count, r.width, -1)
        self.bindings.append((kernel, dense, parameters))
        assert width == sum(g.numel() for g in kernel.constraints.values())

    def written_out(self) -> tuple[MX, MX, MX, MX]:
        """x, p, f and g without any assembly."""
        layout = self.problem.parameters
        x, p = MX.sym("x", self.problem.variables.size), MX.sym("p", layout.size)
        f, g = MX(0), []
        for kernel, rows, parameters in self.bindings:
            terms = ca.vertcat(*kernel.terms.values()) if kernel.terms else ca.SX.zeros(0, 1)
            constraints = ca.vertcat(*kernel.constraints.values()) if kernel.constraints else ca.SX.zeros(0, 1)
            function = Function("k", [kernel.variables, kernel.parameters], [terms, constraints])
            weights = [p[int(layout[f"weight.{name}"][0])] for name in kernel.terms]
            for k in range(len(rows[0])):
                local = ca.vertcat(*[ca.mtimes(MX(DM(r[k])), x) for r in rows])
                entries = [int(i) for q in parameters for i in np.broadcast_to(q, (len(rows[0]), q.shape[1]))[k]]
                values, bounded = function(local, p[entries] if entries else MX.zeros(0, 1))
                f = f + sum((w * values[i] for i, w in enumerate(weights)), MX(0))
                g.append(bounded)
        return x, p, f, ca.vertcat(*g)


@pytest.fixture(scope="module")
def example() -> Example:
    return Example()


@pytest.fixture
def at(example: Example, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    return rng.normal(size=example.problem.variables.size), rng.uniform(0.5, 2, example.problem.parameters.size)


def test_value_gradient_and_jacobian(example: Example, at) -> None:
    x, p, f, g = example.written_out()
    truth = Function("t", [x, p], [f, g, ca.gradient(f, x), ca.jacobian(g, x)])(*at)
    functions = example.problem.functions()
    value, constraints = functions["nlp"](*at)
    again, gradient = functions["grad_f"](*at)
    same, jacobian = functions["jac_g"](*at)
    assert float(value) == pytest.approx(float(truth[0]), rel=1e-13)
    assert float(again) == float(value)
    assert constraints.shape == (5 * 3 + 5, 1)
    for found, expected in ((constraints, truth[1]), (same, truth[1]), (gradient, truth[2]), (jacobian, truth[3])):
        np.testing.assert_allclose(np.asarray(found), np.asarray(expected), rtol=1e-12, atol=1e-12)


def test_hessian_of_the_lagrangian_is_the_upper_triangle(example: Example, at, rng: np.random.Generator) -> None:
    x, p, f, g = example.written_out()
    scale, multipliers = MX.sym("s"), MX.sym("l", g.numel())
    hessian = ca.hessian(scale * f + ca.dot(multipliers, g), x)[0]
    arguments = (*at, 0.7, rng.normal(size=g.numel()))
    truth = np.asarray(Function("t", [x, p, scale, multipliers], [hessian])(*arguments))
    found = example.problem.functions()["hess_lag"](*arguments)
    np.testing.assert_allclose(np.asarray(found), np.triu(truth), rtol=1e-11, atol=1e-11)
    assert found.sparsity().is_triu()


def test_gradient_agrees_with_finite_differences(example: Example, at) -> None:
    functions, h = example.problem.functions(), 1e-6
    values = [[float(functions["nlp"](at[0] + s * h * e, at[1])[0]) for s in (1, -1)] for e in np.eye(len(at[0]))]
    differences = np.array([(a - b) / (2 * h) for a, b in values])
    np.testing.assert_allclose(np.asarray(functions["grad_f"](*at)[1]).ravel(), differences, rtol=1e-5, atol=1e-5)


def test_terms_by_name_sum_to_the_objective_and_shared_names_add_up(example: Example, at) -> None:
    problem = example.problem
    terms = np.asarray(problem.functions()["terms"](*at)[2]).ravel()
    assert problem.terms == ["stretch", "bump", "far", "cross"]
    assert terms.sum() == pytest.approx(float(problem.functions()["nlp"](*at)[0]), rel=1e-12)
    # ``stretch`` of both kernels by hand.
    x, p = problem.variables.unpack(at[0]), problem.parameters.unpack(at[1])
    a, b = example.mixing[0] @ x["first"], example.mixing[1] @ x["second"]
    one = (np.sin(a[:, 0]) * b[:, 2] - p["own"][:, 0]) ** 2 + (a[:, 1] * b[:, 0] * p["shared"][0, 0]) ** 2
    b = x["second"][[0, 2, 2, 1]]
    two = (np.cos(b[:, 0]) * b[:, 1]) ** 2
    assert terms[0] == pytest.approx(p["weight.stretch"][0] * (one.sum() + two.sum()), rel=1e-12)


def test_bounds_of_constraints_follow_their_rows(example: Example) -> None:
    assert example.problem.constraint_upper.tolist() == [0.5, 1.5, 0.5] * 5 + [0.5] * 5
    assert (example.problem.constraint_lower == -np.inf).all()


def test_a_single_number_is_a_column_too() -> None:
    problem, kernel = Problem(), Kernel("one")
    both = problem.variable("both", (2, 1), quantity="y")
    y = kernel.variable("y", 1)
    kernel.cost(Term("distance"), y - 1)
    kernel.constrain(Constraint("above"), y)
    problem.bind(kernel, {"above": (0, np.inf)}, y=both.combine([[1, 1]]))
    functions, x = problem.functions(), [0.5, 2.0]
    np.testing.assert_allclose(np.asarray(functions["grad_f"](x, 1.0)[1]).reshape(-1), [3, 3])
    np.testing.assert_allclose(np.asarray(functions["jac_g"](x, 1.0)[1]), [[1, 1]])
    np.testing.assert_allclose(np.asarray(functions["hess_lag"](x, 1.0, 1.0, 0.0)), [[2, 2], [0, 2]])


def test_a_kernel_that_is_refused_leaves_nothing_behind() -> None:
    problem = Problem()
    a, b = problem.variable("a", (4, 2)), problem.variable("b", (4, 3))
    own, shared = problem.parameter("own", (3, 2)), problem.parameter("shared", (1, 1))
    with pytest.raises(ValueError, match=r"spring\.own: rows \(3, 2\), expected \(4, 2\)"):
        problem.bind(spring(), {"circle": (0, 1), "product": (0, 1)}, a=a, b=b, own=own, shared=shared)
    assert problem.constraints.size == 0
    assert problem.terms == []


def test_an_argument_may_be_named_as_what_bind_itself_is_given() -> None:
    problem, kernel = Problem(), Kernel("names")
    symbols = [kernel.variable(name, 1) for name in ("kernel", "bounds", "block", "self")]
    kernel.constrain(Constraint("sum"), sum(symbols, ca.SX(0)))
    rows = {name: problem.variable(name, (2, 1)) for name in kernel.locals}
    problem.bind(kernel, {"sum": (0.0, 1.0)}, "frame", **rows)
    assert list(problem.constraint_rows) == ["frame.sum"]


def test_a_kernel_names_nothing_twice() -> None:
    kernel = Kernel("twice")
    x = kernel.variable("x", 1)
    kernel.cost(Term("once"), x)
    with pytest.raises(KeyError, match="kernel 'twice' already has a term 'once'"):
        kernel.cost(Term("once"), ca.SX(0))
    kernel.constrain(Constraint("positive"), x)
    with pytest.raises(KeyError, match="kernel 'twice' already has a constraint 'positive'"):
        kernel.constrain(Constraint("positive"), -x)
    assert kernel.constraints["positive"] is x


def test_a_kernel_s_symbols_keep_what_they_are() -> None:
    kernel = Kernel("names")
    kernel.variable("pose_before", 6, "pose", -1)
    kernel.parameter("palm_radius")
    kernel.variable("pose", 6, place=0)
    kernel.parameter("inertia", 9)
    locals_of = [
        [(s.name, s.size, s.quantity, s.place) for s in which]
        for which in (kernel.local_variables, kernel.local_parameters)
    ]
    assert locals_of[0] == [("pose_before", 6, "pose", -1), ("pose", 6, "pose", 0)]
    assert locals_of[1] == [("palm_radius", 1, "palm_radius", None), ("inertia", 9, "inertia", None)]
    assert list(kernel.locals) == ["pose_before", "palm_radius", "pose", "inertia"]
    for declare in (kernel.variable, kernel.parameter):
        with pytest.raises(KeyError, match="kernel 'names' already has a symbol 'inertia'"):
            declare("inertia", 9)
