"""A small symbolic block - some cost terms and constraints in a few local variables - evaluated many times."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
from casadi import SX

from casadi_hands.declared import Constraint, Term


@dataclass(frozen=True)
class Local:
    """A local variable or parameter of a kernel.

    Attributes:
        name: unique in its kernel.
        symbol: (n,).
        quantity: what it is; only what is labelled so can be bound to it.
        place: its rank among several of one quantity: times in their order, or one body and another; None of one alone.
    """

    name: str
    symbol: SX
    quantity: str
    place: int | None

    @property
    def size(self) -> int:
        """Number of entries."""
        return int(self.symbol.numel())


class Kernel:
    """The symbols of one block and what it adds to the problem.

    Terms return residuals or plain values; the assembler weights, squares and sums them. Every term's weight is
    a parameter of the problem, ``weight.<term>``.
    """

    def __init__(self, name: str) -> None:
        """Start without variables, parameters or terms; ``name`` appears in errors and names the constraints."""
        self.name = name
        self.locals: dict[str, Local] = {}
        self._variables: list[Local] = []
        self._parameters: list[Local] = []
        self.terms: dict[str, SX] = {}
        self.constraints: dict[str, SX] = {}
        self.declared_terms: dict[str, Term] = {}
        self.declared: dict[str, Constraint] = {}

    def variable(self, name: str, size: int, quantity: str = "", place: int | None = None) -> SX:
        """A local variable (size,), bound by its name to rows of the problem's variables.

        Args:
            name: unique in the kernel.
            size: number of entries.
            quantity: what it is; by default its name.
            place: its rank, where the kernel reads several of one quantity.
        """
        return self._declare(self._variables, name, size, quantity, place)

    def parameter(self, name: str, size: int = 1, quantity: str = "", place: int | None = None) -> SX:
        """A local parameter (size,), bound by its name to entries of the problem's parameters; see `variable`."""
        return self._declare(self._parameters, name, size, quantity, place)

    def _declare(self, where: list[Local], name: str, size: int, quantity: str, place: int | None) -> SX:
        if name in self.locals:
            raise KeyError(f"kernel '{self.name}' already has a symbol '{name}'")
        self.locals[name] = Local(name, SX.sym(name, size), quantity or name, place)
        where.append(self.locals[name])
        return self.locals[name].symbol

    def cost(self, term: Term, residual: SX, scenario: str = "") -> None:
        """Add a cost: the sum of squares of a residual, or the plain sum of non-negative values, as the term says.

        Args:
            term: as declared.
            residual: (n,).
            scenario: appended to the term's name, where a kernel stands for another scenario than the first.
        """
        name = term.name + scenario
        if name in self.terms:
            raise KeyError(f"kernel '{self.name}' already has a term '{name}'")
        self.terms[name] = ca.sumsqr(residual) if term.form == "square" else ca.sum(residual)
        self.declared_terms[name] = term

    def constrain(self, declared: Constraint, expression: SX) -> None:
        """Add a constraint (n,); its bounds are given when the kernel is bound."""
        if declared.name in self.constraints:
            raise KeyError(f"kernel '{self.name}' already has a constraint '{declared.name}'")
        self.constraints[declared.name], self.declared[declared.name] = expression, declared

    @property
    def variables(self) -> SX:
        """All local variables in one column, in the order of their declaration."""
        return ca.vertcat(*[local.symbol for local in self._variables])

    @property
    def parameters(self) -> SX:
        """All local parameters in one column, likewise."""
        return ca.vertcat(*[local.symbol for local in self._parameters])

    @property
    def local_variables(self) -> tuple[Local, ...]:
        """The local variables, in the order of their declaration."""
        return tuple(self._variables)

    @property
    def local_parameters(self) -> tuple[Local, ...]:
        """The local parameters, likewise."""
        return tuple(self._parameters)
