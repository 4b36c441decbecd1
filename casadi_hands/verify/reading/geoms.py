"""Solids of ``scene.xml``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.errors import DesignError
from casadi_hands.verify.flat import Box, Convex
from casadi_hands.verify.reading.markup import called, number, numbers, positive, strangers
from casadi_hands.verify.shapes import Capsule, Cylinder, Shape

_COMMON = "name type friction priority rgba"
# What says where a solid is, and how large; MuJoCo would let a mesh or two ends say it anew.
_PLACED = {
    "sphere": "pos size",
    "cylinder": "pos size",
    "box": "pos quat size",
    "mesh": "mesh",
    "plane": "pos size condim",
}
_FRICTION = "1 0.005 0.0001"


@dataclass(frozen=True)
class Geom:
    """A solid of a body.

    Attributes:
        kind: ``sphere``, ``capsule``, ``cylinder``, ``box``, ``mesh`` or ``plane``.
        place: (3,) m, where the file puts it, body frame; of a plane, a point of it.
        shape: what it is; None of a plane, or of what the format does not have.
        friction: (3,) sliding, torsional (m) and rolling (m).
        priority: whose friction holds where two touch.
    """

    kind: str
    place: np.ndarray
    shape: Shape | None
    friction: np.ndarray
    priority: float


def read_geom(path: Path, meshes: Mapping[str, Convex], element: Element) -> tuple[Geom, list[str]]:
    """Read a solid.

    Args:
        path: of the scene.
        meshes: polytopes by name.
        element: ``<geom>``.

    Returns:
        What it is, and what of it the format does not have.
    """
    kind = element.get("type", "sphere")
    spans = kind == "capsule" or (kind == "cylinder" and element.get("fromto") is not None)
    strange = list(strangers(element, "", f"{_COMMON} {'fromto size' if spans else _PLACED.get(kind, '')}"))
    place = numbers(path, element, "pos", 3, "0 0 0")
    shape: Shape | None = None
    if kind == "sphere":
        shape = Capsule(place, place, positive(path, element, "size"))
    elif spans:
        ends = numbers(path, element, "fromto", 6)
        shape = (Capsule if kind == "capsule" else Cylinder)(ends[:3], ends[3:], positive(path, element, "size"))
    elif kind == "cylinder":
        radius, half = numbers(path, element, "size", 2)
        reach = np.array([0.0, 0.0, half])
        shape = Cylinder(place - reach, place + reach, float(radius))
    elif kind == "box":
        sides, turn = 2 * numbers(path, element, "size", 3), numbers(path, element, "quat", 4, "1 0 0 0")
        if sides.min() <= 0.0 or np.linalg.norm(turn) < 1e-3:
            raise DesignError(f"{path}: {called(element)} is a box without sides or orientation")
        shape = Box(sides, place, Rotation.from_quat(turn, scalar_first=True).as_matrix())
    elif kind == "mesh":
        shape = meshes.get(element.get("mesh", ""))
    elif kind != "plane":
        strange.append(f"{called(element)} is a {kind[:40]}, which the format does not have")
    elif number(path, element, "condim", "4") != 3:
        strange.append(f"{called(element)}: what touches it has friction of other than 3 dimensions (condim)")
    if element.get("rgba") is not None:
        numbers(path, element, "rgba", 4)
    friction = numbers(path, element, "friction", 3, _FRICTION)
    return Geom(kind, place, shape, friction, number(path, element, "priority", "0")), strange
