"""A URDF file: its links as bodies, its joints, and what it holds beside what the format says."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.errors import DesignError
from casadi_hands.verify.bodies import Body, joined
from casadi_hands.verify.flat import Box, Convex
from casadi_hands.verify.raw_mesh import RawMesh
from casadi_hands.verify.reading.markup import name_of, number, numbers, only, positive, read_xml, strangers
from casadi_hands.verify.reading.points import read_points
from casadi_hands.verify.reading.triangles import read_raw_mesh
from casadi_hands.verify.reading.vocabulary import attribute_words, compiler_words, motor_words, transmission_words
from casadi_hands.verify.shapes import Capsule, Cylinder, Shape


@dataclass(frozen=True)
class Joint:
    """A revolute joint of a URDF.

    Attributes:
        name: as in the URDF.
        parent, child: links.
        position: (3,) m, of the child's frame in the parent's.
        turn: (3,) roll, pitch and yaw of the child's frame in the parent's at zero angle, rad.
        axis: (3,) in the child's frame.
        lower, upper: rad.
        effort: N·m.
        velocity: rad/s.
        mimic: the joint that this one follows, by which multiplier, plus how many rad.
    """

    name: str
    parent: str
    child: str
    position: np.ndarray
    turn: np.ndarray
    axis: np.ndarray
    lower: float
    upper: float
    effort: float
    velocity: float
    mimic: tuple[str, float, float] | None = None


@dataclass(frozen=True)
class Robot:
    """What a URDF says.

    Attributes:
        links: by name, in the file's order.
        joints: likewise.
        strange: what the format does not have, a sentence each.
        text: the file's content as it was read, comments left out.
    """

    links: dict[str, Body]
    joints: dict[str, Joint]
    strange: tuple[str, ...]
    text: str


def read_robot(path: Path) -> Robot:
    """Read a URDF of simple shapes and revolute joints; boxes only to be seen are servos, thin cylinders hinges.

    A cylinder with a sphere of its radius at either end is read as the capsule they form.

    Raises:
        DesignError: the file is missing or is not XML; a name or a property is given twice; a number is missing, is not
            finite or cannot be; a shape is none of those that it knows; a joint does not turn.
    """
    root = read_xml(path, "robot")
    text = ElementTree.tostring(root, encoding="unicode")
    links: dict[str, Body] = {}
    joints: dict[str, Joint] = {}
    strange = list(strangers(root, "link joint transmission material mujoco", "name version"))
    for element in root:
        if element.tag == "link":
            name = name_of(path, element, links)
            links[name], odd = _read_link(path, name, element)
            strange += odd
        elif element.tag == "joint":
            name = name_of(path, element, joints)
            joints[name] = _read_joint(path, name, element)
            strange += strangers(element, "parent child origin axis limit mimic", "name type")
            for mimic in element.findall("mimic"):
                strange += strangers(mimic, "", "joint multiplier offset")
        elif element.tag == "mujoco":
            strange += compiler_words(element)
        elif element.tag == "transmission":
            strange += transmission_words(element, {joint.get("name") for joint in root.findall("joint")})
    strange += motor_words(root, [name for name, joint in joints.items() if joint.mimic is None])
    strange += attribute_words(root)
    return Robot(links, joints, tuple(f"{path.name}: {what}" for what in strange), text)


def _read_joint(path: Path, name: str, element: Element) -> Joint:
    kind = element.get("type")
    if kind != "revolute":
        raise DesignError(f"{path}: joint {name} is of type '{kind}', not revolute")
    parts = {tag: only(path, element, tag) for tag in ("parent", "child", "origin", "axis", "limit")}
    missing = [tag for tag in ("parent", "child", "axis", "limit") if parts[tag] is None]
    if missing:
        raise DesignError(f"{path}: joint {name} has no <{missing[0]}>")
    parent, child, origin, axis, limit = (parts[tag] for tag in ("parent", "child", "origin", "axis", "limit"))
    assert parent is not None
    assert child is not None
    assert axis is not None
    assert limit is not None
    able = {word: number(path, limit, word) for word in ("effort", "velocity")}
    for word, value in able.items():
        if value <= 0.0:
            raise DesignError(f"{path}: joint {name}: its {word} limit is {value:g}, not above zero")
    lower, upper = number(path, limit, "lower"), number(path, limit, "upper")
    if lower > upper:
        raise DesignError(f"{path}: joint {name}: its lower limit, {lower:g}, is above its upper, {upper:g}")
    zero = Element("origin")
    return Joint(
        name,
        parent.get("link", ""),
        child.get("link", ""),
        numbers(path, zero if origin is None else origin, "xyz", 3, "0 0 0"),
        numbers(path, zero if origin is None else origin, "rpy", 3, "0 0 0"),
        numbers(path, axis, "xyz", 3, "1 0 0"),
        lower,
        upper,
        able["effort"],
        able["velocity"],
        _mimic(path, element),
    )


def _mimic(path: Path, element: Element) -> tuple[str, float, float] | None:
    """Return the joint that one follows, its multiplier and offset."""
    mimic = only(path, element, "mimic")
    if mimic is None:
        return None
    return mimic.get("joint", ""), number(path, mimic, "multiplier", "1"), number(path, mimic, "offset", "0")


def _placement(path: Path, element: Element) -> np.ndarray:
    placement = np.eye(4)
    origin = only(path, element, "origin")
    if origin is not None:
        turn = numbers(path, origin, "rpy", 3, "0 0 0")
        placement[:3, :3] = Rotation.from_euler("xyz", turn).as_matrix()
        placement[:3, 3] = numbers(path, origin, "xyz", 3, "0 0 0")
    return placement


@dataclass
class _Found:
    """Shapes of a link that collide, or that are seen."""

    spheres: list[Capsule] = field(default_factory=list)
    cylinders: list[Cylinder] = field(default_factory=list)
    flat: list[Box | Convex] = field(default_factory=list)
    meshes: list[str] = field(default_factory=list)
    raw: list[RawMesh] = field(default_factory=list)

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """What they make."""
        return (*joined(self.spheres, self.cylinders), *self.flat)

    @property
    def rows(self) -> list[tuple[float, ...]]:
        """Numbers by which they are compared, in an order of their own."""
        return self.without([])

    def without(self, unseen: list[Convex]) -> list[tuple[float, ...]]:
        """The same of all but some."""
        flat = [shape for shape in self.flat if not any(shape is other for other in unseen)]
        rows = [np.array([shape.radius, *shape.start, *shape.end]) for shape in (*self.spheres, *self.cylinders)]
        rows += [shape.corners[np.lexsort(shape.corners.T.round(9))].ravel() for shape in flat]
        return sorted(tuple(np.round(row, 9).tolist()) for row in rows)


def _read_link(path: Path, name: str, link: Element) -> tuple[Body, list[str]]:
    strange = list(strangers(link, "inertial visual collision", "name"))
    collides, seen = _Found(), _Found()
    for role, found in (("collision", collides), ("visual", seen)):
        for element in link.findall(role):
            strange += strangers(element, "origin geometry material")
            for color in element.iter("color"):
                numbers(path, color, "rgba", 4)
            _read_shape(path, name, element, found, collides.meshes if found is seen else None)
    seen.cylinders = [cylinder for cylinder in seen.cylinders if not _in_hinge(cylinder, collides.shapes)]
    # Boxes that are only seen are servos.
    cases = [each for each in seen.flat if isinstance(each, Box) and not any(each.agrees(o) for o in collides.flat)]
    seen.flat = [each for each in seen.flat if not any(each is case for case in cases)]
    unseen: list[Convex] = []
    if seen.raw:
        hulls = [each for each in collides.flat if isinstance(each, Convex)]
        unseen = [each for each in hulls if not any(each.agrees(other) for other in seen.flat)]
    if collides.without(unseen) != seen.rows or bool(unseen) != bool(seen.raw):
        strange.append(f"link {name} looks other than it collides: its visual geometry is not its collision geometry")
    inertial, raw = _inertial(path, name, link), tuple(seen.raw)
    return Body(name, *inertial, collides.shapes, tuple(cases), raw, tuple(unseen)), strange


def _in_hinge(cylinder: Cylinder, body: tuple[Shape, ...]) -> bool:
    """Whether a cylinder is no farther from the joint than where a link's one capsule begins, and thinner."""
    capsule = body[0] if len(body) == 1 else None
    if not isinstance(capsule, Capsule) or cylinder.radius >= capsule.radius:
        return False
    length = float(np.linalg.norm(capsule.start)) * (1 + 1e-6)
    return all(float(np.linalg.norm(end)) <= length for end in (cylinder.start, cylinder.end))


def _read_shape(path: Path, name: str, element: Element, found: _Found, colliding: list[str] | None) -> None:
    """Read a shape; a mesh that is seen, and of which none that collides has the file, as triangles."""
    placement, geometry = _placement(path, element), only(path, element, "geometry")
    shape = geometry[0] if geometry is not None and len(geometry) == 1 else None
    if shape is None:
        raise DesignError(f"{path}: link {name}: its {element.tag} geometry is not one shape")
    turn, at = placement[:3, :3], placement[:3, 3]
    if shape.tag == "sphere":
        found.spheres.append(Capsule(at, at, positive(path, shape, "radius")))
    elif shape.tag == "cylinder":
        radius, reach = positive(path, shape, "radius"), 0.5 * positive(path, shape, "length") * turn[:, 2]
        found.cylinders.append(Cylinder(at - reach, at + reach, radius))
    elif shape.tag == "box":
        sides = numbers(path, shape, "size", 3)
        if sides.min() <= 0.0:
            raise DesignError(f"{path}: link {name}: a side of its box is {sides.min():g} m, not above zero")
        found.flat.append(Box(sides, at, turn))
    elif shape.tag == "mesh":
        file = shape.get("filename", "")
        found.meshes.append(file)
        if colliding is None or file in colliding:
            found.flat.append(Convex(read_points(path, file) @ turn.T + at))
        else:
            mesh = read_raw_mesh(path, file)
            found.raw.append(RawMesh(mesh.vertices @ turn.T + at, mesh.faces))
    else:
        raise DesignError(f"{path}: link {name}: its {element.tag} geometry is neither sphere, cylinder, box nor mesh")


def _inertial(path: Path, name: str, link: Element) -> tuple[float, np.ndarray, np.ndarray]:
    inertial = only(path, link, "inertial")
    if inertial is None:
        raise DesignError(f"{path}: link {name} has no mass: no <inertial>")
    placement, mass, tensor = _placement(path, inertial), only(path, inertial, "mass"), only(path, inertial, "inertia")
    if mass is None or tensor is None:
        raise DesignError(f"{path}: link {name}: its <inertial> has no <{'mass' if mass is None else 'inertia'}>")
    local = np.zeros((3, 3))
    for i, one in enumerate("xyz"):
        for j, other in enumerate("xyz"[i:], start=i):
            local[i, j] = local[j, i] = number(path, tensor, f"i{one}{other}", None if i == j else "0")
    principal = np.linalg.eigvalsh(local)
    if principal[0] <= 0.0 or principal[2] > (principal[0] + principal[1]) * (1 + 1e-9):
        raise DesignError(f"{path}: link {name}: its inertia is that of no solid body")
    rotation = placement[:3, :3]
    return _mass(path, name, mass), placement[:3, 3], rotation @ local @ rotation.T


def _mass(path: Path, name: str, element: Element) -> float:
    value = number(path, element, "value")
    if value <= 0.0:
        raise DesignError(f"{path}: link {name}: its mass is {value:g} kg, not above zero")
    return value
