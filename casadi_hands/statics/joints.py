"""What joints can supply of a force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def structural_projector(jacobian: Array, damping: float) -> Array:
    """(3, 3) onto the forces that no joint actuates, damped as eq. 2.23 is here."""
    normal_matrix = jacobian.T @ jacobian + damping**2 * np.eye(jacobian.shape[1])
    return np.eye(3) - jacobian @ np.linalg.solve(normal_matrix, jacobian.T)
