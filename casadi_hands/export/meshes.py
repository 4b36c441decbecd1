"""Files of the polytopes that an object is made of."""

from __future__ import annotations

from typing import TYPE_CHECKING

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


def mesh_files(task: Task) -> dict[str, str]:
    """Wavefront OBJ texts of the object's polytopes, m, object frame, by their paths."""
    return {mesh_path(name): _obj(solid) for name, solid in polytopes(task).items()}


def _obj(solid: Solid) -> str:
    lines = [f"v {numbers(vertex)}" for vertex in solid.vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in (solid.triangles + 1).tolist()]
    return "\n".join(lines) + "\n"
