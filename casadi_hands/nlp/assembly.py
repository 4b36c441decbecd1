"""Partially separable assembly: each kernel's exact derivatives, mapped over its instances and scattered.

With x_k = S_k x the local variables of instance k, the gradient is the sum of S_kᵀ g_k and the Hessian the sum
of S_kᵀ H_k S_k. S_k is constant, so each global nonzero is a fixed linear combination of local nonzeros: one
sparse matrix-vector product.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
import scipy.sparse as sparse
from casadi import DM, MX, SX, Function, Sparsity
from numpy.typing import NDArray

from casadi_hands.nlp.kernel import Kernel
from casadi_hands.nlp.machine_code import compiled

Indices = NDArray[np.int64]
_known: dict[str, KernelFunctions] = {}  # of this process, by what the kernel computes


def to_dm(matrix: sparse.sparray) -> DM:
    """A SciPy sparse matrix as a CasADi one with the same pattern."""
    columns = sparse.csc_array(matrix)
    columns.sort_indices()
    height, width = matrix.shape
    pattern = Sparsity(height, width, columns.indptr.tolist(), columns.indices.tolist())
    return DM(pattern, columns.data)


@dataclass(frozen=True)
class KernelFunctions:
    """A kernel's value, gradient, Jacobian and Hessian in its local variables, as machine code where possible.

    Sparse results are columns of their nonzeros, with the patterns given here.

    Attributes:
        value: (x, p, weights) -> (terms, g).
        gradient: (x, p, weights) -> (weighted sum of the terms, its gradient).
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


def kernel_functions(kernel: Kernel, terms: list[str]) -> KernelFunctions:
    """Differentiate a kernel; ``terms`` fixes the order of the weights. Kernels that compute the same share theirs."""
    x, p = kernel.variables, kernel.parameters
    weights = SX.sym("weights", len(terms))
    values = ca.vertcat(*[kernel.terms[name] for name in terms]) if terms else SX.zeros(0, 1)
    g = ca.vertcat(*kernel.constraints.values()) if kernel.constraints else SX.zeros(0, 1)
    # What stands twice in them stands many times in their derivatives.
    values, g = ca.cse([values, g])
    value = Function("value", [x, p, weights], [ca.densify(values), ca.densify(g)])
    same = value.serialize()
    if same not in _known:
        _known[same] = _differentiated(kernel.name, value, (x, p, weights), values, g)
    return _known[same]


def _differentiated(name: str, value: Function, inputs: tuple[SX, SX, SX], values: SX, g: SX) -> KernelFunctions:
    x, _, weights = inputs
    scale, multipliers = SX.sym("scale"), SX.sym("multipliers", g.numel())
    total = ca.dot(weights, values) if values.numel() else SX(0)
    jacobian = ca.jacobian(g, x)
    hessian, _ = ca.hessian(scale * total + ca.dot(multipliers, g), x)
    upper = ca.triu(hessian)
    functions = {
        "value": value,
        "gradient": Function("gradient", [*inputs], [total, ca.densify(ca.gradient(total, x))]),
        "jacobian": Function("jacobian", [*inputs], [ca.densify(g), _nonzeros(jacobian)]),
        "hessian": Function("hessian", [*inputs, scale, multipliers], [_nonzeros(upper)]),
    }
    return KernelFunctions(
        **compiled(name, functions), jacobian_pattern=jacobian.sparsity(), hessian_pattern=upper.sparsity()
    )


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


def gather_nonzeros(
    shape: tuple[int, int], parts: list[tuple[Indices, Indices, Indices, NDArray[np.float64]]], sources: list[MX]
) -> MX:
    """A sparse matrix whose nonzeros are fixed combinations of the entries of ``sources``, one for each part."""
    if not parts or all(len(part[0]) == 0 for part in parts):
        return MX(*shape)
    keys = np.concatenate([column * shape[0] + row for row, column, _, _ in parts])
    unique, position = np.unique(keys, return_inverse=True)
    rows, columns = (unique % shape[0]).tolist(), unique // shape[0]
    starts = np.searchsorted(columns, np.arange(shape[1] + 1)).tolist()
    nonzeros, first = MX.zeros(len(unique), 1), 0
    for (row, _, source, weight), values in zip(parts, sources, strict=True):
        target = position[first : first + len(row)]
        first += len(row)
        if len(row):
            mix = sparse.csc_array((weight, (target, source)), shape=(len(unique), values.numel()))
            mix.sum_duplicates()
            nonzeros = nonzeros + ca.mtimes(MX(to_dm(mix)), values)
    return MX(Sparsity(*shape, starts, rows), ca.densify(nonzeros))
