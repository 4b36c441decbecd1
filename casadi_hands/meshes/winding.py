"""How often a closed surface goes round a point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from casadi_hands.geometry.hull import crossed
from casadi_hands.meshes.mesh import Mesh

_AT_ONCE = 50_000  # points × faces: what a processor's cache holds


def winding_numbers(mesh: Mesh, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Generalised winding numbers (Jacobson et al. 2013): 1 within a solid, 0 outside, 2 where two overlap.

    The sum of the solid angles of all faces (van Oosterom and Strackee 1983) over 4 π.

    Args:
        mesh: any.
        points: (N, 3).

    Returns:
        (N,).
    """
    corners, step = mesh.corners, max(1, _AT_ONCE // max(len(mesh.faces), 1))
    parts = [_angles(corners[None] - block[:, None, None]) for block in _blocks(points, step)]
    return np.concatenate(parts) / (4 * np.pi) if parts else np.zeros(0)


def overlapped(mesh: Mesh) -> float:
    """The share of the surface that does not divide solid from empty space: zero unless a solid overlaps itself.

    Args:
        mesh: closed, faces outward. Points of its surface are asked: 400, or 100 of a fine one, the same at every call.
    """
    samples = 400 if len(mesh.faces) < 10_000 else 100
    points, normals = surface_points(mesh, samples)
    outside = winding_numbers(mesh, points + 1e-5 * mesh.size * normals)
    return float((np.abs(outside) > 0.5).mean())


def surface_points(mesh: Mesh, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (N, 3) spread evenly over a surface, one draw a share of its area, and its normals there (N, 3)."""
    random = np.random.default_rng(0)
    a, b, c = (mesh.corners[:, k] for k in range(3))
    across = crossed(mesh.corners)
    doubled = np.linalg.norm(across, axis=1)
    upto = np.cumsum(doubled)
    chosen = np.searchsorted(upto, (np.arange(count) + random.random(count)) / count * upto[-1], side="right")
    chosen = np.minimum(chosen, len(upto) - 1)
    u, v = random.random((2, count, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    points = a[chosen] + u * (b - a)[chosen] + v * (c - a)[chosen]
    return points, across[chosen] / np.maximum(doubled[chosen], 1e-300)[:, None]


def _blocks(points: NDArray[np.float64], step: int) -> list[NDArray[np.float64]]:
    return [points[k : k + step] for k in range(0, len(points), step)]


def _angles(arms: NDArray[np.float64]) -> NDArray[np.float64]:
    """The sum (N,) of the solid angles of faces whose corners are away from N points by (N, F, 3, 3)."""
    a, b, c = (arms[:, :, k] for k in range(3))
    la, lb, lc = (np.linalg.norm(arm, axis=-1) for arm in (a, b, c))
    triple = np.einsum("nfi,nfi->nf", a, np.cross(b, c))
    ab, bc, ca = (np.einsum("nfi,nfi->nf", one, other) for one, other in ((a, b), (b, c), (c, a)))
    total: NDArray[np.float64] = 2 * np.arctan2(triple, la * lb * lc + ab * lc + bc * la + ca * lb).sum(axis=1)
    return total
