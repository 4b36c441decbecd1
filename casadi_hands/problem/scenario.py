"""Scenarios: the same motion on the same contacts, with other forces from outside."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scenario:
    """What acts on the object besides its weight and its contacts.

    Attributes:
        suffix: of what belongs to the scenario, in names of variables and cost terms; empty for the motion as planned.
        force: (S, 3) m·g, world, at the samples.
        torque: (S, 3) m·g·length, world.
    """

    suffix: str
    force: Array
    torque: Array

    @property
    def acts(self) -> NDArray[np.bool_]:
        """(S,) when anything does."""
        return np.asarray(np.any(np.hstack([self.force, self.torque]), axis=1))

    def at(self, samples: NDArray[np.int64]) -> Scenario:
        """The same at some of its samples."""
        return replace(self, force=self.force[samples], torque=self.torque[samples])

    def plus(self, other: Scenario, sign: float = 1.0) -> Scenario:
        """The same with what acts in another one added, or taken off."""
        return replace(self, force=self.force + sign * other.force, torque=self.torque + sign * other.torque)
