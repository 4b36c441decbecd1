"""Contact points on bodies in numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from casadi_hands.geometry.bodies import Body

Array = NDArray[np.float64]


def inward_normals(points: Array, bodies: Sequence[Body]) -> Array:
    """(C, 3) unit normals into the object at surface points (C, 3), each of its body, object frame."""
    return np.array([-body.outward(point) for point, body in zip(points, bodies, strict=True)])


def on_bodies(points: Array, bodies: Sequence[Body]) -> Array:
    """Points (C, 3) moved along their normals onto the surface of their bodies, all in one frame."""
    return np.array([body.on_surface(point) for point, body in zip(points, bodies, strict=True)])
