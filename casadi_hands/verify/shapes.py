"""Bodies as the URDF states them: mass properties and solid shapes, with distances by closed form and by coal."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import coal
import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.errors import DesignError


@dataclass(frozen=True)
class Capsule:
    """All points within ``radius`` of the segment ``start``-``end``; a sphere is a capsule of no length.

    Attributes:
        start, end: (3,) m, in the body's frame.
        radius: m.
    """

    start: np.ndarray
    end: np.ndarray
    radius: float

    def axis_point(self, point: np.ndarray) -> np.ndarray:
        """Return the (..., 3) points of the capsule's segment nearest to (..., 3) points, body frame."""
        direction = self.end - self.start
        square = float(direction @ direction)
        if square == 0.0:
            return np.broadcast_to(self.start, np.shape(point))
        along = np.clip((point - self.start) @ direction / square, 0.0, 1.0)
        nearest: np.ndarray = self.start + np.asarray(along)[..., None] * direction
        return nearest

    def distance(self, point: np.ndarray) -> np.ndarray:
        """Return the (...,) signed distances of (..., 3) points to the surface, m; negative inside."""
        distance: np.ndarray = np.linalg.norm(point - self.axis_point(point), axis=-1) - self.radius
        return distance

    def normal(self, point: np.ndarray) -> np.ndarray:
        """Return the (..., 3) unit outward normals at the surface points nearest to (..., 3) points."""
        outward = point - self.axis_point(point)
        unit: np.ndarray = outward / np.maximum(np.linalg.norm(outward, axis=-1, keepdims=True), 1e-300)
        return unit


@dataclass(frozen=True)
class Cylinder:
    """A solid cylinder, placed in the body's frame.

    Attributes:
        placement: (4, 4) body <- cylinder; the cylinder's axis is z through its centre.
        radius, length: m.
    """

    placement: np.ndarray
    radius: float
    length: float


@dataclass(frozen=True)
class Body:
    """One URDF link.

    Attributes:
        name: as in the URDF.
        mass: kg.
        center_of_mass: (3,) m, body frame.
        inertia: (3, 3) kg·m², about the centre of mass, axes of the body frame.
        capsules, cylinders: the collision geometry.
    """

    name: str
    mass: float
    center_of_mass: np.ndarray
    inertia: np.ndarray
    capsules: tuple[Capsule, ...]
    cylinders: tuple[Cylinder, ...]
    solids: tuple[tuple[coal.CollisionGeometry, np.ndarray, np.ndarray], ...] = field(repr=False)

    def nearest(self, point: np.ndarray) -> Capsule:
        """Return the capsule whose surface is nearest to the (3,) point, body frame."""
        return min(self.capsules, key=lambda capsule: abs(float(capsule.distance(point))))

    def surface_distance(self, point: np.ndarray) -> float:
        """Return the signed distance of the (3,) point to the union of the capsules, m."""
        return min(float(capsule.distance(point)) for capsule in self.capsules)

    def normal(self, point: np.ndarray) -> np.ndarray:
        """Return the (3,) unit outward normal of the surface nearest to the (3,) point, body frame."""
        return self.nearest(point).normal(point)

    def project(self, point: np.ndarray) -> np.ndarray:
        """Return the (3,) point of the surface nearest to the (3,) point, body frame."""
        capsule = self.nearest(point)
        return point - float(capsule.distance(point)) * capsule.normal(point)


def read_bodies(path: Path) -> dict[str, Body]:
    """Read every link of a URDF made of spheres and cylinders.

    A cylinder with a sphere of its radius at either end is read as the capsule they form.

    Raises:
        DesignError: the file is missing, is not XML, or holds a shape that is neither sphere nor cylinder.
    """
    try:
        root = ElementTree.parse(path).getroot()
    except FileNotFoundError:
        raise DesignError(f"{path}: missing") from None
    except ElementTree.ParseError as error:
        raise DesignError(f"{path}: not XML: {error}") from None
    return {name: _read_link(path, name, link) for link in root.iter("link") if (name := link.get("name", ""))}


def _numbers(text: str | None, default: str = "0 0 0") -> np.ndarray:
    return np.array([float(word) for word in (text or default).split()])


def _placement(element: ElementTree.Element) -> np.ndarray:
    placement = np.eye(4)
    origin = element.find("origin")
    if origin is not None:
        placement[:3, :3] = Rotation.from_euler("xyz", _numbers(origin.get("rpy"))).as_matrix()
        placement[:3, 3] = _numbers(origin.get("xyz"))
    return placement


def _read_link(path: Path, name: str, link: ElementTree.Element) -> Body:
    spheres: list[Capsule] = []
    cylinders: list[Cylinder] = []
    for collision in link.findall("collision"):
        placement = _placement(collision)
        sphere, cylinder = collision.find("geometry/sphere"), collision.find("geometry/cylinder")
        if sphere is not None:
            spheres.append(Capsule(placement[:3, 3], placement[:3, 3], float(sphere.get("radius", "nan"))))
        elif cylinder is not None:
            cylinders.append(
                Cylinder(placement, float(cylinder.get("radius", "nan")), float(cylinder.get("length", "nan")))
            )
        else:
            raise DesignError(f"{path}: link {name}: its collision geometry is neither sphere nor cylinder")
    capsules, cylinders = _merge(spheres, cylinders)
    mass, center, inertia = _inertial(link)
    return Body(name, mass, center, inertia, tuple(capsules), tuple(cylinders), _solids(capsules, cylinders))


def _inertial(link: ElementTree.Element) -> tuple[float, np.ndarray, np.ndarray]:
    inertial = link.find("inertial")
    if inertial is None:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    placement = _placement(inertial)
    mass, tensor = inertial.find("mass"), inertial.find("inertia")
    entries = (
        {key: float(tensor.get(key, "0")) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
        if (tensor is not None)
        else dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 0.0)
    )
    local = np.array(
        [
            [entries["ixx"], entries["ixy"], entries["ixz"]],
            [entries["ixy"], entries["iyy"], entries["iyz"]],
            [entries["ixz"], entries["iyz"], entries["izz"]],
        ]
    )
    rotation = placement[:3, :3]
    value = float(mass.get("value", "nan")) if mass is not None else 0.0
    return value, placement[:3, 3], rotation @ local @ rotation.T


def _merge(spheres: list[Capsule], cylinders: list[Cylinder]) -> tuple[list[Capsule], list[Cylinder]]:
    """Join each cylinder and its two end spheres into a capsule; keep what does not form one."""
    capsules: list[Capsule] = []
    bare: list[Cylinder] = []
    unused = spheres
    for cylinder in cylinders:
        center, half = cylinder.placement[:3, 3], 0.5 * cylinder.length * cylinder.placement[:3, 2]
        # Capsules that share an end may have a sphere each there, or one for all.
        caps = [
            _sphere_at(unused, center + sign * half, cylinder.radius)
            or _sphere_at(spheres, center + sign * half, cylinder.radius)
            for sign in (-1, 1)
        ]
        if caps[0] is None or caps[1] is None:
            bare.append(cylinder)
            continue
        unused = [sphere for sphere in unused if all(sphere is not cap for cap in caps)]
        capsules.append(Capsule(caps[0].start, caps[1].start, cylinder.radius))
    return capsules + unused, bare


def _sphere_at(spheres: list[Capsule], center: np.ndarray, radius: float) -> Capsule | None:
    near = 1e-6 * radius
    for sphere in spheres:
        if np.linalg.norm(sphere.start - center) < near and abs(sphere.radius - radius) < near:
            return sphere
    return None


def _solids(
    capsules: list[Capsule], cylinders: list[Cylinder]
) -> tuple[tuple[coal.CollisionGeometry, np.ndarray, np.ndarray], ...]:
    """Return coal's shapes with their rotation (3, 3) and position (3,) in the body's frame."""
    solids = []
    for capsule in capsules:
        axis = capsule.end - capsule.start
        length = float(np.linalg.norm(axis))
        if length == 0.0:
            solids.append((coal.Sphere(capsule.radius), np.eye(3), capsule.start))
            continue
        rotation = Rotation.align_vectors([axis / length], [[0.0, 0.0, 1.0]])[0].as_matrix()
        solids.append((coal.Capsule(capsule.radius, length), rotation, 0.5 * (capsule.start + capsule.end)))
    for cylinder in cylinders:
        shape = coal.Cylinder(cylinder.radius, cylinder.length)
        solids.append((shape, cylinder.placement[:3, :3], cylinder.placement[:3, 3]))
    return tuple(solids)


def ground_body(height: float) -> Body:
    """Return the half-space below the world's z = ``height`` (m) as a body that rests in the world's frame."""
    solid = coal.Halfspace(np.array([0.0, 0.0, 1.0]), height)
    return Body("ground", 0.0, np.zeros(3), np.zeros((3, 3)), (), (), ((solid, np.eye(3), np.zeros(3)),))


_REQUEST = coal.DistanceRequest()
_REQUEST.enable_signed_distance = True


def body_distance(
    first: Body, first_placed: tuple[np.ndarray, np.ndarray], second: Body, second_placed: tuple[np.ndarray, np.ndarray]
) -> float:
    """Return the signed distance of two placed bodies by coal, m; negative is the depth of their overlap.

    Args:
        first: one body.
        first_placed: rotation (3, 3) and position (3,) of its frame in the world.
        second: the other.
        second_placed: likewise.
    """
    nearest = np.inf
    for one, one_rotation, one_position in first.solids:
        one_transform = _transform(first_placed, one_rotation, one_position)
        for other, other_rotation, other_position in second.solids:
            other_transform = _transform(second_placed, other_rotation, other_position)
            result = coal.DistanceResult()
            nearest = min(nearest, coal.distance(one, one_transform, other, other_transform, _REQUEST, result))
    return nearest


def _transform(placed: tuple[np.ndarray, np.ndarray], rotation: np.ndarray, position: np.ndarray) -> coal.Transform3s:
    return coal.Transform3s(placed[0] @ rotation, placed[0] @ position + placed[1])
