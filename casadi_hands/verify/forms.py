"""How task files and results state the shapes that an object is made of.

To add one, add its class beside those of `shapes` or `flat`, and a function here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.verify.flat import Box, Convex
from casadi_hands.verify.reading.stored import as_array, entry
from casadi_hands.verify.shapes import Capsule, Cylinder, Shape


@dataclass(frozen=True)
class Form:
    """How a shape is stated.

    Attributes:
        shape: its class.
        read: numbers by name -> the shape, or None where they state none.
        lengths: names of numbers that both files state alike, though the shape may not show them.
    """

    shape: type[Shape]
    read: Callable[[Any], Shape | None]
    lengths: tuple[str, ...]


def _sphere(numbers: Any) -> Shape | None:
    center, radius = as_array(entry(numbers, "center"), (3,)), as_array(entry(numbers, "radius"), ())
    return None if center is None or radius is None else Capsule(center, center, float(radius))


def _capsule(numbers: Any) -> Shape | None:
    start, end = (as_array(entry(numbers, name), (3,)) for name in ("start", "end"))
    radius = as_array(entry(numbers, "radius"), ())
    return None if start is None or end is None or radius is None else Capsule(start, end, float(radius))


def _cylinder(numbers: Any) -> Shape | None:
    start, end = (as_array(entry(numbers, name), (3,)) for name in ("start", "end"))
    radius, edge = (as_array(entry(numbers, name), ()) for name in ("radius", "edge_radius"))
    if start is None or end is None or radius is None or edge is None:
        return None
    return Cylinder(start, end, float(radius))


def _box(numbers: Any) -> Shape | None:
    center, size = (as_array(entry(numbers, name), (3,)) for name in ("center", "size"))
    turn, edge = _turn(numbers), as_array(entry(numbers, "edge_radius"), ())
    if center is None or size is None or turn is None or edge is None or size.min() <= 0.0:
        return None
    return Box(size, center, turn)


def _turn(numbers: Any) -> np.ndarray | None:
    """Return the rotation (3, 3) that a task file gives by axis and angle, a result as a quaternion."""
    stated = entry(numbers, "rotation")
    if stated is None:
        quaternion = as_array(entry(numbers, "orientation"), (4,))
        if quaternion is None or np.linalg.norm(quaternion) < 1e-3:
            return None
        return np.asarray(Rotation.from_quat(quaternion, scalar_first=True).as_matrix())
    axis, degrees = as_array(entry(stated, "axis"), (3,)), as_array(entry(stated, "degrees"), ())
    if axis is None or degrees is None or not np.linalg.norm(axis):
        return None
    return np.asarray(Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis)).as_matrix())


def _convex(numbers: Any) -> Shape | None:
    stated, edge = entry(numbers, "vertices"), as_array(entry(numbers, "edge_radius"), ())
    if not isinstance(stated, list) or len(stated) < 4 or edge is None:
        return None
    points = as_array(stated, (len(stated), 3))
    return None if points is None or np.linalg.matrix_rank(points - points[0]) < 3 else Convex(points)


FORMS = {
    "sphere": Form(Capsule, _sphere, ("radius",)),
    "capsule": Form(Capsule, _capsule, ("radius",)),
    "cylinder": Form(Cylinder, _cylinder, ("radius", "edge_radius")),
    "box": Form(Box, _box, ("edge_radius",)),
    "convex": Form(Convex, _convex, ("edge_radius",)),
}
"""By the kind's name."""
