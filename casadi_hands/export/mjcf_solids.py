"""What bodies of a MuJoCo scene are made of: geoms, meshes, mass."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement

from scipy.spatial.transform import Rotation

from casadi_hands.export.markup import Color, number, numbers
from casadi_hands.export.meshes import polytopes
from casadi_hands.geometry.bodies import Solid
from casadi_hands.problem.inertia import Inertial

if TYPE_CHECKING:
    from casadi_hands.task import Task


def add_meshes(root: Element, task: Task) -> None:
    """Add the object's polytopes by their corners, so that the scene needs no other file."""
    found = polytopes(task)
    if found:
        asset = SubElement(root, "asset")
        for name, solid in found.items():
            SubElement(asset, "mesh", name=name, vertex=numbers(solid.vertices.ravel()))


def add_inertial(body: Element, inertial: Inertial) -> None:
    """Add mass, centre of mass and inertia."""
    tensor = inertial.inertia
    full = (tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2])
    SubElement(body, "inertial", pos=numbers(inertial.center), mass=number(inertial.mass), fullinertia=numbers(full))


def add_solid(body: Element, attributes: dict[str, str], solid: Solid, color: Color) -> None:
    """Add a geom."""
    attributes = {**attributes, "rgba": numbers((*color, 1.0)), "type": solid.kind, "size": number(solid.radius)}
    if solid.kind == "box":
        turn = Rotation.from_matrix(solid.turn).as_quat(scalar_first=True)
        attributes["size"] = numbers(solid.size / 2)
        SubElement(body, "geom", attributes, pos=numbers(solid.start), quat=numbers(turn))
    elif solid.kind == "convex":
        del attributes["size"]
        SubElement(body, "geom", {**attributes, "type": "mesh"}, mesh=attributes["name"])
    elif solid.kind == "sphere":
        SubElement(body, "geom", attributes, pos=numbers(solid.start))
    else:
        SubElement(body, "geom", attributes, fromto=numbers((*solid.start, *solid.end)))
