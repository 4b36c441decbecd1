"""Derivatives of a curve from its values at times that need not be evenly apart."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from casadi import SX


def derivative(values: Sequence[SX], steps: Sequence[SX]) -> SX:
    """The n-th derivative of the polynomial through n + 1 values: n! times their divided difference.

    Args:
        values: n + 1 of one shape.
        steps: n times, s, from each value to the next.
    """
    values = list(values)
    for order in range(1, len(steps) + 1):
        spans = [sum(steps[i : i + order]) for i in range(len(values) - 1)]
        rises = [after - before for before, after in pairwise(values)]
        values = [order * rise / span for rise, span in zip(rises, spans, strict=True)]
    return values[0]
