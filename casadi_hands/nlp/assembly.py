"""Partially separable assembly: each kernel's exact derivatives, mapped over its instances and scattered.

With x_k = S_k x the local variables of instance k, the gradient is the sum of S_kᵀ g_k and the Hessian the sum
of S_kᵀ H_k S_k. S_k is constant, so each global nonzero is a fixed linear combination of local nonzeros: one
sparse matrix-vector product.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np
import scipy.sparse as sparse
from casadi import DM, MX, SX, Function, Sparsity
from numpy.typing import NDArray

from casadi_hands.nlp.kernel import Kernel
from casadi_hands.nlp.machine_code import Source, compiled

Indices = NDArray[np.int64]
_known: dict[str, KernelFunctions] = {}  # of this process, by what the kernel computes
_ROLES = ("value", "gradient", "jacobian", "hessian")
_REVISION = "1"  # of how kernels are differentiated: compiled ones are kept by it and by what they compute


def to_dm(matrix: sparse.sparray) -> DM:
    """A SciPy sparse matrix as a CasADi one with the same pattern."""
    columns = sparse.csc_array(matrix)
    columns.sort_indices()
    height, width = matrix.shape
    pattern = Sparsity(height, width, columns.indptr.tolist(), columns.indices.tolist())
    return DM(pattern, columns.data.tolist())  # CasADi takes lists three times as fast as arrays


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
    for content, functions in zip(new, compiled(sources), strict=True):
        patterns = functions["patterns"]
        _known[content] = KernelFunctions(
            **{role: functions[role] for role in _ROLES},
            jacobian_pattern=patterns.sparsity_out(0),
            hessian_pattern=patterns.sparsity_out(1),
        )
    return [_known[s.content] for s in symbols]


def _nonzeros(matrix: SX) -> SX:
    return ca.densify(matrix.nz[:]) if matrix.nnz() else SX.zeros(0, 1)


def _expand(rows: sparse.csr_array, wanted: Indices) -> tuple[Indices, Indices, NDArray[np.float64]]:
    """All nonzeros of the wanted rows: position in ``wanted``, column, value."""
    counts = rows.indptr[wanted + 1] - rows.indptr[wanted]
    owner = np.repeat(np.arange(len(wanted)), counts)
    offset = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    position = rows.indptr[wanted][owner] + offset
    return owner, rows.indices[position].astype(np.int64), rows.data[position]


def scatter_jacobian(
    selector: sparse.csr_array, count: int, pattern: Sparsity, first_row: int
) -> tuple[Indices, Indices, Indices, NDArray[np.float64]]:
    """Where local Jacobian nonzeros go: (global row, global column, source, weight).

    Args:
        selector: (count·n, nx) stacked S_k.
        count: number of instances.
        pattern: sparsity (m, n) of one local Jacobian.
        first_row: global row of the first constraint of the first instance.
    """
    local_row, local_column = (np.array(v, dtype=np.int64) for v in pattern.get_triplet())
    m, n = pattern.shape
    instance = np.repeat(np.arange(count), len(local_row))
    owner, column, weight = _expand(selector, instance * n + np.tile(local_column, count))
    row = first_row + instance * m + np.tile(local_row, count)
    return row[owner], column, owner, weight


def scatter_hessian(
    selector: sparse.csr_array, count: int, pattern: Sparsity
) -> tuple[Indices, Indices, Indices, NDArray[np.float64]]:
    """Where local upper-triangular Hessian nonzeros go in the global upper triangle, as ``scatter_jacobian``."""
    a, b = (np.array(v, dtype=np.int64) for v in pattern.get_triplet())
    n = pattern.size1()
    off_diagonal = a != b
    source = np.concatenate([np.arange(len(a)), np.flatnonzero(off_diagonal)])
    left = np.concatenate([a, b[off_diagonal]])
    right = np.concatenate([b, a[off_diagonal]])
    instance = np.repeat(np.arange(count), len(left))
    sources = instance * len(a) + np.tile(source, count)
    owner, row, row_weight = _expand(selector, instance * n + np.tile(left, count))
    inner, column, column_weight = _expand(selector, (instance * n + np.tile(right, count))[owner])
    row, weight, sources = row[inner], row_weight[inner] * column_weight, sources[owner][inner]
    keep = row <= column
    return row[keep], column[keep], sources[keep], weight[keep]


def combined(matrix: sparse.csr_array, values: MX) -> MX:
    """A constant matrix times a column; what only picks entries does no arithmetic."""
    picks = np.all(np.diff(matrix.indptr) == 1) and np.all(matrix.data == 1)
    # Of a single entry CasADi picks a row.
    return ca.vec(values[matrix.indices.tolist()]) if picks else ca.mtimes(MX(to_dm(matrix)), values)


def gather_nonzeros(
    shape: tuple[int, int], parts: list[tuple[Indices, Indices, Indices, NDArray[np.float64]]], sources: list[MX]
) -> MX:
    """A sparse matrix whose nonzeros are fixed combinations of the entries of ``sources``, one for each part."""
    if not parts or all(len(part[0]) == 0 for part in parts):
        return MX(*shape)
    rows, columns = (np.concatenate([part[i] for part in parts]) for i in range(2))
    # The pattern as a matrix whose entries are where its nonzeros stand: many times faster than sorting all.
    pattern = sparse.csc_array((np.ones(len(rows), np.int8), (rows, columns)), shape=shape)
    pattern.sort_indices()
    place = sparse.csc_array((np.arange(pattern.nnz), pattern.indices, pattern.indptr), shape=shape)
    position = np.asarray(place[rows, columns]).reshape(-1)
    first = np.cumsum([0, *[values.numel() for values in sources]])
    source = np.concatenate([part[2] + start for part, start in zip(parts, first[:-1], strict=True)])
    weight = np.concatenate([part[3] for part in parts])
    mix = sparse.csr_array((weight, (position, source)), shape=(pattern.nnz, first[-1]))
    sparsity = Sparsity(*shape, pattern.indptr.tolist(), pattern.indices.tolist())
    return MX(sparsity, combined(mix, ca.vertcat(*sources)))
