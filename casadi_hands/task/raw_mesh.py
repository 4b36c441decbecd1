"""The triangles that a mesh among an object's shapes has before it is cut into convex parts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from casadi_hands.errors import MeshError
from casadi_hands.meshes import read_mesh

FOLDER, WITHIN = "folder", "within"
"""Of the context that a task is validated in: where relative paths start, and whether all files must be below it."""


@dataclass(frozen=True, eq=False)
class RawMesh:
    """A closed mesh of triangles. Tasks are equal whatever these are: their convex parts are what counts.

    Attributes:
        vertices: (V, 3) m, object frame.
        faces: (F, 3) numbers of vertices, counterclockwise seen from outside.
    """

    vertices: np.ndarray
    faces: np.ndarray

    def __eq__(self, other: object) -> bool:
        """Not what tasks differ in."""
        return other is None or isinstance(other, RawMesh)

    __hash__ = None  # type: ignore[assignment]

    def moved(self, by: np.ndarray) -> RawMesh:
        """The same shifted by ``by`` (3,), m."""
        return RawMesh(self.vertices + by, self.faces)


def raw_path(number: int) -> str:
    """Where a result folder has the raw mesh of the object's ``number``-th mesh."""
    return f"meshes/object_raw{number}.obj"


def read_raw(file: str, context: Mapping[str, Any]) -> RawMesh | None:
    """The mesh of a file beside a task's, m, object frame; None where there is none, or no folder to look in.

    Raises:
        MeshError: it is no mesh, or outside of the folder where a task must keep to it.
    """
    if context.get(FOLDER) is None:
        return None
    path = place(file, context)
    if not path.is_file():
        return None
    mesh = read_mesh(path)
    return RawMesh(mesh.vertices, mesh.faces)


def place(file: str, context: Mapping[str, Any]) -> Path:
    """Where a file is that a task names.

    Raises:
        MeshError: outside of the folder, where a task must keep to it.
    """
    folder = Path(context.get(FOLDER) or ".")
    path = folder / file
    if context.get(WITHIN):
        try:
            within = path.resolve().is_relative_to(folder.resolve())
        except (OSError, RuntimeError, ValueError):
            within = False
        if not within:
            raise MeshError(f"{file!r}", "a file in the task's own folder: a result folder holds all that it needs")
    return path
