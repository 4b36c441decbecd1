"""Bodies as the URDF states them: mass properties and solid shapes, and the distance of two."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np

from casadi_hands.verify.flat import Box, Convex
from casadi_hands.verify.raw_mesh import RawMesh
from casadi_hands.verify.shapes import Capsule, Cylinder, HalfSpace, Shape

_REQUEST = coal.DistanceRequest()
_REQUEST.enable_signed_distance = True


@dataclass(frozen=True, eq=False)
class Body:
    """One URDF link, or the ground.

    Attributes:
        name: as in the URDF.
        mass: kg.
        center_of_mass: (3,) m, body frame.
        inertia: (3, 3) kg·m², about the centre of mass, axes of the body frame.
        shapes: the collision geometry, whose union is the body.
        cases: of servos that it holds, which are seen and do not collide: they are in the links that they turn.
        raw: meshes that it looks like where convex shapes collide in their place.
        unseen: the shapes that do.
    """

    name: str
    mass: float
    center_of_mass: np.ndarray
    inertia: np.ndarray
    shapes: tuple[Shape, ...]
    cases: tuple[Box, ...] = ()
    raw: tuple[RawMesh, ...] = ()
    unseen: tuple[Convex, ...] = ()

    @property
    def seen(self) -> tuple[Shape, ...]:
        """Those of its shapes that it looks like."""
        return tuple(shape for shape in self.shapes if not any(shape is other for other in self.unseen))

    @property
    def capsules(self) -> tuple[Capsule, ...]:
        """Those of its shapes that are capsules or spheres, as all of a finger are."""
        return tuple(shape for shape in self.shapes if isinstance(shape, Capsule))

    @cached_property
    def solids(self) -> tuple[tuple[coal.CollisionGeometry, np.ndarray, np.ndarray], ...]:
        """Coal's shapes with their rotation (3, 3) and position (3,) in the body's frame."""
        return tuple((shape.coal(), *shape.pose) for shape in self.shapes)

    def nearest(self, point: np.ndarray) -> Shape:
        """Return the shape whose surface is nearest to the (3,) point, body frame."""
        return min(self.shapes, key=lambda shape: abs(float(shape.distance(point))))

    def surface_distance(self, point: np.ndarray) -> float:
        """Return the signed distance of the (3,) point to the union of the shapes, m."""
        return min(float(shape.distance(point)) for shape in self.shapes)

    def normal(self, point: np.ndarray) -> np.ndarray:
        """Return the (3,) unit outward normal of the surface nearest to the (3,) point, body frame."""
        return self.nearest(point).normal(point)

    def project(self, point: np.ndarray) -> np.ndarray:
        """Return the (3,) point of the surface nearest to the (3,) point, body frame."""
        shape = self.nearest(point)
        return point - float(shape.distance(point)) * shape.normal(point)


def ground_body(height: float) -> Body:
    """Return the half-space below the world's z = ``height`` (m) as a body that rests in the world's frame."""
    return Body("ground", 0.0, np.zeros(3), np.zeros((3, 3)), (HalfSpace(height),))


def joined(spheres: list[Capsule], cylinders: list[Cylinder]) -> tuple[Shape, ...]:
    """Return capsules, joined of each cylinder and its two end spheres, and what does not form one."""
    capsules: list[Capsule] = []
    bare: list[Cylinder] = []
    unused = spheres
    for cylinder in cylinders:
        # Capsules that share an end may have a sphere each there, or one for all.
        caps = [
            _sphere_at(unused, end, cylinder.radius) or _sphere_at(spheres, end, cylinder.radius)
            for end in (cylinder.start, cylinder.end)
        ]
        if caps[0] is None or caps[1] is None:
            bare.append(cylinder)
            continue
        unused = [sphere for sphere in unused if all(sphere is not cap for cap in caps)]
        capsules.append(Capsule(caps[0].start, caps[1].start, cylinder.radius))
    return (*capsules, *unused, *bare)


def _sphere_at(spheres: list[Capsule], center: np.ndarray, radius: float) -> Capsule | None:
    near = 1e-6 * radius
    for sphere in spheres:
        if np.linalg.norm(sphere.start - center) < near and abs(sphere.radius - radius) < near:
            return sphere
    return None


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
