"""The case of a servo as a solid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import coal
import numpy as np

from casadi_hands.verify.shapes import Shape


@dataclass(frozen=True, eq=False)
class Box(Shape):
    """A box in its body's frame.

    Attributes:
        sides: (3,) m.
        center: (3,) m.
        turn: (3, 3) the sides' directions by columns.
    """

    sides: np.ndarray
    center: np.ndarray
    turn: np.ndarray
    radius = np.inf

    @property
    def pose(self) -> tuple[np.ndarray, np.ndarray]:
        """Its axes and its middle."""
        return self.turn, self.center

    def coal(self) -> coal.CollisionGeometry:
        """Return coal's box."""
        return coal.Box(*map(float, self.sides))

    def drake(self, geometry: Any, edge: float = 0.0) -> Any:
        """Return Drake's box."""
        return geometry.Box(*map(float, self.sides))
