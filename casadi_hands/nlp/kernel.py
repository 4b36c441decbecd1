"""A small symbolic block - some cost terms and constraints in a few local variables - evaluated many times."""

from __future__ import annotations

from typing import Literal

import casadi as ca
from casadi import SX


class Kernel:
    """The symbols of one block and what it adds to the problem.

    Terms return residuals or plain values; the assembler weights, squares and sums them. Every term's weight is
    a parameter of the problem, ``weight.<term>``.
    """

    def __init__(self, name: str) -> None:
        """Start without variables, parameters or terms; ``name`` appears in errors and names the constraints."""
        self.name = name
        self._variables: list[tuple[str, SX]] = []
        self._parameters: list[tuple[str, SX]] = []
        self.terms: dict[str, SX] = {}
        self.constraints: dict[str, SX] = {}

    def variable(self, name: str, size: int) -> SX:
        """A local variable (size,), to be bound to rows of the problem's variables in the order of declaration."""
        symbol = SX.sym(name, size)
        self._variables.append((name, symbol))
        return symbol

    def parameter(self, name: str, size: int = 1) -> SX:
        """A local parameter (size,), bound to entries of the problem's parameters in the order of declaration."""
        symbol = SX.sym(name, size)
        self._parameters.append((name, symbol))
        return symbol

    def cost(self, name: str, residual: SX, form: Literal["square", "sum"] = "square") -> None:
        """Add a cost: the sum of squares of a residual, or the plain sum of non-negative values."""
        if name in self.terms:
            raise KeyError(f"kernel '{self.name}' already has a term '{name}'")
        self.terms[name] = ca.sumsqr(residual) if form == "square" else ca.sum(residual)

    def constrain(self, name: str, expression: SX) -> None:
        """Add a constraint (n,); its bounds are given when the kernel is bound."""
        if name in self.constraints:
            raise KeyError(f"kernel '{self.name}' already has a constraint '{name}'")
        self.constraints[name] = expression

    @property
    def variables(self) -> SX:
        """All local variables in one column."""
        return ca.vertcat(*[symbol for _, symbol in self._variables])

    @property
    def parameters(self) -> SX:
        """All local parameters in one column."""
        return ca.vertcat(*[symbol for _, symbol in self._parameters])

    @property
    def variable_sizes(self) -> list[tuple[str, int]]:
        """Name and size of each local variable."""
        return [(name, symbol.numel()) for name, symbol in self._variables]

    @property
    def parameter_sizes(self) -> list[tuple[str, int]]:
        """Name and size of each local parameter."""
        return [(name, symbol.numel()) for name, symbol in self._parameters]
