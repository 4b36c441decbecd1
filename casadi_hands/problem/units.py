"""One nondimensional unit in SI, and numbers rounded so that scaled tasks give the very same ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
STANDARD_GRAVITY = 9.81  # m/s², sets the force unit where a task has none
_DIGITS = 12  # significant digits kept, so that scaled tasks give the very same numbers


@dataclass(frozen=True)
class Units:
    """Size of one nondimensional unit in SI.

    Attributes:
        length: m.
        force: N.
        gravity: m/s², force over mass.
    """

    length: float
    force: float
    gravity: float

    @property
    def torque(self) -> float:
        """N·m."""
        return self.force * self.length

    @property
    def inertial(self) -> float:
        """Length over gravity, s²: what turns lengths/s² into m·g."""
        return float(round_off(self.length / self.gravity))


def round_off(value: Any) -> Any:
    """Numbers to 12 significant digits; those with fewer, too small to have more, become zero."""
    array = np.asarray(value, float)
    array = np.where(np.abs(array) < np.finfo(float).tiny, 0.0, array)
    magnitude = np.where(array == 0, 1.0, 10.0 ** np.floor(np.log10(np.abs(np.where(array == 0, 1.0, array)))))
    rounded = np.round(array / magnitude, _DIGITS) * magnitude
    return float(rounded) if array.ndim == 0 else rounded
