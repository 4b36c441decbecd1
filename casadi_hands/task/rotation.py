"""Rotations as a task file writes them."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import Field, model_validator

from casadi_hands.task.fields import Number, Quadruple, Section, Vector, refuse

LARGEST_TURN = 300.0
"""Degrees from the first goal's orientation: the exponential map is singular at 360°, and this is near enough."""
WIDEST_TURN = 720.0
"""Degrees between goals that all turn about one axis: 360 to either side of the middle."""


class _Quaternion(Section):
    quaternion: Quadruple = Field(description="[w, x, y, z], object to world; scaled to unit length.")


class Rotation(Section):
    """A turn about an axis: `{axis, degrees}`, or `{quaternion: [w, x, y, z]}`, which is stored as the former.

    The angle is kept as given: 180 and -180 degrees are the same orientation reached by different turns.
    """

    axis: Vector = Field(description="Axis of the turn, world frame; any length but 0.")
    degrees: Number = Field(description="Angle of the turn, degrees; may exceed 180 to say which way round.")

    @classmethod
    def file_names(cls) -> list[str]:
        """Names that a task file may use in this section."""
        return [*super().file_names(), "quaternion"]

    @model_validator(mode="before")
    @classmethod
    def _from_quaternion(cls, value: Any) -> Any:
        if not isinstance(value, dict) or "quaternion" not in value:
            return value
        if len(value) > 1:
            raise refuse("either {axis, degrees} or {quaternion: [w, x, y, z]}, not both")
        w, *xyz = _Quaternion.model_validate(value).quaternion
        length = float(np.linalg.norm(xyz))
        if length == 0 and w == 0:
            raise refuse("a quaternion [w, x, y, z] other than 0")
        if length == 0:
            return {"axis": (0.0, 0.0, 1.0), "degrees": 0.0}
        sign = 1.0 if w >= 0 else -1.0
        return {"axis": tuple(sign * x for x in xyz), "degrees": float(np.degrees(2 * np.arctan2(length, abs(w))))}

    @model_validator(mode="after")
    def _has_axis(self) -> Rotation:
        if not any(self.axis):
            raise refuse("an axis with at least one number other than 0")
        return self

    @property
    def vector(self) -> np.ndarray:
        """Rotation vector, (3,), rad: unit axis times angle, the angle not reduced."""
        axis = np.array(self.axis)
        vector: np.ndarray = np.radians(self.degrees) * axis / np.linalg.norm(axis)
        return vector

    @property
    def matrix(self) -> np.ndarray:
        """(3, 3) world <- object."""
        return rotation_matrix(self.vector)


UPRIGHT = Rotation(axis=(0.0, 0.0, 1.0), degrees=0.0)


def rotation_matrix(vector: np.ndarray) -> np.ndarray:
    """Rotation matrix (3, 3) of a rotation vector (3,), rad, by Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix: np.ndarray = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return matrix


def middle_turn(turns: np.ndarray) -> np.ndarray:
    """The middle (3,), rad, of turns (G, 3) about one axis, where any is larger than ``LARGEST_TURN``; else zeros."""
    far = turns[np.argmax(np.linalg.norm(turns, axis=1))]
    size = float(np.linalg.norm(far))
    if size <= np.radians(LARGEST_TURN) * (1 + 1e-6):
        return np.zeros(3)
    along = turns @ far / size
    if np.linalg.norm(turns - np.outer(along, far / size), axis=1).max() > 1e-6:
        return np.zeros(3)
    middle: np.ndarray = (along.min() + along.max()) / 2 * far / size
    return middle
