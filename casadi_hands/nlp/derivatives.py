"""Exact derivatives of kernels, as machine code where possible."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import casadi as ca
from casadi import SX, Function, Sparsity

from casadi_hands.nlp.kernel import Kernel
from casadi_hands.nlp.machine_code import Source, compiled

_known: dict[str, KernelFunctions] = {}  # of this process, by what the kernel computes
_ROLES = ("value", "gradient", "jacobian", "hessian")
_REVISION = "1"  # of how kernels are differentiated: compiled ones are kept by it and by what they compute


@dataclass(frozen=True)
class KernelFunctions:
    """A kernel's value, gradient, Jacobian and Hessian in its local variables, as machine code where possible.

    Sparse results are columns of their nonzeros, with the patterns given here.

    Attributes:
        value: (x, p, weights) -> (weighted sum of the terms, terms, g).
        gradient: (x, p, weights) -> (weighted sum, its gradient).
        jacobian: (x, p, weights) -> (g, nonzeros of its Jacobian).
        hessian: (x, p, weights, scale, multipliers) -> nonzeros of the Lagrangian's upper Hessian.
        jacobian_pattern: of one instance.
        hessian_pattern: of one instance.
    """

    value: Function
    gradient: Function
    jacobian: Function
    hessian: Function
    jacobian_pattern: Sparsity
    hessian_pattern: Sparsity


class _Symbols:
    """A kernel's terms and constraints as expressions of all its inputs; weights are in the order of its terms.

    Attributes:
        inputs: local variables, parameters and weights.
        values: the terms.
        g: the constraints.
        total: the weighted sum of the terms.
        value: (x, p, weights) -> (total, terms, g).
        content: a hash of what ``value`` computes, and of how it is differentiated.
    """

    def __init__(self, kernel: Kernel) -> None:
        self.inputs = (kernel.variables, kernel.parameters, SX.sym("weights", len(kernel.terms)))
        values = ca.vertcat(*kernel.terms.values()) if kernel.terms else SX.zeros(0, 1)
        g = ca.vertcat(*kernel.constraints.values()) if kernel.constraints else SX.zeros(0, 1)
        # What stands twice in them stands many times in their derivatives.
        self.values, self.g = ca.cse([values, g])
        self.total = ca.dot(self.inputs[2], self.values) if self.values.numel() else SX(0)
        self.value = Function("value", [*self.inputs], [self.total, ca.densify(self.values), ca.densify(self.g)])
        self.content = hashlib.sha256(f"{_REVISION}|{self.value.serialize()}".encode()).hexdigest()

    def differentiated(self) -> dict[str, Function]:
        """Functions by role: those of ``KernelFunctions``, and ``patterns`` () -> zeros with its two patterns."""
        x, total = self.inputs[0], self.total
        scale, multipliers = SX.sym("scale"), SX.sym("multipliers", self.g.numel())
        jacobian = ca.jacobian(self.g, x)
        hessian, _ = ca.hessian(scale * total + ca.dot(multipliers, self.g), x)
        upper = ca.triu(hessian)
        return {
            "value": self.value,
            "gradient": Function("gradient", [*self.inputs], [total, ca.densify(ca.gradient(total, x))]),
            "jacobian": Function("jacobian", [*self.inputs], [ca.densify(self.g), _nonzeros(jacobian)]),
            "hessian": Function("hessian", [*self.inputs, scale, multipliers], [_nonzeros(upper)]),
            "patterns": Function("patterns", [], [SX(matrix.sparsity(), 0) for matrix in (jacobian, upper)]),
        }


_symbols = cache(_Symbols)  # a kernel is complete once it is bound


def kernel_functions(kernels: Sequence[Kernel]) -> list[KernelFunctions]:
    """Differentiate kernels; those that compute the same share their functions."""
    symbols = [_symbols(kernel) for kernel in kernels]
    new = {s.content: (kernel.name, s) for kernel, s in zip(kernels, symbols, strict=True) if s.content not in _known}
    sources = [Source(name, s.content, (*_ROLES, "patterns"), s.differentiated) for name, s in new.values()]
    _known.update((content, _gathered(found)) for content, found in zip(new, compiled(sources), strict=True))
    return [_known[s.content] for s in symbols]


def portable_functions(kernels: Sequence[Kernel]) -> list[KernelFunctions]:
    """The same functions as CasADi's own expressions: slower, but they refer to nothing outside, so can be saved."""
    symbols = [_symbols(kernel) for kernel in kernels]
    known = {s.content: _gathered(s.differentiated()) for s in {s.content: s for s in symbols}.values()}
    return [known[s.content] for s in symbols]


def _gathered(functions: Mapping[str, Function]) -> KernelFunctions:
    """Functions by role, with the patterns that one of them has."""
    patterns = functions["patterns"]
    return KernelFunctions(
        **{role: functions[role] for role in _ROLES},
        jacobian_pattern=patterns.sparsity_out(0),
        hessian_pattern=patterns.sparsity_out(1),
    )


def _nonzeros(matrix: SX) -> SX:
    return ca.densify(matrix.nz[:]) if matrix.nnz() else SX.zeros(0, 1)
