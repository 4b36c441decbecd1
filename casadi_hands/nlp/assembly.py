"""Partially separable assembly: each kernel's exact derivatives, mapped over its instances and scattered.

With x_k = S_k x + s_k the local variables of instance k, the gradient is the sum of S_kᵀ g_k and the Hessian the sum
of S_kᵀ H_k S_k. S_k is constant and many of its rows stand in several: z has each once, with x_k a selection of z and
z = Z x + c. What all instances add to z is summed first; each nonzero by x is then a fixed linear combination of those
by z: one sparse matrix-vector product.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np
import scipy.sparse as sparse
from casadi import DM, MX, Sparsity
from numpy.typing import NDArray

Indices = NDArray[np.int64]


def to_dm(matrix: sparse.sparray) -> DM:
    """A SciPy sparse matrix as a CasADi one with the same pattern."""
    columns = sparse.csc_array(matrix)
    columns.sort_indices()
    height, width = matrix.shape
    pattern = Sparsity(height, width, columns.indptr.tolist(), columns.indices.tolist())
    return DM(pattern, columns.data.tolist())  # CasADi takes lists three times as fast as arrays


class Reads:
    """What kernels read: z = (x, the other affine expressions of x that any of them reads, each once).

    Kernels that read the same expressions share its entries, so that their derivatives are summed before they are
    spread over the variables.

    Attributes:
        positions: for each selector, where in z its rows stand.
        size: entries of z.
    """

    def __init__(self, read: Sequence[tuple[sparse.csr_array, NDArray[np.float64]]], variables: int) -> None:
        """Find the distinct rows of selectors (rows, variables), each with what is added to it (rows,)."""
        selectors = [selector for selector, _ in read]
        rows = sparse.csr_array(sparse.vstack([sparse.csr_array((0, variables)), *selectors], format="csr"))
        offsets = np.concatenate([np.zeros(0), *[offset for _, offset in read]])
        rows.sum_duplicates()
        rows.eliminate_zeros()
        first, last = rows.indptr[:-1], rows.indptr[1:]
        plain = (last - first == 1) & (offsets == 0)
        plain[plain] = rows.data[first[plain]] == 1
        position = np.zeros(len(first), np.int64)
        position[plain] = rows.indices[first[plain]]
        seen: dict[tuple[bytes, bytes, float], int] = {}
        others: list[int] = []
        for row in np.flatnonzero(~plain).tolist():
            entries = slice(first[row], last[row])
            content = rows.indices[entries].tobytes(), rows.data[entries].tobytes(), float(offsets[row])
            if content not in seen:
                seen[content] = variables + len(others)
                others.append(row)
            position[row] = seen[content]
        self.positions: list[Indices] = np.split(position, np.cumsum([each.shape[0] for each in selectors])[:-1])
        self.size = variables + len(others)
        self._variables = variables
        self._others, self._offsets = rows[others], offsets[others]
        # All rows of z by the variables, where they are not just these.
        self._rows = sparse.csr_array(sparse.vstack([sparse.eye_array(variables), self._others])) if others else None

    def of(self, x: MX) -> MX:
        """All that is read (size,), of the variables (nx,)."""
        if self._rows is None:
            return x
        others = ca.mtimes(MX(to_dm(self._others)), x)
        return ca.vertcat(x, others + DM(self._offsets) if self._offsets.any() else others)

    def gradient(self, slopes: MX) -> MX:
        """By the variables, from the gradients by what each kernel reads, one after the other."""
        position = np.concatenate([np.zeros(0, np.int64), *self.positions])
        first = sparse.csc_array(
            (np.ones(len(position)), (position, np.arange(len(position)))), (self.size, slopes.numel())
        )
        return _through([first] if self._rows is None else _fewest(first, sparse.csc_array(self._rows.T)), slopes)

    def jacobian(self, slopes: Gathering) -> Gathering:
        """By the variables, from the Jacobian by z (m, size)."""
        if self._rows is None:
            return slopes
        row, read = slopes.places()
        source, column, weight = _expand(self._rows, read)
        return slopes.then((slopes.shape[0], self._variables), Places(row[source], column, source, weight))

    def hessian(self, upper: Gathering) -> Gathering:
        """The upper triangle by the variables, from the upper triangle by z (size, size)."""
        if self._rows is None:
            return upper
        left, right = upper.places()
        source, row, row_weight = _expand(self._rows, left)
        owner, column, weight = _expand(self._rows, right[source])
        row, weight, source = row[owner], row_weight[owner] * weight, source[owner]
        # Off the diagonal an entry stands for two, which meet on the diagonal; on it, pairs come in both orders.
        apart = (left != right)[source]
        weight[apart & (row == column)] *= 2.0
        kept = apart | (row <= column)
        row, column = np.minimum(row, column)[kept], np.maximum(row, column)[kept]
        return upper.then((self._variables, self._variables), Places(row, column, source[kept], weight[kept]))


def _places(pattern: Sparsity) -> tuple[Indices, Indices]:
    """Row and column of each nonzero."""
    row, column = np.array(pattern.get_triplet(), np.int64).reshape(2, -1)
    return row, column


def _expand(rows: sparse.csr_array, wanted: Indices) -> tuple[Indices, Indices, NDArray[np.float64]]:
    """All nonzeros of the wanted rows: position in ``wanted``, column, value."""
    first = rows.indptr[wanted].astype(np.int64)
    counts = rows.indptr[wanted + 1] - first
    owner = np.repeat(np.arange(len(wanted)), counts)
    position = np.arange(len(owner)) + np.repeat(first - np.cumsum(counts) + counts, counts)
    return owner, rows.indices[position].astype(np.int64), rows.data[position]


class Places(NamedTuple):
    """Where values go in a matrix: row and column of each, its place among the sources, and its weight."""

    row: Indices
    column: Indices
    source: Indices
    weight: NDArray[np.float64]


def scatter_jacobian(position: Indices, count: int, pattern: Sparsity, first_row: int) -> Places:
    """Where local Jacobian nonzeros go, instance after instance; columns are entries of z.

    Args:
        position: (count·n,) of the local variables in z.
        count: number of instances.
        pattern: sparsity (m, n) of one local Jacobian.
        first_row: row of the first constraint of the first instance.
    """
    local_row, local_column = _places(pattern)
    row = first_row + np.arange(count)[:, None] * pattern.size1() + local_row
    column = position.reshape(count, -1)[:, local_column]
    return Places(row.reshape(-1), column.reshape(-1), np.arange(row.size), np.ones(row.size))


def scatter_hessian(position: Indices, count: int, pattern: Sparsity) -> Places:
    """Where local upper-triangular Hessian nonzeros go in the upper triangle by z, as ``scatter_jacobian``."""
    a, b = _places(pattern)
    local = position.reshape(count, -1)
    left, right = local[:, a].reshape(-1), local[:, b].reshape(-1)
    # Off a local diagonal an entry stands for two, which meet where both variables are the same.
    weight = np.where((left == right) & np.tile(a != b, count), 2.0, 1.0)
    return Places(np.minimum(left, right), np.maximum(left, right), np.arange(left.size), weight)


def together(places: Sequence[Places]) -> Places:
    """Places of values that stand one after the other."""
    first = np.cumsum([0, *[len(each.source) for each in places]])
    sources = [each.source + start for each, start in zip(places, first, strict=False)]
    row, column, _, weight = (np.concatenate(part) for part in zip(*places, strict=True))
    return Places(row, column, np.concatenate(sources), weight)


class Gathering:
    """A sparse matrix whose nonzeros are weighted sums of given values.

    Attributes:
        shape: of the matrix.
    """

    def __init__(self, shape: tuple[int, int], places: Places, values: int) -> None:
        """Find the pattern and the sums, of so many values."""
        self.shape = shape
        row, column, source, weight = places
        # The pattern as a matrix whose entries are where its nonzeros stand: many times faster than sorting all.
        self._pattern = sparse.csc_array((np.ones(len(row), np.int8), (row, column)), shape=shape)
        self._pattern.sort_indices()
        count = self._pattern.nnz
        place = sparse.csc_array((np.arange(count), self._pattern.indices, self._pattern.indptr), shape=shape)
        position = np.asarray(place[row, column]).reshape(-1)
        self._steps = [sparse.csc_array((weight, (position, source)), shape=(count, values))]

    def places(self) -> tuple[Indices, Indices]:
        """Row and column of each nonzero."""
        column = np.repeat(np.arange(self.shape[1]), np.diff(self._pattern.indptr))
        return self._pattern.indices.astype(np.int64), column

    def then(self, shape: tuple[int, int], places: Places) -> Gathering:
        """A matrix whose nonzeros are weighted sums of this one's."""
        gathering = Gathering(shape, places, self._pattern.nnz)
        gathering._steps = _fewest(*self._steps, *gathering._steps)
        return gathering

    def of(self, values: MX) -> MX:
        """The matrix, of the values in one column."""
        sparsity = Sparsity(*self.shape, self._pattern.indptr.tolist(), self._pattern.indices.tolist())
        return MX(sparsity, _through(self._steps, values))


def _fewest(first: sparse.csc_array, second: sparse.csc_array) -> list[sparse.csc_array]:
    """The steps of fewest products: one matrix and then another, or both in one."""
    both = sparse.csc_array(second @ first)
    return [both] if both.nnz <= first.nnz + second.nnz else [first, second]


def _through(steps: Sequence[sparse.csc_array], values: MX) -> MX:
    """A dense column, multiplied by each matrix in turn; where one only picks, its entries are picked."""
    for step in steps:
        rows = sparse.csr_array(step)
        if np.all(np.diff(rows.indptr) == 1) and np.all(rows.data == 1):
            values = ca.vec(values.nz[rows.indices.tolist()])
        else:
            values = ca.mac(MX(to_dm(step)), values, MX.zeros(step.shape[0], 1))
    return values
