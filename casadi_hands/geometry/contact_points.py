"""Points on capsules in numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from casadi_hands.geometry import nearest_on_axis

Array = NDArray[np.float64]


def inward_normals(points: Array, capsules: Array) -> Array:
    """(C, 3) unit normals into the object at surface points (C, 3) of capsules (C, 7), object frame."""
    normals = []
    for point, capsule in zip(points, capsules, strict=True):
        _, outward = nearest_on_axis(point, capsule)
        normals.append(-outward / max(float(np.linalg.norm(outward)), 1e-9))
    return np.array(normals)


def on_capsules(points: Array, capsules: Array) -> Array:
    """Points (C, 3) moved along their normals onto capsules (C, 7), all in one frame."""
    pairs = zip(points, capsules, inward_normals(points, capsules), strict=True)
    return np.array([nearest_on_axis(point, capsule)[0] - capsule[6] * inward for point, capsule, inward in pairs])
