"""Where each named array stands in a long vector, and affine expressions of its entries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import ArrayLike, NDArray

Vector = NDArray[np.float64]


class Layout:
    """Packs named arrays into one vector and unpacks it; the only place that knows positions."""

    def __init__(self) -> None:
        """Start empty."""
        self._indices: dict[str, NDArray[np.int64]] = {}
        self.size = 0

    def add(self, name: str, shape: tuple[int, ...]) -> NDArray[np.int64]:
        """Reserve room for an array and return the positions of its entries, in its shape."""
        if name in self._indices:
            raise KeyError(f"'{name}' is already in the layout")
        count = int(np.prod(shape))
        self._indices[name] = np.arange(self.size, self.size + count).reshape(shape)
        self.size += count
        return self._indices[name]

    def __getitem__(self, name: str) -> NDArray[np.int64]:
        """Positions of an array's entries, in its shape."""
        return self._indices[name]

    def __contains__(self, name: str) -> bool:
        """Whether an array has that name."""
        return name in self._indices

    def names(self) -> list[str]:
        """Names in the order of the vector."""
        return list(self._indices)

    def pack(self, values: Mapping[str, ArrayLike], into: Vector) -> Vector:
        """A copy of ``into`` with the named arrays written over it; each value may be broadcast to its shape.

        Raises:
            KeyError: a name that is not in the layout.
        """
        packed = into.copy()
        for name, value in values.items():
            if name not in self._indices:
                raise KeyError(f"'{name}' is not one of {', '.join(self._indices)}")
            packed[self._indices[name]] = np.asarray(value, float)
        return packed

    def unpack(self, vector: Vector) -> dict[str, Vector]:
        """The named arrays of a vector, as copies."""
        return {name: vector[index] for name, index in self._indices.items()}


@dataclass(frozen=True)
class Label:
    """What rows or parameters are, so that no kernel is given one for another.

    Attributes:
        quantity: what is measured, as kernels' symbols name it.
        owner: which of several alike it belongs to, a finger's contact say; None of what all share.
        when: a mark that grows with time, where the same quantity is read at several times; None where it has none.
    """

    quantity: str = ""
    owner: int | None = None
    when: float | None = None


class Parameter:
    """Parameters as kernels read them: positions (K, d) in the long vector, row k for instance k; one row for all."""

    def __init__(self, positions: NDArray[np.int64], label: Label) -> None:
        """Take positions as they are."""
        self.positions, self.label = positions, label

    @property
    def shape(self) -> tuple[int, ...]:
        """(K, d)."""
        return self.positions.shape

    def take(self, indices: ArrayLike) -> Parameter:
        """The rows of the given instances, in that order; where all instances share one row, that row."""
        if len(self.positions) == 1:
            return self
        return Parameter(self.positions[np.asarray(indices, int)], replace(self.label, when=_mean(indices)))

    def entries(self, start: int, stop: int, owner: int | None = None) -> Parameter:
        """Entries ``start`` to ``stop`` of every row, whose they are where they are somebody's."""
        return Parameter(self.positions[:, start:stop], _owned(self.label, owner))


def _owned(label: Label, owner: int | None) -> Label:
    """A label with another owner, if one is given."""
    return label if owner is None else replace(label, owner=owner)


def _mean(indices: ArrayLike) -> float | None:
    """The mean of some indices; None of none."""
    picked = np.asarray(indices, float)
    return float(picked.mean()) if picked.size else None


class Rows:
    """K rows of d affine expressions of the variables: what a kernel's instances read.

    ``matrix`` has K·d rows and one column a variable (columns may be added later); row ``k*d + i`` is entry i of
    instance k. ``offset`` (K·d,) is added to what it gives, and ``label`` tells what they are.
    """

    def __init__(
        self, matrix: Any, count: int, width: int, offset: Vector | None = None, label: Label | None = None
    ) -> None:
        """Take a matrix (count·width, variables) as it is; nothing is added to it by default."""
        self.matrix = sparse.csr_array(matrix)
        self.count, self.width, self.label = count, width, label or Label()
        self.offset: Vector = np.zeros(count * width) if offset is None else offset

    @classmethod
    def of(cls, indices: NDArray[np.int64], size: int, label: Label | None = None) -> Rows:
        """Rows that read the variables at ``indices`` (K, d) of a vector of ``size``."""
        flat = indices.reshape(-1)
        matrix = sparse.csr_array((np.ones(flat.size), (np.arange(flat.size), flat)), shape=(flat.size, size))
        count, width = indices.shape
        return cls(matrix, count, width, label=label)

    def combine(self, weights: ArrayLike, when: float | None = None) -> Rows:
        """Rows (T, d) that are the linear combinations ``weights`` (T, K) of these; ``when`` marks their time."""
        weights = np.asarray(weights, float)
        mixed = sparse.kron(sparse.csr_array(weights), sparse.eye_array(self.width)) @ self.matrix
        offset = (weights @ self.offset.reshape(self.count, self.width)).reshape(-1)
        return Rows(mixed, weights.shape[0], self.width, offset, replace(self.label, when=when))

    def plus(self, offset: Vector) -> Rows:
        """The same with constants (K, d) added."""
        return Rows(self.matrix, self.count, self.width, self.offset + offset.reshape(-1), self.label)

    def take(self, indices: ArrayLike) -> Rows:
        """The rows of the given instances, in that order, repeats allowed."""
        picked = np.asarray(indices, int)
        rows = (picked[:, None] * self.width + np.arange(self.width)).reshape(-1)
        label = replace(self.label, when=_mean(picked) if self.count > 1 else self.label.when)
        return Rows(self.matrix[rows], len(picked), self.width, self.offset[rows], label)

    def entries(self, start: int, stop: int, owner: int | None = None) -> Rows:
        """Entries ``start`` to ``stop`` of every row, whose they are where they are somebody's."""
        rows = (np.arange(self.count)[:, None] * self.width + np.arange(start, stop)).reshape(-1)
        return Rows(self.matrix[rows], self.count, stop - start, self.offset[rows], _owned(self.label, owner))

    @classmethod
    def beside(cls, parts: Sequence[Rows]) -> Rows:
        """Rows whose entries are those of all parts, one after the other; all have the same count.

        They are labelled as the first part is.
        """
        matrices = [part.matrix for part in parts]
        before = np.cumsum([0, *[matrix.nnz for matrix in matrices]])
        lengths = np.hstack([np.diff(p.matrix.indptr).reshape(p.count, p.width) for p in parts]).reshape(-1)
        starts = np.hstack(
            [p.matrix.indptr[:-1].reshape(p.count, p.width) + n for p, n in zip(parts, before, strict=False)]
        )
        ends = np.cumsum(lengths)
        source = np.arange(before[-1]) + np.repeat(starts.reshape(-1) - ends + lengths, lengths)
        indices, data = (np.concatenate([getattr(m, name) for m in matrices])[source] for name in ("indices", "data"))
        shape = len(lengths), max(matrix.shape[1] for matrix in matrices)
        joined = sparse.csr_array((data, indices, np.append(0, ends)), shape=shape)
        offset = np.hstack([p.offset.reshape(p.count, p.width) for p in parts]).reshape(-1)
        return cls(joined, parts[0].count, sum(part.width for part in parts), offset, parts[0].label)

    def constant(self, count: int) -> Rows:
        """One row repeated for ``count`` instances."""
        return self.take(np.zeros(count, int))
