"""Where the contact of a finger may be, by the task's point and what stages may move it: points on the surface."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from casadi_hands.diagnosis.finding import WANDER
from casadi_hands.problem.model import Model

Array = NDArray[np.float64]
_RINGS = (0.35, 0.7, 1.0)  # of WANDER
_WAYS = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
_WAYS /= np.linalg.norm(_WAYS, axis=1)[:, None]


def nearby(model: Model, center: Array) -> tuple[Array, Array]:
    """Points (K, 3) of the object's surface within ``WANDER`` of a point (3,), and their outward normals (K, 3)."""
    points, normals = [], []
    for body in model.bodies:
        if body.signed_distance(center) > WANDER:
            continue
        for start in [center, *(center + WANDER * ring * way for ring in _RINGS for way in _WAYS)]:
            point = body.on_surface(start)
            if body.has_normal(start) and np.linalg.norm(point - center) <= WANDER + 1e-9:
                points.append(point)
                normals.append(body.outward(start))
    if not points:
        return np.zeros((0, 3)), np.zeros((0, 3))
    outside = [min(body.signed_distance(point) for body in model.bodies) > -1e-6 for point in points]
    return np.array(points)[outside], np.array(normals)[outside]
