"""The object's motion with disembodied contacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from casadi_hands.nlp import Solution
from casadi_hands.problem.model import Model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Floating:
    """A motion of the object with its contacts and forces; nondimensional, see ``Model``.

    Attributes:
        pose: (N, 6) at the keyframes: position and rotation vector from the reference, world.
        point: (N, C, 3) object frame; the ground's contact, if any, last.
        force: (S, C, 3) object frame, at the samples.
        active: (N, C) bool.
        invariant: (N, C) the contact invariants before thresholds.
        threshold: that gave ``active``; 0 where all contacts had to stay.
        solution: the solve this motion is from.
        runs: every solve: (what, solution).
        model: it was solved with; it plans a regrasp where one is needed.
    """

    pose: Array
    point: Array
    force: Array
    active: NDArray[np.bool_]
    invariant: Array
    threshold: float
    solution: Solution
    runs: tuple[tuple[str, Solution], ...]
    model: Model
