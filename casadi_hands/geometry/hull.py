"""Polytopes in numbers: the least one about points, and what is well within it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

Array = NDArray[np.float64]
_ACUTE, _STEP = np.radians(95), np.radians(65)  # between normals of faces: where there are bevels, and how many
ALIKE = 1e-4  # of a unit normal, and of the size: faces that differ by less are one


@dataclass(frozen=True)
class Hull:
    """A polytope in numbers.

    Attributes:
        normals: (F, 3) of its faces, unit, outward.
        reaches: (F,) of their planes along them.
        corners: (V, 3).
        triangles: (T, 3) of their numbers, counterclockwise seen from outside.
        bevels: (B, 3) unit normals of planes that touch it along sharp edges only, see `bevels_of`.
    """

    normals: Array
    reaches: Array
    corners: Array
    triangles: NDArray[np.int_]
    bevels: Array

    @property
    def bevel_reaches(self) -> Array:
        """(B,) of the bevels' planes along their normals."""
        return np.asarray((self.bevels @ self.corners.T).max(axis=1))

    def placed(self, rotation: Array, position: Array) -> Hull:
        """The same polytope turned by a rotation (3, 3), then shifted by (3,): faces and corners stay what they are."""
        normals = self.normals @ rotation.T
        corners = self.corners @ rotation.T + position
        reaches, bevels = self.reaches + normals @ position, self.bevels @ rotation.T
        return replace(self, normals=normals, reaches=reaches, corners=corners, bevels=bevels)


def hull_of(points: Array) -> Hull:
    """The least polytope about points (V, 3), coplanar triangles one face.

    Raises:
        QhullError: they lie in a plane.
    """
    found = ConvexHull(points)
    size, planes = float(np.ptp(points, axis=0).max()), found.equations
    faces = np.zeros((0, 4))
    for plane in planes:
        apart = faces - plane
        if np.all((np.linalg.norm(apart[:, :3], axis=1) > ALIKE) | (np.abs(apart[:, 3]) > ALIKE * size)):
            faces = np.vstack([faces, plane])
    corners = points[found.vertices]
    new = {int(old): k for k, old in enumerate(found.vertices)}
    triangles = np.array([[new[int(v)] for v in triangle] for triangle in found.simplices])
    triangles = turned_outward(triangles, corners, planes[:, :3])
    return Hull(faces[:, :3], -faces[:, 3], corners, triangles, bevels_of(corners, triangles))


def bevels_of(corners: Array, triangles: NDArray[np.int_]) -> Array:
    """Unit normals (B, 3) between those of faces that meet in an acute edge, so that none are far from the next.

    How far a point is beyond the planes of all faces tells how far it is from a polytope but near its edges: there it
    is less, and of acute ones by more than half.
    """
    normals = crossed(corners[triangles])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    owner: dict[tuple[int, int], int] = {}
    found: list[Array] = []
    for number, triangle in enumerate(triangles):
        for i, j in ((int(triangle[k - 1]), int(triangle[k])) for k in range(3)):
            owner[i, j] = number
            if (j, i) not in owner:
                continue
            one, other = normals[number], normals[owner[j, i]]
            angle = float(np.arccos(np.clip(one @ other, -1, 1)))
            steps = int(np.ceil(angle / _STEP)) if angle > _ACUTE else 1
            shares = np.arange(1, steps)[:, None] / steps
            found.extend((np.sin((1 - shares) * angle) * one + np.sin(shares * angle) * other) / np.sin(angle))
    return np.reshape(found, (-1, 3))


def turned_outward(triangles: NDArray[np.int_], corners: Array, normals: Array) -> NDArray[np.int_]:
    """Triangles (T, 3) of corners (V, 3), counterclockwise seen from where their outward normals (T, 3) point to."""
    inward = np.einsum("ti,ti->t", crossed(corners[triangles]), normals) < 0
    return np.where(inward[:, None], triangles[:, ::-1], triangles)


def crossed(triangles: Array) -> Array:
    """Normals (T, 3) of triangles (T, 3, 3), twice their areas long."""
    return np.asarray(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]))


def mass_moments(triangles: Array) -> tuple[float, Array, Array]:
    """Of the solid that triangles (T, 3, 3) bound, all seen counterclockwise from outside.

    The integrals over tetrahedra that each triangle spans with one point, exact for polyhedra (Tonon 2004).

    Returns:
        Volume; centroid (3,); inertia (3, 3) about it of a mass of one.
    """
    origin = triangles.mean(axis=(0, 1))
    arms = triangles - origin
    volumes = np.linalg.det(arms) / 6
    volume, whole = float(volumes.sum()), arms.sum(axis=1)
    middle = volumes @ whole / (4 * volume)
    # ∫ x xᵀ over a tetrahedron with a corner at the origin: V/20 (Σ aᵢ aᵢᵀ + s sᵀ).
    second = np.einsum("t,tki,tkj->ij", volumes, arms, arms) + np.einsum("t,ti,tj->ij", volumes, whole, whole)
    moments = second / (20 * volume) - np.outer(middle, middle)
    return volume, origin + middle, np.trace(moments) * np.eye(3) - moments


def within(hull: Hull, by: float) -> Hull | None:
    """What is at least so far inside of all faces of a hull; None where nothing is."""
    inside = hull.corners.mean(axis=0)
    halves = np.column_stack([hull.normals, by - hull.reaches])
    if (halves[:, :3] @ inside + halves[:, 3]).max() >= 0:
        return None
    try:
        return hull_of(np.unique(HalfspaceIntersection(halves, inside).intersections.round(15), axis=0))
    except QhullError:
        return None
