"""Unit quaternions of rotation matrices."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def quaternion(rotation: ArrayLike) -> Array:
    """Unit quaternion [w, x, y, z] of a rotation matrix (3, 3)."""
    x, y, z, w = pin.Quaternion(np.asarray(rotation, float)).coeffs()
    return np.array([w, x, y, z]) * (1.0 if w >= 0 else -1.0)
