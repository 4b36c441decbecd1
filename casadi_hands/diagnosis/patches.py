"""Where the contact of a finger may be, by the task's point and what stages may move it: points on the surface."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from casadi_hands.diagnosis.finding import WANDER
from casadi_hands.problem.model import Model

Array = NDArray[np.float64]
_RINGS = (0.5, 1.0)  # of WANDER
_SAME = 0.15, 0.4  # lengths, and parts of a unit normal
_WAYS = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
_WAYS /= np.linalg.norm(_WAYS, axis=1)[:, None]


def nearby(model: Model, center: Array) -> tuple[Array, Array]:
    """Points (K, 3) within ``WANDER`` of a point (3,) on the surfaces of its bodies, and their outward normals (K, 3).

    Those of a body that are inside another are among them: what asks for all that might be is wider by them.
    """
    found = []
    for body in model.bodies:
        if body.signed_distance(center) > WANDER:
            continue
        for start in (center, *(center + WANDER * ring * way for ring in _RINGS for way in _WAYS)):
            point = body.on_surface(start)
            if np.linalg.norm(point - center) <= WANDER + 1e-9:
                found.append((point, body.outward(start)))
    points, normals = (np.array([each[side] for each in found]).reshape(-1, 3) for side in (0, 1))
    # Of those that are much the same, one; none where a surface has no normal.
    alike = np.round(np.hstack([points / _SAME[0], normals / _SAME[1]]))
    chosen = np.sort(np.unique(alike, axis=0, return_index=True)[1])
    chosen = chosen[np.linalg.norm(normals[chosen], axis=1) > 0.5]
    return points[chosen], normals[chosen]
