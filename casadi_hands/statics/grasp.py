"""Grasp statics in numbers: the grasp map and linearised friction cones."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Array = NDArray[np.float64]
EDGES = 8  # of a linearised friction cone


def grasp_map(points: Array) -> Array:
    """(6, 3C) from contact forces to the wrench about the object's origin; points (C, 3), all in one frame."""
    return np.vstack([np.tile(np.eye(3), len(points)), np.hstack([pin.skew(p) for p in points])])


def friction_edges(normals: Array, friction: Array, count: int = EDGES) -> Array:
    """(3, C·count) unit-normal-force edges of the linearised friction cones, inscribed."""
    across = np.cross(normals, np.eye(3)[np.argmin(np.abs(normals), axis=1)])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    other = np.cross(normals, across)
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)[:, None]
    sideways = np.cos(angles) * across[:, None] + np.sin(angles) * other[:, None]
    edges: Array = (normals[:, None] + friction[:, None, None] * sideways).reshape(-1, 3).T
    return edges


def torsion_edges(points: Array, normals: Array, radius: float) -> Array:
    """(6, 2C) wrenches of soft fingertips that press with 1 along their normals (C, 3) and twist, either way.

    Args:
        points: (C, 3) of the contacts.
        normals: (C, 3), inward.
        radius: of their torsional friction; the columns are none where it is 0.
    """
    if not radius:
        return np.zeros((6, 0))
    pressed = np.vstack([normals.T, np.cross(points, normals).T])
    twist = np.vstack([np.zeros((3, len(points))), radius * normals.T])
    return np.hstack([pressed + twist, pressed - twist])


def spread_forces(normals: Array, friction: Array, count: int = EDGES) -> Array:
    """(3C, C·count): contact forces one above the other for each edge of the friction cones about normals (C, 3)."""
    edges = friction_edges(normals, friction, count)
    mask = np.kron(np.eye(len(normals)), np.ones((3, count)))
    return np.asarray(np.tile(edges, (len(normals), 1)) * mask)
