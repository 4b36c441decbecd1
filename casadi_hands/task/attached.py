"""The joint that holds an object to the world."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydantic import Field, field_validator, model_validator

from casadi_hands.motion.quaternion import quaternion
from casadi_hands.task.fields import NonNegative, Number, Section, Vector, refuse
from casadi_hands.task.rotation import Rotation, rotation_matrix

_POINT = "A point of the axis, m, object frame."
_AXIS = "Direction of the axis, object frame; any length but 0. Coordinates grow with {}."
_DAMPING = "Against the speed of the motion, {}."


class Joint(Section):
    """What all joints have: an axis that is the same in the object and, since it does not move, in the world.

    The coordinate q is 0 at the first goal: an angle (rad) about the axis, of a slider a distance (m) along it. The
    object has one freedom; the world bears all of a wrench but what does work along it. Resistance along it, N·m or N:
    friction against the motion, stiffness × q, damping × speed.
    """

    turns: ClassVar[bool] = True
    axis: Vector = Field(description="Its direction.")
    stiffness: NonNegative = Field(default=0.0, description="Of its spring.")
    damping: NonNegative = Field(default=0.0, description="Of its damper.")

    @field_validator("axis")
    @classmethod
    def _some_way(cls, value: Vector) -> Vector:
        if not any(value):
            raise refuse("an axis with at least one number other than 0")
        return value

    @property
    def direction(self) -> np.ndarray:
        """Unit axis (3,), object frame."""
        axis = np.array(self.axis)
        direction: np.ndarray = axis / np.linalg.norm(axis)
        return direction

    @property
    def pivot(self) -> np.ndarray:
        """A point of the axis (3,), m, object frame."""
        return np.array(getattr(self, "point", (0.0, 0.0, 0.0)))

    @property
    def advance(self) -> float:
        """How far the object goes along the axis as the coordinate grows: m/rad, of a slider 1."""
        return 0.0

    @property
    def friction(self) -> float:
        """Largest friction along the coordinate, N·m or N."""
        return float(getattr(self, "friction_torque" if self.turns else "friction_force"))

    def moved(self, by: np.ndarray) -> Joint:
        """The same joint seen from a frame whose origin is at ``-by`` (3,), m, of this one."""
        if "point" not in type(self).model_fields:
            return self
        x, y, z = (self.pivot + by).tolist()
        return self.model_copy(update={"point": (x, y, z)})

    def displaced(self, position: np.ndarray, rotation: Rotation, coordinate: float) -> tuple[np.ndarray, Rotation]:
        """Where the object is at a coordinate.

        Args:
            position: (3,) m, world, of the object frame where the coordinate is 0.
            rotation: of the object there.
            coordinate: rad or m.

        Returns:
            (3,) m, world, and the orientation.
        """
        axis = rotation.matrix @ self.direction
        along = self.advance * coordinate * axis
        if not self.turns:
            return position + along, rotation
        turn = rotation_matrix(coordinate * axis)
        centre = position + rotation.matrix @ self.pivot
        return centre + turn @ (position - centre) + along, _turned(rotation, axis, coordinate)


def _turned(rotation: Rotation, axis: np.ndarray, angle: float) -> Rotation:
    """A rotation turned further about an axis (3,), world, by an angle, rad; turns about one axis add up."""
    start = rotation.vector
    if np.linalg.norm(np.cross(start, axis)) < 1e-9:
        x, y, z = axis.tolist()
        return Rotation(axis=(x, y, z), degrees=float(np.degrees(angle + start @ axis)))
    matrix = rotation_matrix(angle * axis) @ rotation.matrix
    return Rotation.model_validate({"quaternion": quaternion(matrix).tolist()})


class Hinge(Joint):
    """A joint that lets the object turn about an axis."""

    point: Vector = Field(description=_POINT)
    axis: Vector = Field(description=_AXIS.format("turns about it by the right hand"))
    friction_torque: NonNegative = Field(default=0.0, description="Dry friction, N·m, against the turn.")
    stiffness: NonNegative = Field(default=0.0, description="Of a spring that rests at the first goal, N·m/rad.")
    damping: NonNegative = Field(default=0.0, description=_DAMPING.format("N·m·s/rad"))


class Slider(Joint):
    """A joint that lets the object slide along an axis."""

    turns: ClassVar[bool] = False
    axis: Vector = Field(description=_AXIS.format("distance along it"))
    friction_force: NonNegative = Field(default=0.0, description="Dry friction, N, against the motion.")
    stiffness: NonNegative = Field(default=0.0, description="Of a spring that rests at the first goal, N/m.")
    damping: NonNegative = Field(default=0.0, description=_DAMPING.format("N·s/m"))

    @property
    def advance(self) -> float:
        """Along itself."""
        return 1.0


class Screw(Hinge):
    """A thread: the object turns about an axis and goes along it with the turn."""

    pitch: Number = Field(description="How far it goes along the axis in one turn, m; negative of a left-handed one.")

    @property
    def advance(self) -> float:
        """Pitch over a turn, m/rad."""
        return self.pitch / (2 * np.pi)


class Attached(Section):
    """What holds the object to the world: one joint, `hinge`, `slider` or `screw`."""

    hinge: Hinge | None = Field(default=None, description="A hinge: a valve, a knob, a switch, a door.")
    slider: Slider | None = Field(default=None, description="A slider: a drawer, a button, a plunger.")
    screw: Screw | None = Field(default=None, description="A thread: a lid on its jar, a bolt in its nut.")

    @model_validator(mode="before")
    @classmethod
    def _one(cls, value: Any) -> Any:
        if isinstance(value, dict) and sum(value.get(name) is not None for name in cls.model_fields) != 1:
            raise refuse("one joint: hinge, slider or screw")
        return value

    @property
    def kind(self) -> str:
        """``hinge``, ``slider`` or ``screw``."""
        return next(name for name in type(self).model_fields if getattr(self, name) is not None)

    @property
    def joint(self) -> Joint:
        """The one there is."""
        joint: Joint = getattr(self, self.kind)
        return joint

    def moved(self, by: np.ndarray) -> Attached:
        """The same in a shifted frame, as `Joint.moved`."""
        return self.model_copy(update={self.kind: self.joint.moved(by)})
