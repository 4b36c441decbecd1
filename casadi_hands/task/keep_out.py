"""Boxes of the world that the palm keeps off."""

from __future__ import annotations

import coal
import numpy as np
from pydantic import Field

from casadi_hands.task.fields import Positive, Section, Vector
from casadi_hands.task.rotation import UPRIGHT, Rotation


class KeepOutBox(Section):
    """A box in the world."""

    center: Vector = Field(description="Middle, m, world.")
    size: tuple[Positive, Positive, Positive] = Field(
        description="Lengths of the sides along x, y and z before it is turned, m."
    )
    rotation: Rotation = Field(
        default=UPRIGHT,
        description="How it is turned about its middle, in the world.",
        json_schema_extra={"default": "not turned"},
    )


class KeepOut(Section):
    """Something that the palm keeps off: a shelf, a robot's arm, a camera."""

    box: KeepOutBox = Field(description="The box.")
    name: str | None = Field(default=None, min_length=1, description="What messages call it.")

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Signed distances (...) of points (..., 3), m, world, from the box, negative inside."""
        box = self.box
        local = np.abs((points - np.array(box.center)) @ box.rotation.matrix) - np.array(box.size) / 2
        outside = np.linalg.norm(np.maximum(local, 0), axis=-1)
        return np.asarray(outside + np.minimum(local.max(axis=-1), 0))

    def distance_from_palm(self, position: np.ndarray, rotation: np.ndarray, radius: float, thickness: float) -> float:
        """Distance of the box from a palm's disc, m; at most 0 where they meet.

        Args:
            position: (3,) of the palm's frame, m, world.
            rotation: (3, 3) world <- palm.
            radius: of the disc, m.
            thickness: of it, behind its face, m.
        """
        box = self.box
        middle = position - thickness / 2 * rotation[:, 2]
        return float(
            coal.distance(
                coal.Cylinder(radius, thickness),
                coal.Transform3s(rotation, middle),
                coal.Box(*box.size),
                coal.Transform3s(box.rotation.matrix, np.array(box.center)),
                coal.DistanceRequest(),
                coal.DistanceResult(),
            )
        )

    def __str__(self) -> str:
        """The box in words."""
        return self.name or f"the box at {list(self.box.center)} m"
