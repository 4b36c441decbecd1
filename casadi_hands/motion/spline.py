"""Interpolation as constant matrices: samples = weights @ keyframes (section 2.2.1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Weights = NDArray[np.float64]


def _segment(knots: Weights, times: Weights) -> tuple[NDArray[np.int64], Weights]:
    """Index of the knot interval of each time, and the fraction of it that has passed."""
    index = np.clip(np.searchsorted(knots, times + 1e-9, side="right") - 1, 0, len(knots) - 2)
    return index, (times - knots[index]) / (knots[index + 1] - knots[index])


def linear(knots: ArrayLike, times: ArrayLike) -> Weights:
    """Weights (T, N) of piecewise-linear interpolation; constant beyond the ends."""
    at = np.asarray(knots, float)
    when = np.clip(np.asarray(times, float), at[0], at[-1])
    index, fraction = _segment(at, when)
    weights = np.zeros((len(when), len(at)))
    rows = np.arange(len(when))
    weights[rows, index] = 1 - fraction
    weights[rows, index + 1] = fraction
    return weights


def zero_order_hold(knots: ArrayLike, times: ArrayLike) -> NDArray[np.int64]:
    """Index (T,) of the knot whose value holds at each time: the last one not later than it."""
    knots = np.asarray(knots, float)
    return np.clip(np.searchsorted(knots, np.asarray(times, float) + 1e-9, side="right") - 1, 0, len(knots) - 1)


def catmull_rom(knots: ArrayLike, times: ArrayLike, resting: ArrayLike = ()) -> Weights:
    """Weights (T, N) of a Catmull–Rom spline whose end points are mirrored, so that it starts and ends at rest.

    The tangent at an inner knot is the slope between its neighbours, or zero at the knots whose indices are given as
    ``resting``. Times before the first knot and after the
    last see the motion's mirror image, which keeps central differences at the ends consistent.
    """
    at = np.asarray(knots, float)
    when = at[0] + np.abs(np.asarray(times, float) - at[0])
    when = at[-1] - np.abs(at[-1] - when)
    index, s = _segment(at, when)
    count, rows = len(at), np.arange(len(when))
    tangents = np.zeros((count, count))
    for i in set(range(1, count - 1)) - set(np.asarray(resting, int).tolist()):
        slope = 1 / (at[i + 1] - at[i - 1])
        tangents[i, i + 1], tangents[i, i - 1] = slope, -slope
    span = (at[index + 1] - at[index])[:, None]
    s = s[:, None]
    weights: Weights = (s**3 - 2 * s**2 + s) * span * tangents[index] + (s**3 - s**2) * span * tangents[index + 1]
    weights[rows, index] += (2 * s**3 - 3 * s**2 + 1)[:, 0]
    weights[rows, index + 1] += (3 * s**2 - 2 * s**3)[:, 0]
    return weights


def time_scaled(knots: ArrayLike, times: ArrayLike) -> Weights:
    """Times (T,) moved within their intervals so that what is linear in them rests at every knot.

    Each interval is passed at 6s⁵ - 15s⁴ + 10s³: speed and acceleration vanish at its ends.
    """
    at = np.asarray(knots, float)
    index, s = _segment(at, np.clip(np.asarray(times, float), at[0], at[-1]))
    return np.asarray(at[index] + (at[index + 1] - at[index]) * s**3 * (6 * s**2 - 15 * s + 10))
