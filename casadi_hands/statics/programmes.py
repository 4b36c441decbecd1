"""Linear programmes and least squares over forces in friction cones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog, lsq_linear, nnls

Array = NDArray[np.float64]
_TAKEN = 12  # columns at a time


def nonnegative_fit(matrix: Array, wanted: Array) -> tuple[Array, float]:
    """The x >= 0 with which ``matrix @ x`` is nearest to what is wanted, and how far it is from that."""
    try:
        x, missing = nnls(matrix, wanted)
    except RuntimeError:  # after too many changes of its active set; an interior point is as near, to its tolerance
        x = lsq_linear(matrix, wanted, (0.0, np.inf)).x
        missing = np.linalg.norm(matrix @ x - wanted)
    return np.asarray(x), float(missing)


def least_largest(rows: Array, wrenches: Array, wrench: Array) -> float:
    """The least over x >= 0 with ``wrenches @ x = wrench`` of the largest component of ``|rows @ x|``."""
    edges = least_largest_solution(rows, wrenches, wrench)
    return float(np.abs(rows @ edges).max()) if edges is not None else float("inf")


def least_largest_solution(
    rows: Array, wrenches: Array, wrench: Array, borne: Array | None = None, most: float = 0.0
) -> Array | None:
    """The x of ``least_largest``, where besides ``|borne @ x| <= most``; None if there is none."""
    count = rows.shape[1]
    below = [np.column_stack([sign * rows, -np.ones(len(rows))]) for sign in (1, -1)]
    limit = [np.zeros(2 * len(rows))]
    if borne is not None:
        below += [np.column_stack([sign * borne, np.zeros(len(borne))]) for sign in (1, -1)]
        limit.append(np.full(2 * len(borne), most))
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.vstack(below),
        b_ub=np.concatenate(limit),
        A_eq=np.column_stack([wrenches, np.zeros(len(wrench))]),
        b_eq=wrench,
        method="highs",
    )
    return np.asarray(found.x[:count]) if found.status == 0 else None


def least_missing(matrix: Array, wanted: Array, enough: float = 1e-9) -> float:
    """The distance of ``nonnegative_fit`` of a matrix of many columns, which are taken in as they help.

    Args:
        matrix: (n, many).
        wanted: (n,).
        enough: distance that is not made any less.
    """
    taken, missing = np.zeros(0, int), wanted
    while np.linalg.norm(missing) > enough:
        helps = missing @ matrix
        helps[taken] = 0.0
        more = np.argsort(-helps)[:_TAKEN]
        more = more[helps[more] > 1e-12]
        if not len(more):
            break
        taken = np.append(taken, more)
        missing = wanted - matrix[:, taken] @ nonnegative_fit(matrix[:, taken], wanted)[0]
    return float(np.linalg.norm(missing))


def opposes(forces: Array) -> bool:
    """Whether some of the forces (3, E), scaled by numbers >= 0 that are not all 0, sum up to none."""
    found = linprog(
        np.zeros(forces.shape[1]),
        A_eq=np.vstack([forces, np.ones(forces.shape[1])]),
        b_eq=np.array([0.0, 0.0, 0.0, 1.0]),
        method="highs",
    )
    return bool(found.status == 0)
