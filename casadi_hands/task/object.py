"""The object that the hand moves."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from pydantic import Field, ValidationError, field_validator, model_validator

from casadi_hands.geometry.bodies.body import farthest
from casadi_hands.task.attached import Attached
from casadi_hands.task.fields import Matrix, Positive, Section, Vector, follows, refuse, vector
from casadi_hands.task.mesh import Mesh, MeshRecord, Uniform
from casadi_hands.task.shapes import SECTIONS, Primitive, Shape, parts_of, spelled

_KINDS = ", ".join(f"`{name}: {spelled(each)}`" for name, each in SECTIONS.items())


def _solids(shapes: tuple[Primitive, ...]) -> tuple[np.ndarray, list[Uniform]]:
    """What the object is made of, and the shares (N,) of each in its volume."""
    solids = [solid for shape in shapes for solid in shape.uniform]
    volumes = np.array([solid.volume for solid in solids])
    return volumes / volumes.sum(), solids


def _uniform_center(data: dict[str, Any]) -> Vector:
    shares, solids = _solids(data["shapes"])
    return vector(shares @ np.array([solid.centroid for solid in solids]))


def _uniform_inertia(data: dict[str, Any]) -> Matrix:
    center, inertia = np.array(_uniform_center(data)), np.zeros((3, 3))
    for share, solid in zip(*_solids(data["shapes"]), strict=True):
        arm = solid.centroid - center
        inertia += share * (solid.unit_inertia + (arm @ arm) * np.eye(3) - np.outer(arm, arm))
    x, y, z = data["mass"] * inertia
    return vector(x), vector(y), vector(z)


def _records(data: dict[str, Any]) -> tuple[MeshRecord, ...] | None:
    found = [(first, mesh) for first, shape in enumerate(data["shapes"]) if (mesh := shape.begins) is not None]
    return tuple(mesh.record(number, first) for number, (first, mesh) in enumerate(found)) or None


class ManipulatedObject(Section):
    """The object: primitives, mass, and where its frame lies.

    A task file may put the object frame anywhere; a loaded task has its origin at the centre of mass.
    """

    mass: Positive = Field(description="Mass, kg.")
    shapes: tuple[Shape, ...] = Field(
        min_length=1,
        description=f"The primitives whose union is the object: a list of {_KINDS}.",
    )
    center_of_mass: Vector = Field(
        default_factory=follows(_uniform_center),
        description="Centre of mass, m, object frame. After loading it is the frame's origin: everything given in "
        "the object frame, and the goals, are shifted to it.",
        json_schema_extra={"default": "that of the primitives, each solid and of one density; overlaps count twice"},
    )
    inertia: Matrix = Field(
        default_factory=follows(_uniform_inertia),
        description="Inertia about the centre of mass, 3 rows of 3, kg·m², axes of the object frame.",
        json_schema_extra={"default": "that of the primitives about their own centre; overlaps count twice"},
    )
    attached: Attached | None = Field(
        default=None, description="The joint that holds the object to the world; without it the object is free."
    )

    meshes: tuple[MeshRecord, ...] | None = Field(
        default_factory=follows(_records),
        description="Meshes of which some of the convex shapes were made; the program writes them.",
        json_schema_extra={"default": "those among the shapes"},
    )

    @field_validator("shapes")
    @classmethod
    def _cut(cls, shapes: tuple[Any, ...]) -> tuple[Primitive, ...]:
        try:
            parts = [parts_of(shape) if isinstance(shape, Mesh) else (shape,) for shape in shapes]
        except ValidationError:
            raise refuse("for each mesh an edge_radius smaller than half the least width of its parts") from None
        return tuple(part for those in parts for part in those)

    @model_validator(mode="after")
    def _settled(self) -> Self:
        for shape in self.shapes:
            shape.on_its_own()
        return self

    @field_validator("inertia")
    @classmethod
    def _physical(cls, inertia: Matrix) -> Matrix:
        matrix = np.array(inertia)
        if not np.allclose(matrix, matrix.T, rtol=0, atol=1e-9 * abs(matrix).max()):
            raise refuse("a symmetric matrix")
        principal = np.linalg.eigvalsh(matrix)
        if principal[0] <= 0:
            raise refuse("a positive definite matrix: every principal moment above 0")
        # A rod without thickness meets this with equality; leave room for rounding.
        if principal[2] > (principal[0] + principal[1]) * (1 + 1e-9):
            raise refuse("principal moments of which none exceeds the sum of the other two, as no solid body has them")
        return inertia

    @property
    def characteristic_length(self) -> float:
        """Half the largest extent of the bounding box in the object frame, m: the unit of length inside."""
        lower, upper = self.bounding_box
        return float((upper - lower).max() / 2)

    @property
    def bounding_box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner of the box around the primitives, (3,) and (3,), m, object frame."""
        lower, upper = (np.array(corners) for corners in zip(*[s.bounding_box for s in self.shapes], strict=True))
        return lower.min(axis=0), upper.max(axis=0)

    @property
    def extremes(self) -> list[np.ndarray]:
        """Points (3,) of the surface, m, object frame, that are farthest along its axes, either way, shape by shape."""
        ways = [sign * axis for axis in np.eye(3) for sign in (1, -1)]
        return [s.body.support(way)[0] + s.body.ball * way for s in self.shapes for way in ways]

    def lowest_point(self, rotation: np.ndarray) -> np.ndarray:
        """Point of the surface that is lowest with the object turned by ``rotation``.

        Args:
            rotation: (3, 3) world <- object.

        Returns:
            (3,) m, object frame; the middle of the lowest line or face when one lies level.
        """
        down = rotation.T @ np.array([0.0, 0.0, -1.0])
        points = np.vstack([s.body.support(down) + s.body.ball * down for s in self.shapes])
        middle: np.ndarray = farthest(points, down, self.characteristic_length).mean(axis=0)
        return middle
