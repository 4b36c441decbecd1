"""A mesh among the shapes of an object: read, mended and cut into convex parts when the task file is loaded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, PrivateAttr, ValidationInfo, model_validator
from pydantic_core import PydanticCustomError

from casadi_hands.errors import MeshError
from casadi_hands.geometry.hull import mass_moments
from casadi_hands.meshes import Decomposition, convex_parts, mend, read_mesh, scaled, told
from casadi_hands.task.fields import NonNegative, Positive, Section, Whole

MOST_PARTS = 64
FOLDER, WITHIN = "folder", "within"
"""Of the context that a task is validated in: where relative paths start, and whether all files must be below it."""


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
    _found: Decomposition = PrivateAttr()
    _solid: Uniform = PrivateAttr()
    _notes: tuple[str, ...] = PrivateAttr()

    @model_validator(mode="after")
    def _read(self, info: ValidationInfo) -> Self:
        try:
            mesh, self._notes = mend(scaled(read_mesh(_place(self.file, info.context or {})), self.scale))
            self._found = convex_parts(mesh, self.parts)
        except MeshError as error:
            raise PydanticCustomError(
                "refused", "{allowed}", {"allowed": error.allowed, "given": error.given}
            ) from None
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

    @property
    def record(self) -> MeshRecord:
        """What has become of it."""
        found = self._found
        return MeshRecord(
            file=Path(self.file).name,
            parts=len(found.parts),
            leaves_out=found.missing,
            adds=found.added,
            mended=self._notes,
        )


class MeshRecord(Section):
    """A mesh of which some of the convex shapes were made; the program writes this."""

    file: str = Field(description="The name of its file.")
    parts: Whole = Field(description="Convex shapes that stand for it.")
    leaves_out: NonNegative = Field(description="The most by which it stands out of their union, m; sampled.")
    adds: NonNegative = Field(description="The most by which their union stands out of it, m; sampled.")
    mended: tuple[str, ...] = Field(default=(), description="What was done to it before.")

    @property
    def sentence(self) -> str:
        """What has become of it, lengths in mm."""
        return "; ".join([*self.mended, told(self.parts, self.leaves_out, self.adds)])


def _place(file: str, context: Mapping[str, Any]) -> Path:
    """Where a file is that a task names.

    Raises:
        MeshError: outside of the folder, where a task must keep to it.
    """
    folder = Path(context.get(FOLDER) or ".")
    path = folder / file
    if context.get(WITHIN):
        try:
            within = path.resolve().is_relative_to(folder.resolve())
        except (OSError, RuntimeError, ValueError):
            within = False
        if not within:
            raise MeshError(f"{file!r}", "a file in the task's own folder: a result folder holds all that it needs")
    return path
