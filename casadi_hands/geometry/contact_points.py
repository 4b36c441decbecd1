"""Contact points on bodies in numbers."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from casadi_hands.geometry.bodies import Body

Array = NDArray[np.float64]


def inward_normals(points: Array, bodies: Sequence[Body]) -> Array:
    """(C, 3) unit normals into the object at surface points (C, 3), each of its body, object frame."""
    return np.array([-body.outward(point) for point, body in zip(points, bodies, strict=True)])


def rounded_normals(points: Array, body: Body, rounding: float = 1e-6) -> Array:
    """(S, 3) outward normals at surface points (S, 3) of a body, its kinks rounded as constraints have them."""
    return np.asarray(_normals(type(body), rounding).map(len(points))(points.T, body.parameters)).T


@cache
def _normals(kind: type[Body], rounding: float) -> ca.Function:
    """The normal at a point of a body with some parameters."""
    point, parameters = SX.sym("point", 3), SX.sym("parameters", kind.width)
    return ca.Function(
        "normal", [point, parameters], [kind.surface(parameters).distance_and_normal(point, rounding)[1]]
    )


def on_bodies(points: Array, bodies: Sequence[Body]) -> Array:
    """Points (C, 3) moved along their normals onto the surface of their bodies, all in one frame."""
    return np.array([body.on_surface(point) for point, body in zip(points, bodies, strict=True)])
