"""How the faces of a mesh hang together: edges, winding, pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Edges:
    """The edges of F faces.

    Attributes:
        ends: (E, 2) vertices of each, the lower number first.
        of_side: (3 F,) the edge of each face's sides, first all first sides.
        forward: (3 F,) whether the side runs from the lower number.
    """

    ends: Ints
    of_side: Ints
    forward: NDArray[np.bool_]

    @property
    def sides(self) -> Ints:
        """(E,) faces at each edge."""
        return np.bincount(self.of_side, minlength=len(self.ends))

    @property
    def balance(self) -> Ints:
        """(E,) sides that run forward less those that run back: zero everywhere on a closed surface."""
        signs = np.where(self.forward, 1, -1)
        return np.rint(np.bincount(self.of_side, signs, minlength=len(self.ends))).astype(np.int64)


def distinct_rows(rows: Ints) -> tuple[Ints, Ints]:
    """Rows (N, K) that differ: where each comes first, in the order of their coming, and for each row which it is (N,).

    As `numpy.unique` does, which takes several times longer for rows.
    """
    order = np.lexsort(rows.T[::-1])
    changes = np.concatenate([[True], (np.diff(rows[order], axis=0) != 0).any(axis=1)])
    kept = order[changes]  # sorting is stable: the first of its kind
    which = np.empty(len(rows), dtype=np.int64)
    which[order] = np.cumsum(changes) - 1
    return np.sort(kept), np.argsort(np.argsort(kept))[which]


def edges_of(faces: Ints) -> Edges:
    """Edges of faces (F, 3)."""
    sides = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    low, high = sides.min(axis=1), sides.max(axis=1)
    base = int(high.max()) + 1
    keys, of_side = np.unique(low * base + high, return_inverse=True)
    return Edges(np.column_stack([keys // base, keys % base]), of_side.ravel(), sides[:, 0] == low)


def with_one_winding(faces: Ints) -> tuple[Ints, int]:
    """Turn faces so that neighbours agree about which side is out; most of each patch stay as they are.

    Two copies of every face, as it is and turned, are linked to those copies of its neighbours that agree with them:
    each patch of the surface falls into two parts, and one is taken.

    Args:
        faces: (F, 3).

    Returns:
        The faces, and how many were turned; -1 where a patch has one side only, as a Möbius strip.
    """
    edges, count = edges_of(faces), len(faces)
    order = np.argsort(edges.of_side, kind="stable")
    first = np.cumsum(edges.sides) - edges.sides
    pairs = first[edges.sides == 2]
    one, other = order[pairs], order[pairs + 1]
    turned = edges.forward[one] == edges.forward[other]
    if not turned.any():
        return faces, 0
    a, b = one % count, other % count
    links = (np.concatenate([a, a + count]), np.concatenate([b + count * turned, b + count * ~turned]))
    _, label = connected_components(coo_array((np.ones(len(links[0])), links), shape=(2 * count, 2 * count)), False)
    label = label.astype(np.int64)
    if (label[:count] == label[count:]).any():
        return faces, -1
    patch = np.minimum(label[:count], label[count:])
    turn = label[:count] != patch
    most = np.bincount(patch, turn) * 2 > np.bincount(patch)
    turn ^= most[patch]
    return np.where(turn[:, None], faces[:, ::-1], faces), int(turn.sum())


def pieces(faces: Ints, vertices: int) -> Ints:
    """The number (F,) of the piece that each face belongs to, from 0; pieces share no vertex."""
    links = (np.concatenate([faces[:, 0], faces[:, 1]]), np.concatenate([faces[:, 1], faces[:, 2]]))
    _, label = connected_components(coo_array((np.ones(len(links[0])), links), shape=(vertices, vertices)), False)
    return np.unique(label[faces[:, 0]], return_inverse=True)[1].ravel().astype(np.int64)


def loops(ahead: Ints) -> list[list[int]]:
    """Chain directed edges (N, 2) into closed loops, as far as they close; a vertex may be passed twice."""
    follow: dict[int, list[int]] = {}
    for start, end in ahead.tolist():
        follow.setdefault(start, []).append(end)
    found = []
    for start in sorted(follow):
        while follow.get(start):
            loop = [start]
            while (ends := follow.get(loop[-1])) and (len(loop) == 1 or loop[-1] != start):
                loop.append(ends.pop())
            found.append(loop[:-1] if loop[-1] == start else loop)
    return found
