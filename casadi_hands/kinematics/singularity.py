"""The singularity margin of a finger: how far it is from poses where its Jacobian loses rank, and on which side.

Where a finger is stretched out or folded, its Jacobian is singular: some forces are out of its reach, and only few ways
lead through such a pose. A motion on few knots steps over it unnoticed, and on denser ones no exact motion is near.
Fingers of two or three joints can be kept from it: while one stays on its side of all singular poses, what
``singularity_margin`` gives does not vanish.
"""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

Array = NDArray[np.float64]
# Components of the margin, by number of joints; other fingers have none, or may change sides.
MARGIN_SIZES = {2: 3, 3: 1}
LEAST_MARGIN = 0.25  # of the margin's median over a touch
MOSTLY = 0.8  # of a touch that a finger has to be on one side, to be kept there all the while
# The margin over that of columns as long that are at right angles to each other:
NEAR = 0.02  # below it a pose is nearly singular
_SINGULAR = 1e-3  # a finger that is usually below it is on no side


def singularity_margin(jacobian: SX) -> SX:
    """What vanishes where a Jacobian (3, n) is singular: its determinant (1,), or the product of its columns (3,)."""
    return ca.det(jacobian) if jacobian.shape[1] == 3 else ca.cross(jacobian[:, 0], jacobian[:, 1])


def passes_singularity(jacobians: Array, active: NDArray[np.bool_]) -> bool:
    """Whether a finger passes a singular pose while its contact touches, or comes very near to one.

    Args:
        jacobians: (N, 3, n) of its contact at the keyframes.
        active: (N,) when it touches.
    """
    if jacobians.shape[2] not in MARGIN_SIZES:
        return False
    measured, most = _margins(jacobians), _most(jacobians)
    for at in _touches(active, active):
        near = np.linalg.norm(measured[at], axis=1) < NEAR * most[at]
        if near.any() or _turns(measured[at]).any():
            return True
    return False


def margin_directions(jacobians: Array, active: NDArray[np.bool_], touching: NDArray[np.bool_]) -> Array:
    """What the singularity margin at each knot is to be multiplied with; ``LEAST_MARGIN`` is asked of the result.

    Args:
        jacobians: (S, 3, n) of the contact of a finger of two or three joints, of a motion that tells the sides.
        active: (S,) when its contact touches, held from its knot to the next.
        touching: (S,) the same with the knot at which each touch ends.

    Returns:
        (S, size), one over the median where the motion is on its side, zeros where none is to be kept.
    """
    measured, most = _margins(jacobians), _most(jacobians)
    result = np.zeros_like(measured)
    for at in _touches(active, touching):
        if np.median(np.linalg.norm(measured[at], axis=1)) > _SINGULAR * np.median(most[at]):
            result[at] = _kept(measured[at])
    return result


def _kept(measured: Array) -> Array:
    """The direction (K, size) of one touch, of its margins."""
    sides = np.where(np.append(0, np.cumsum(_turns(measured))) % 2, -1.0, 1.0)
    mean = sides.mean()
    sizes = np.linalg.norm(measured, axis=1)
    median = np.median(sizes)
    if (1 + abs(mean)) / 2 < MOSTLY:
        return np.zeros_like(measured)
    units = measured / np.maximum(sizes, 1e-3 * median)[:, None]
    return np.asarray(np.sign(mean) * sides[:, None] * units / median)


def _touches(active: NDArray[np.bool_], touching: NDArray[np.bool_]) -> Iterator[NDArray[np.int64]]:
    """Indices of each touch, which begins where a contact becomes active."""
    touch = np.where(touching, np.cumsum(active & ~np.append(False, active[:-1])), 0)
    return (np.flatnonzero(touch == k) for k in range(1, touch.max(initial=0) + 1))


def _turns(measured: Array) -> NDArray[np.bool_]:
    """Between which of some margins (K, size) a singular pose is passed."""
    return np.asarray(np.einsum("ks,ks->k", measured[1:], measured[:-1]) < 0)


def _most(jacobians: Array) -> Array:
    """(S,) size of the margin if the Jacobian's columns were at right angles to each other."""
    return np.asarray(np.prod(np.linalg.norm(jacobians, axis=1), axis=1))


def _margins(jacobians: Array) -> Array:
    """``singularity_margin`` (S, size) of Jacobians (S, 3, n)."""
    if jacobians.shape[2] == 3:
        return np.asarray(np.linalg.det(jacobians))[:, None]
    return np.asarray(np.cross(jacobians[:, :, 0], jacobians[:, :, 1]))
