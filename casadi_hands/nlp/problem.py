"""A nonlinear program by name: variables, parameters, kernels bound to them, and the functions IPOPT wants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import scipy.sparse as sparse
from casadi import MX, Function
from numpy.typing import ArrayLike, NDArray

from casadi_hands.declared import Constraint, Term
from casadi_hands.nlp.arguments import Argument, arguments_by_name, check_arguments
from casadi_hands.nlp.assembly import Gathering, Reads, scatter_hessian, scatter_jacobian, together
from casadi_hands.nlp.derivatives import KernelFunctions, kernel_functions, portable_functions
from casadi_hands.nlp.kernel import Kernel
from casadi_hands.nlp.layout import Label, Layout, Parameter, Rows

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class _Bound:
    """A kernel with what each of its instances reads."""

    kernel: Kernel
    weights: NDArray[np.int64]
    selector: sparse.csr_array
    offset: Vector
    parameters: NDArray[np.int64]
    count: int
    first_row: int


@dataclass(frozen=True)
class _Mapped:
    """A kernel's functions, where its local variables stand among all that is read, and what its instances give them.

    Local variables, parameters and weights have a column for each instance.
    """

    bound: _Bound
    functions: KernelFunctions
    position: NDArray[np.int64]
    variables: MX
    parameters: MX
    weights: MX

    def call(self, role: str, *more: MX) -> Any:
        """A function of the kernel for all instances."""
        function: Function = getattr(self.functions, role)
        return function.map(self.bound.count)(self.variables, self.parameters, self.weights, *more)


class Problem:
    """Collects variables, parameters and kernels; ``functions`` then gives f, g and their exact derivatives.

    Built once for a structure and solved many times: weights, targets and bounds are parameters or bounds.
    Declare all variables before binding kernels.
    """

    def __init__(self) -> None:
        """Start empty."""
        self.variables = Layout()
        self.parameters = Layout()
        self.constraints = Layout()
        self.constraint_rows: dict[str, NDArray[np.int64]] = {}
        self.declared_constraints: dict[str, Constraint] = {}
        self.lower: Vector = np.empty(0)
        self.upper: Vector = np.empty(0)
        self.constraint_lower: Vector = np.empty(0)
        self.constraint_upper: Vector = np.empty(0)
        self._bound: list[_Bound] = []
        self._given: dict[str, Parameter] = {}

    def variable(
        self,
        name: str,
        shape: tuple[int, int],
        lower: ArrayLike = -np.inf,
        upper: ArrayLike = np.inf,
        *,
        quantity: str = "",
        owner: int | None = None,
    ) -> Rows:
        """A decision variable (K, d) with box bounds, broadcast to its shape.

        Args:
            name: unique in the problem.
            shape: (K, d).
            lower: bound.
            upper: bound.
            quantity: what it is, as kernels' symbols name it; by default its name.
            owner: which of several alike it belongs to.
        """
        indices = self.variables.add(name, shape)
        self.lower = np.append(self.lower, np.broadcast_to(np.asarray(lower, float), shape).reshape(-1))
        self.upper = np.append(self.upper, np.broadcast_to(np.asarray(upper, float), shape).reshape(-1))
        return Rows.of(indices, self.variables.size, Label(quantity or name, owner))

    def parameter(
        self,
        name: str,
        shape: tuple[int, int],
        *,
        quantity: str = "",
        owner: int | None = None,
        when: float | None = None,
    ) -> Parameter:
        """A parameter (K, d), to be bound to kernels, row k to instance k; see `variable`."""
        self._given[name] = Parameter(self.parameters.add(name, shape), Label(quantity or name, owner, when))
        return self._given[name]

    def given(self, *names: str) -> dict[str, Parameter]:
        """Parameters by name, as `bind` takes them.

        Raises:
            KeyError: one that was not declared.
        """
        return {name: self._given[name] for name in names}

    def __getitem__(self, name: str) -> Parameter:
        """A parameter that was declared."""
        return self._given[name]

    def bind(
        self,
        kernel: Kernel,
        bounds: Mapping[str, tuple[ArrayLike, ArrayLike]] | None = None,
        block: str = "",
        /,
        **arguments: Argument | Sequence[Argument],
    ) -> None:
        """Evaluate a kernel once for each row of its arguments; with none, only its constraints' names are known.

        Every symbol of the kernel is given by its name: a local variable the rows (K, d) it reads, a local parameter
        positions (K, d), or (1, d) where all instances share it. ``name=(a, b, …)`` gives ``name0``, ``name1``, ….

        Args:
            kernel: the block.
            bounds: lower and upper bound of each constraint, broadcast to its length in every instance.
            block: before the constraints' own names; by default the kernel's name.
            arguments: by name.

        Raises:
            TypeError: an argument that is missing or unknown.
            ValueError: one that is not of its symbol's size, or that is labelled as something else.
        """
        given = arguments_by_name(kernel, arguments)
        check_arguments(kernel, given)
        variables = [rows for local in kernel.local_variables if isinstance(rows := given[local.name], Rows)]
        parameters = [p.positions for local in kernel.local_parameters if isinstance(p := given[local.name], Parameter)]
        count, first = variables[0].count, self.constraints.size
        self._constrain(block or kernel.name, kernel, count, bounds or {})
        if not count:
            return
        rows = Rows.beside(variables)
        selector = rows.matrix
        selector.resize((selector.shape[0], self.variables.size))
        parts = [np.broadcast_to(p, (count, p.shape[1])) for p in parameters]
        positions = np.hstack(parts) if parts else np.zeros((count, 0), int)
        terms = list(kernel.terms)
        for term in terms:
            if f"weight.{term}" not in self.parameters:
                self.parameters.add(f"weight.{term}", (1,))
        weights = np.array([self.parameters[f"weight.{term}"][0] for term in terms], int)
        self._bound.append(_Bound(kernel, weights, selector, rows.offset, positions, count, first))

    def _constrain(
        self, block: str, kernel: Kernel, count: int, bounds: Mapping[str, tuple[ArrayLike, ArrayLike]]
    ) -> None:
        """Reserve the kernel's constraint rows, instance after instance, and set their bounds."""
        sizes = {name: g.numel() for name, g in kernel.constraints.items()}
        width = sum(sizes.values())
        if not width:
            return
        rows = self.constraints.add(block, (count, width))
        lower, upper = np.empty((count, width)), np.empty((count, width))
        start = 0
        for name, size in sizes.items():
            lower[:, start : start + size], upper[:, start : start + size] = bounds[name]
            self.constraint_rows[f"{block}.{name}"] = rows[:, start : start + size]
            self.declared_constraints[f"{block}.{name}"] = kernel.declared[name]
            start += size
        self.constraint_lower = np.append(self.constraint_lower, lower.reshape(-1))
        self.constraint_upper = np.append(self.constraint_upper, upper.reshape(-1))

    @property
    def terms(self) -> list[str]:
        """Names of all cost terms."""
        return list(dict.fromkeys(term for bound in self._bound for term in bound.kernel.terms))

    @property
    def declared_terms(self) -> dict[str, Term]:
        """All cost terms as declared, by their names in the problem."""
        return {name: term for bound in self._bound for name, term in bound.kernel.declared_terms.items()}

    def functions(self, portable: bool = False) -> dict[str, Function]:
        """For nlpsol ``nlp`` (x, p) -> (f, g), ``grad_f``, ``jac_g`` and ``hess_lag``; ``terms`` -> (f, g, terms).

        Args:
            portable: without machine code, so that they can be saved and loaded where there is nothing but CasADi.
        """
        x, p = MX.sym("x", self.variables.size), MX.sym("p", self.parameters.size)
        scale, multipliers = MX.sym("lam_f"), MX.sym("lam_g", self.constraints.size)
        differentiate = portable_functions if portable else kernel_functions
        kernels = differentiate([bound.kernel for bound in self._bound])
        reads = Reads([(bound.selector, bound.offset) for bound in self._bound], self.variables.size)
        z = reads.of(x)
        bindings = zip(self._bound, kernels, reads.positions, strict=True)
        mapped = [_Mapped(b, k, position, *_inputs(b, z[position.tolist()], p)) for b, k, position in bindings]
        values = [each.call("value") for each in mapped]
        gradients = [each.call("gradient") for each in mapped]
        f = sum((ca.sum2(total) for total, _, _ in values), MX(0))
        g = self._stacked([each for _, _, each in values])
        slopes = ca.vertcat(*[ca.vec(slope) for _, slope in gradients]) if gradients else MX(0, 1)
        gradient = reads.gradient(slopes)
        # Each function's own: what it took from another would be computed twice.
        same_f = sum((ca.sum2(total) for total, _ in gradients), MX(0))
        same_g, jacobian = self._jacobian(reads, mapped)
        terms = self._term_values([v[1] for v in values], p)
        return {
            "nlp": Function("nlp", [x, p], [f, g], ["x", "p"], ["f", "g"]),
            "grad_f": Function("nlp_grad_f", [x, p], [same_f, gradient], ["x", "p"], ["f", "grad_f_x"]),
            "jac_g": Function("nlp_jac_g", [x, p], [same_g, jacobian], ["x", "p"], ["g", "jac_g_x"]),
            "hess_lag": Function(
                "nlp_hess_l",
                [x, p, scale, multipliers],
                [self._hessian(reads, mapped, scale, multipliers)],
                ["x", "p", "lam_f", "lam_g"],
                ["triu_hess_gamma_x_x"],
            ),
            "terms": Function("terms", [x, p], [f, g, terms], ["x", "p"], ["f", "g", "terms"]),
        }

    def _term_values(self, values: list[MX], p: MX) -> MX:
        """Weighted total of each term, in the order of ``terms``."""
        totals = dict.fromkeys(self.terms, MX(0))
        for bound, terms in zip(self._bound, values, strict=True):
            sums = ca.sum2(terms)
            for i, name in enumerate(bound.kernel.terms):
                totals[name] = totals[name] + p[int(bound.weights[i])] * sums[i]
        return ca.vertcat(*totals.values())

    def _stacked(self, constraints: list[MX]) -> MX:
        """Constraints (rows of a kernel, instances) of all kernels in one column."""
        return ca.vertcat(*[ca.vec(g) for g in constraints if g.numel()]) if self.constraints.size else MX.zeros(0, 1)

    def _jacobian(self, reads: Reads, mapped: list[_Mapped]) -> tuple[MX, MX]:
        """The constraints and their Jacobian."""
        constraints, places, sources = [], [], []
        for each in mapped:
            bound, pattern = each.bound, each.functions.jacobian_pattern
            g, nonzeros = each.call("jacobian")
            constraints.append(g)
            if pattern.nnz():
                places.append(scatter_jacobian(each.position, bound.count, pattern, bound.first_row))
                sources.append(ca.vec(nonzeros))
        if not sources:
            return self._stacked(constraints), MX(self.constraints.size, self.variables.size)
        values = ca.vertcat(*sources)
        slopes = Gathering((self.constraints.size, reads.size), together(places), values.numel())
        return self._stacked(constraints), reads.jacobian(slopes).of(values)

    def _hessian(self, reads: Reads, mapped: list[_Mapped], scale: MX, multipliers: MX) -> MX:
        places, sources = [], []
        for each in mapped:
            bound, pattern = each.bound, each.functions.hessian_pattern
            if pattern.nnz():
                width = each.functions.jacobian_pattern.size1()
                local = multipliers[bound.first_row : bound.first_row + width * bound.count]
                local = ca.reshape(local, width, bound.count) if width else MX.zeros(0, bound.count)
                scales = ca.repmat(scale, 1, bound.count)
                places.append(scatter_hessian(each.position, bound.count, pattern))
                sources.append(ca.vec(each.call("hessian", scales, local)))
        if not sources:
            return MX(self.variables.size, self.variables.size)
        values = ca.vertcat(*sources)
        return reads.hessian(Gathering((reads.size, reads.size), together(places), values.numel())).of(values)


def _inputs(bound: _Bound, read: MX, p: MX) -> tuple[MX, MX, MX]:
    """Local variables, parameters and weights of all instances, by column, of what they read."""
    positions = bound.parameters.reshape(-1).tolist()
    parameters = ca.reshape(p[positions], -1, bound.count) if positions else MX.zeros(0, bound.count)
    weights = ca.repmat(p[bound.weights.tolist()], 1, bound.count) if bound.kernel.terms else MX.zeros(0, bound.count)
    return ca.reshape(ca.vec(read), -1, bound.count), parameters, weights
