"""Does the object look like what it collides as, to what its task says of the mesh that it was made of?"""

from __future__ import annotations

import numpy as np

from casadi_hands.verify.flat import Convex
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.report import show

_MORE = 1.05  # of what was sampled, which any other sample may exceed
_LEAST = 1e-3  # of the object's half extent
_POINTS = 3000  # at most, of either surface


def raw_mesh_problems(folder: Folder) -> list[str]:
    """Return where meshes that are seen and polytopes that collide are farther apart than the task states."""
    body, records = folder.object, folder.task.object.meshes or ()
    if not body.raw:
        return []
    stated = [record for record in records if record.raw is not None]
    if len(stated) != len(body.raw):
        return [f"object.urdf shows {len(body.raw)} meshes, task.yaml tells of {len(stated)}"]
    rounding = _LEAST * folder.length
    problems = []
    corners = np.vstack([mesh.vertices for mesh in body.raw])
    corners = corners[:: 1 + len(corners) // _POINTS]
    out = float(np.min([shape.distance(corners) for shape in body.shapes], axis=0).max())
    if out > _MORE * max(record.leaves_out for record in stated) + rounding:
        problems.append(f"object.urdf: what is seen stands out of what collides by {show(out, 'm')}, unstated")
    parts = np.vstack([shape.corners for shape in body.shapes if isinstance(shape, Convex)])
    outside = parts[~np.any([mesh.contains(parts) for mesh in body.raw], axis=0)]
    # What else the object is made of may hide where they are.
    outside = [p for p in outside if all(float(shape.distance(p)) > 0 for shape in body.seen)]
    over = max((min(mesh.distance(p, p) for mesh in body.raw) for p in outside), default=0.0)
    if over > _MORE * max(record.adds for record in stated) + rounding:
        problems.append(f"object.urdf: what collides stands out of what is seen by {show(over, 'm')}, unstated")
    return problems
