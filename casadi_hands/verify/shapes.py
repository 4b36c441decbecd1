"""Bodies as the URDF states them: mass properties and solid shapes, with distances by closed form and by coal."""

from __future__ import annotations

from dataclasses import dataclass, field

import coal
import numpy as np
from scipy.spatial.transform import Rotation


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


def merge(spheres: list[Capsule], cylinders: list[Cylinder]) -> tuple[list[Capsule], list[Cylinder]]:
    """Return capsules, joined of each cylinder and its two end spheres, and what does not form one."""
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


def solids(
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


def is_capsule(capsule: Capsule, start: np.ndarray, end: np.ndarray, radius: float) -> bool:
    """Whether a capsule has these ends, either way around, and this radius, to a millionth of its size."""
    near = 1e-6 * max(radius, float(np.linalg.norm(end - start)))
    straight = np.linalg.norm(capsule.start - start) + np.linalg.norm(capsule.end - end)
    turned = np.linalg.norm(capsule.start - end) + np.linalg.norm(capsule.end - start)
    return bool(min(straight, turned) < near and abs(capsule.radius - radius) < near)


def swept_inertial(
    slices: list[tuple[float, float, float, float]], middle: float, density: float
) -> tuple[float, np.ndarray]:
    """Return mass (kg) and inertia (3, 3) about ``z = middle`` of a solid of revolution about z.

    Args:
        slices: from z to z, m, and the radius at either end, m: equal for a cylinder, one zero for half a ball.
        middle: m.
        density: kg/m³.
    """
    nodes, shares = np.polynomial.legendre.leggauss(5)
    mass = along = across = 0.0
    for low, high, first, last in slices:
        z, weight = 0.5 * (low + high) + 0.5 * (high - low) * nodes, 0.5 * (high - low) * shares
        flat = high if first < last else low
        square = np.full_like(z, first**2) if first == last else max(first, last) ** 2 - (z - flat) ** 2
        disc = np.pi * density * square * weight
        mass += float(disc.sum())
        along += float((disc * square / 2).sum())
        across += float((disc * (square / 4 + (z - middle) ** 2)).sum())
    return mass, np.diag([across, across, along])


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
