"""What an object must exert on the world on its way to a goal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from casadi_hands.problem.scenario import Scenario

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Exerted:
    """A wrench that the object exerts on the world for some time.

    Attributes:
        start, end: s, of the time in which it exerts all of it.
        ramp: s, in which it grows before and falls after.
        force: (3,) m·g, world.
        torque: (3,) m·g·length, world.
    """

    start: float
    end: float
    ramp: float
    force: Array
    torque: Array

    def shares(self, times: Array) -> Array:
        """(T,) how much of it there is at times (T,)."""
        off = np.maximum(np.maximum(self.start - times, times - self.end), 0.0)
        return np.asarray(np.maximum(1.0 - off / self.ramp, 0.0))


def planned(times: Array, exerted: Sequence[Exerted]) -> Scenario:
    """The motion as planned: all that acts from outside is the world's answer to what the object exerts."""
    forces, torques = np.zeros((2, len(times), 3))
    for each in exerted:
        forces -= np.outer(each.shares(times), each.force)
        torques -= np.outer(each.shares(times), each.torque)
    return Scenario("", forces, torques)
