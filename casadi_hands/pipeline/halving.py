"""Which intervals between samples must be shorter for an exact motion to keep its limits between them, too."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from casadi_hands.export.design import Design
from casadi_hands.verify.report import Audit

Array = NDArray[np.float64]
# What an exact motion misses only by how it goes between its samples; then it gets more of them.
BETWEEN = {"residual", "residual_between", "gap_between", "slip", "penetration", "joint_limit"}
FINEST = 0.02  # s between samples
ENOUGH = 0.7  # of a limit: intervals that contribute more are halved
LEFT = 1 / 8  # of what an interval slips, once it is halved; a cubic spline's error falls to a sixteenth


def intervals_to_halve(
    found: Audit, lengths: Array, of_samples: Callable[[Array], Array] = np.asarray
) -> NDArray[np.bool_]:
    """The intervals between samples that must be shorter for a motion to keep its limits between samples, too.

    Args:
        found: by the audit.
        lengths: (K,) of the intervals, s.
        of_samples: what was found in each interval of the files, in each of these.
    """
    able = lengths >= 2 * FINEST - 1e-9
    marked = np.zeros(len(lengths), bool)
    for name in BETWEEN:
        figure = found.figures[name]
        if figure.holds or figure.by_interval is None or figure.limit is None:
            continue
        most = ENOUGH * figure.limit
        by_interval = of_samples(figure.by_interval)
        if name != "slip":
            marked |= by_interval > most
            continue
        for run in by_interval:
            gains = (1 - LEFT) * np.where(able, run, 0.0)
            largest = np.argsort(-gains, kind="stable")
            # None where the run slips little, all that slip where halving all of them is not enough.
            needed = np.searchsorted(np.cumsum(gains[largest]), run.sum() - most)
            chosen = largest[: needed + 1 if run.sum() > most else 0]
            marked[chosen[gains[chosen] > 0]] = True
    # What a joint does in an interval depends on the samples around it, too.
    marked |= np.append(marked[1:], False) | np.append(False, marked[:-1])
    return marked & able


def excess(design: Design) -> float:
    """How far the worst figure between samples is beyond its limit, over the limit; 0 where all are kept."""
    missed = [design.certificate[name] for name in design.missed & BETWEEN]
    return max((np.inf if f["value"] is None else f["value"] / max(f["limit"], 1e-12) - 1 for f in missed), default=0.0)
