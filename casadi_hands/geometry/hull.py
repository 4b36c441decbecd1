"""Polytopes in numbers: the least one about points, and what is well within it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

Array = NDArray[np.float64]
_FLAT = np.cos(np.radians(3))  # of the angle between faces: next to blunter edges their planes are near enough
_TIP = np.cos(np.radians(10))  # of the largest angle between faces about a corner, likewise
ALIKE = 1e-4  # of a unit normal, and of the size: faces that differ by less are one


@dataclass(frozen=True)
class Hull:
    """A polytope in numbers.

    Attributes:
        normals: (F, 3) of its faces, unit, outward.
        reaches: (F,) of their planes along them.
        corners: (V, 3).
        triangles: (T, 3) of their numbers, counterclockwise seen from outside.
        edges: (E, 2) numbers of corners at the ends of each sharp one, see `edges_of`.
    """

    normals: Array
    reaches: Array
    corners: Array
    triangles: NDArray[np.int_]
    edges: NDArray[np.int_]

    def placed(self, rotation: Array, position: Array) -> Hull:
        """The same polytope turned by a rotation (3, 3), then shifted by (3,): faces and corners stay what they are."""
        normals = self.normals @ rotation.T
        corners = self.corners @ rotation.T + position
        return replace(self, normals=normals, reaches=self.reaches + normals @ position, corners=corners)


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
    return Hull(faces[:, :3], -faces[:, 3], corners, triangles, edges_of(corners, triangles))


def edges_of(corners: Array, triangles: NDArray[np.int_]) -> NDArray[np.int_]:
    """Pairs (E, 2) of corners between which faces meet at an angle, each pair once; and tips of none of these, twice.

    A tip is a corner about which faces are turned, like that of a cone of many sides.
    """
    normals = crossed(corners[triangles])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    owner: dict[tuple[int, int], int] = {}
    found = []
    for number, triangle in enumerate(triangles):
        for i, j in ((int(triangle[k - 1]), int(triangle[k])) for k in range(3)):
            owner[i, j] = number
            if (j, i) in owner and normals[number] @ normals[owner[j, i]] < _FLAT:
                found.append((i, j))
    blunt = set(range(len(corners))) - {corner for edge in found for corner in edge}
    for corner in sorted(blunt):
        around = normals[(triangles == corner).any(axis=1)]
        if (around @ around.T).min() < _TIP:
            found.append((corner, corner))
    return np.reshape(np.array(found, int), (-1, 2))


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
