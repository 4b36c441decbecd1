"""Files of the polytopes that an object is made of, and of meshes for which they stand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from casadi_hands.export.markup import numbers
from casadi_hands.geometry.bodies import Solid

if TYPE_CHECKING:
    from casadi_hands.task import Task

FOLDER = "meshes"


def object_solids(task: Task) -> dict[str, Solid]:
    """The solids that the object is made of by the names that they have in files."""
    solids = [solid for shape in task.object.shapes for solid in shape.body.solids()]
    return {f"object{k}": solid for k, solid in enumerate(solids)}


def polytopes(task: Task) -> dict[str, Solid]:
    """Those of them that have files."""
    return {name: solid for name, solid in object_solids(task).items() if solid.kind == "convex"}


def mesh_path(name: str) -> str:
    """Where a polytope's file is, relative to those that name it."""
    return f"{FOLDER}/{name}.obj"


def raw_meshes(task: Task) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Vertices (V, 3), m, object frame, and faces (F, 3) of meshes before they were cut, by their files' paths."""
    found = {record.raw: record.raw_mesh for record in task.object.meshes or () if record.raw is not None}
    return {path: (raw.vertices, raw.faces) for path, raw in found.items() if raw is not None}


def of_raw_meshes(task: Task) -> dict[str, str]:
    """The names of solids that stand for raw meshes, each with its mesh's path."""
    found: dict[str, str] = {}
    names = iter(object_solids(task))
    of_shapes = [[next(names) for _ in shape.body.solids()] for shape in task.object.shapes]
    for record in task.object.meshes or ():
        if record.raw_mesh is not None and record.raw is not None and record.first is not None:
            for own in of_shapes[record.first : record.first + record.parts]:
                found |= dict.fromkeys(own, record.raw)
    return found


def mesh_files(task: Task) -> dict[str, str]:
    """Wavefront OBJ texts of the object's polytopes and raw meshes, m, object frame, by their paths."""
    solids = {mesh_path(name): (solid.vertices, solid.triangles) for name, solid in polytopes(task).items()}
    return {path: _obj(*each) for path, each in {**solids, **raw_meshes(task)}.items()}


def _obj(vertices: np.ndarray, triangles: np.ndarray) -> str:
    lines = [f"v {numbers(vertex)}" for vertex in vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in (triangles + 1).tolist()]
    return "\n".join(lines) + "\n"
