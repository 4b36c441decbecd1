"""A triangle mesh, and its unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from casadi_hands.errors import MeshError

LONGEST, SHORTEST = 5.0, 1e-3
"""Bounds on what a hand may move, m."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles whose vertices run counterclockwise, seen from outside.

    Attributes:
        vertices: (V, 3) points.
        faces: (F, 3) numbers of vertices.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]

    @property
    def corners(self) -> NDArray[np.float64]:
        """(F, 3, 3) the vertices of each face."""
        return self.vertices[self.faces]

    @property
    def size(self) -> float:
        """The diagonal of its bounding box."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0))) if len(self.vertices) else 0.0

    @property
    def volume(self) -> float:
        """Of the solid within, negative where its faces look inward."""
        return float(_signed_volumes(self.corners - self.vertices[:1]).sum()) if len(self.faces) else 0.0


def scaled(mesh: Mesh, scale: float) -> Mesh:
    """The mesh in metres.

    Args:
        mesh: in the file's unit.
        scale: metres to that unit: 0.001 for a file in millimetres.

    Raises:
        MeshError: it is then larger or smaller than anything a hand moves: the file is in another unit.
    """
    vertices = mesh.vertices * scale
    longest = float(np.ptp(vertices, axis=0).max()) if len(vertices) else 0.0
    given = f"a mesh {longest:.3g} m long"
    if not longest <= LONGEST:
        likely = "is it in millimetres? `scale: 0.001`" if scale == 1 else f"is `scale: {scale:g}` right?"
        raise MeshError(given, f"at most {LONGEST:g} m; {likely}")
    if 0 < longest < SHORTEST:
        likely = "is it in metres? `scale: 1`" if scale == 0.001 else f"is `scale: {scale:g}` right?"
        raise MeshError(f"a mesh {1e3 * longest:.3g} mm long", f"at least {1e3 * SHORTEST:g} mm; {likely}")
    return Mesh(vertices, mesh.faces)


def _signed_volumes(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(F,) of the tetrahedra that faces (F, 3, 3) span with the origin."""
    volumes: NDArray[np.float64] = np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    return volumes
