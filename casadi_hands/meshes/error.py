"""How far a union of convex parts is from the mesh that it stands for."""

from __future__ import annotations

from collections.abc import Sequence

import coal
import numpy as np
from numpy.typing import NDArray

from casadi_hands.geometry.hull import crossed
from casadi_hands.meshes.mesh import Mesh
from casadi_hands.meshes.winding import surface_points, winding_numbers

_GAP = 1e-3  # of the size
_ASKED = 200  # points of a part, the farthest from the mesh, of which it is found out on which side they are


def union_error(mesh: Mesh, parts: Sequence[Mesh], samples: int = 4000) -> tuple[float, float]:
    """The largest distances between the surface of a solid and that of the union of its parts, sampled both ways.

    Args:
        mesh: the solid.
        parts: convex.
        samples: points of either surface; corners are added.

    Returns:
        How far the solid is outside of the union at most, and how far the union is outside of the solid, in the mesh's
        unit. Gaps between parts below a thousandth of the mesh's size do not count.
    """
    points = np.vstack([mesh.vertices[:: 1 + len(mesh.vertices) // samples], surface_points(mesh, samples)[0]])
    beyond = np.min([outside_distance(part, points) for part in parts], axis=0)
    missing, added = float(beyond.max(initial=0.0)), abs(float(beyond.min(initial=0.0)))
    for k, part in enumerate(parts):
        surface, normals = surface_points(part, samples // len(parts) + 50)
        covered = [
            _beyond_planes(other, surface + _GAP * mesh.size * normals) for j, other in enumerate(parts) if j != k
        ]
        free = surface[np.min(covered, axis=0) > 0] if covered else surface
        away = surface_distance(mesh, free)
        farthest = np.argsort(-away)[:_ASKED]
        within = winding_numbers(mesh, free[farthest]) > 0.5
        missing = max(missing, float(away[farthest][within].max(initial=0.0)))
        added = max(added, float(away[farthest][~within].max(initial=0.0)))
    return missing, added


def outside_distance(part: Mesh, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances (N,) of points (N, 3) from a convex part; negative within, the depth below its nearest face."""
    beyond = _beyond_planes(part, points)
    far = beyond > 0
    distances = beyond.copy()
    if far.any():
        distances[far] = surface_distance(part, points[far])
    return distances


def surface_distance(mesh: Mesh, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances (N,) of points (N, 3) from the nearest triangle."""
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(mesh.faces), len(mesh.vertices))
    vertices, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    vertices.extend([np.array(point) for point in mesh.vertices])
    triangles.extend([coal.Triangle(*(int(k) for k in face)) for face in mesh.faces])
    model.addSubModel(vertices, triangles)
    model.endModel()
    radius = 1e-6 * mesh.size
    probe, still, place = coal.Sphere(radius), coal.Transform3s.Identity(), coal.Transform3s.Identity()
    request = coal.DistanceRequest()
    distances = np.empty(len(points))
    for k, point in enumerate(points):
        place.setTranslation(point)
        distances[k] = coal.distance(model, still, probe, place, request, coal.DistanceResult()) + radius
    return np.maximum(distances, 0.0)


def _beyond_planes(part: Mesh, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) largest signed distance of points from the planes of a convex part's faces."""
    normals = crossed(part.corners)
    lengths = np.linalg.norm(normals, axis=1)
    proper = lengths > 1e-12 * lengths.max()
    normals = normals[proper] / lengths[proper, None]
    most: NDArray[np.float64] = (points @ normals.T - np.einsum("fi,fi->f", normals, part.corners[proper, 0])).max(
        axis=1
    )
    return most
