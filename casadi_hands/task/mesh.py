"""A mesh among the shapes of an object: read, mended and cut into convex parts when the task file is loaded."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from casadi_hands.errors import MeshError
from casadi_hands.geometry.hull import mass_moments
from casadi_hands.meshes import Decomposition, convex_parts, mend, read_mesh, scaled, told
from casadi_hands.task.fields import NonNegative, Positive, Section, Whole, refuse
from casadi_hands.task.raw_mesh import FOLDER, WITHIN, RawMesh, place, raw_path, read_raw

__all__ = ["FOLDER", "WITHIN", "Mesh", "MeshRecord", "Uniform"]
MOST_PARTS = 64


@dataclass(frozen=True)
class Uniform:
    """A solid of one density.

    Attributes:
        volume: m³.
        centroid: (3,) m, object frame.
        unit_inertia: (3, 3) about it, of a mass of one, m².
    """

    volume: float
    centroid: np.ndarray
    unit_inertia: np.ndarray


class Mesh(Section):
    """A solid bounded by triangles of a file. A loaded task has its convex parts in its place.

    Small defects are mended; `check` tells how, how many parts there are, and how far they are from the mesh.
    """

    file: str = Field(
        min_length=1, description="An STL or OBJ file: its path from the task file's folder, or an absolute one."
    )
    scale: Positive = Field(default=1.0, description="Metres to the file's unit: 0.001 for a file in millimetres.")
    parts: Annotated[Whole, Field(ge=1, le=MOST_PARTS)] = Field(
        default=16,
        description=f"Convex parts that it may be cut into, 1 to {MOST_PARTS}; more are nearer to it, and slower.",
    )
    edge_radius: Positive | None = Field(
        default=None,
        description="That of each part, as of `convex`.",
        json_schema_extra={"default": "that of `convex`"},
    )
    name: str | None = Field(default=None, min_length=1, description="What regions of contacts call all of it.")
    _raw: RawMesh = PrivateAttr()
    _found: Decomposition = PrivateAttr()
    _solid: Uniform = PrivateAttr()
    _notes: tuple[str, ...] = PrivateAttr()

    @model_validator(mode="after")
    def _read(self, info: ValidationInfo) -> Self:
        try:
            mesh, self._notes = mend(scaled(read_mesh(place(self.file, info.context or {})), self.scale))
            self._found = convex_parts(mesh, self.parts)
        except MeshError as error:
            raise refuse(error.allowed, error.given) from None
        self._raw = RawMesh(mesh.vertices, mesh.faces)
        self._solid = Uniform(*mass_moments(mesh.corners))
        return self

    @property
    def vertices(self) -> tuple[np.ndarray, ...]:
        """Vertices (V, 3) of each convex part, m, object frame."""
        return tuple(part.vertices for part in self._found.parts)

    @property
    def solid(self) -> Uniform:
        """What the mesh encloses."""
        return self._solid

    def record(self, number: int, first: int) -> MeshRecord:
        """What has become of it.

        Args:
            number: of the mesh among the object's meshes.
            first: number of its first part among the object's shapes.
        """
        found = self._found
        record = MeshRecord(
            file=Path(self.file).name,
            parts=len(found.parts),
            leaves_out=found.missing,
            adds=found.added,
            mended=self._notes,
            first=first,
            raw=raw_path(number),
        )
        record._raw = self._raw
        return record


class MeshRecord(Section):
    """A mesh of which some of the convex shapes were made; the program writes this."""

    file: str = Field(description="The name of its file.")
    parts: Whole = Field(description="Convex shapes that stand for it.")
    leaves_out: NonNegative = Field(description="The most by which it stands out of their union, m; sampled.")
    adds: NonNegative = Field(description="The most by which their union stands out of it, m; sampled.")
    mended: tuple[str, ...] = Field(default=(), description="What was done to it before.")
    first: Whole | None = Field(default=None, description="The number, from 0, of the first of these shapes.")
    raw: str | None = Field(
        default=None,
        max_length=200,
        description="The OBJ file, beside the task's, of the mesh before it was cut; m, object frame.",
    )
    _raw: RawMesh | None = PrivateAttr(None)

    @model_validator(mode="after")
    def _read(self, info: ValidationInfo) -> Self:
        if self.raw is not None:
            try:
                self._raw = read_raw(self.raw, info.context or {})
            except MeshError as error:
                raise refuse(error.allowed, error.given) from None
        return self

    @property
    def raw_mesh(self) -> RawMesh | None:
        """The mesh before it was cut, m, object frame; None where its file is not known."""
        return self._raw

    def moved(self, by: np.ndarray) -> MeshRecord:
        """The same with the mesh shifted by ``by`` (3,), m."""
        moved = self.model_copy()
        moved._raw = self._raw and self._raw.moved(by)
        return moved

    @property
    def sentence(self) -> str:
        """What has become of it, lengths in mm."""
        return "; ".join([*self.mended, told(self.parts, self.leaves_out, self.adds)])
