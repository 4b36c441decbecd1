"""Triangles in the files of a result folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from casadi_hands.errors import DesignError
from casadi_hands.problem.stored import LARGEST_NUMBER
from casadi_hands.verify.raw_mesh import RawMesh
from casadi_hands.verify.reading.points import file_within, read_rows

MOST_VERTICES, MOST_FACES = 60_000, 60_000


def read_raw_mesh(path: Path, name: str) -> RawMesh:
    """Return the triangles of an OBJ file that another file names, in the folder that is in.

    Args:
        path: of the file that names it.
        name: relative, as it stands there.

    Raises:
        DesignError: it is elsewhere, missing, too large, or holds no triangles.
    """
    file = file_within(path, name)
    vertices, numbers = read_rows(file, {"v": float, "f": int})
    faces = numbers - 1
    sized = vertices.ndim == 2 and faces.ndim == 2 and vertices.shape[1] == faces.shape[1] == 3
    if not sized or not (4 <= len(vertices) <= MOST_VERTICES and 4 <= len(faces) <= MOST_FACES):
        raise DesignError(f"{file}: a mesh has 4 to {MOST_FACES} triangles of up to {MOST_VERTICES} vertices")
    if not np.all(np.abs(vertices) < LARGEST_NUMBER) or faces.min() < 0 or faces.max() >= len(vertices):
        raise DesignError(f"{file}: not a mesh: its vertices are not finite, or a triangle has one that there is not")
    return RawMesh(vertices, faces)
