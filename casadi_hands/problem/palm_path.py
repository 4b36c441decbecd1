"""The palm's motion as a task gives it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.motion import linear, time_scaled
from casadi_hands.motion.quaternion import quaternion
from casadi_hands.problem.units import round_off

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PalmPath:
    """The palm's motion as the task gives it: straight from waypoint to waypoint, at rest at each.

    Attributes:
        times: (W,) s.
        positions: (W, 3) world.
        rotations: (W, 3, 3) world from palm.
    """

    times: Array
    positions: Array
    rotations: Array

    def at(self, times: Array) -> Array:
        """Positions and quaternions [w, x, y, z] (T, 7) at times (T,) in s."""
        if len(self.times) == 1:
            return np.tile(np.append(self.positions[0], quaternion(self.rotations[0])), (len(times), 1))
        weights = linear(self.times, time_scaled(self.times, times))
        turns = [pin.Quaternion(rotation) for rotation in self.rotations]
        quaternions = []
        for row in weights:
            later = int(np.flatnonzero(row)[-1])
            turned = turns[max(later - 1, 0)].slerp(float(row[later]), turns[later])
            quaternions.append(quaternion(turned.matrix()))
        return np.hstack([round_off(weights @ self.positions), quaternions])
