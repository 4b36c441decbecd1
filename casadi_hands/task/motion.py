"""What the object shall do, and what disturbs it."""

from __future__ import annotations

from typing import Any

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from casadi_hands.task.fields import NonNegative, Number, Section, Vector, refuse
from casadi_hands.task.rotation import UPRIGHT, Rotation


class Exert(Section):
    """A force and a torque that the object exerts on the world: what the world answers with acts on the object."""

    force: Vector = Field(default=(0.0, 0.0, 0.0), description="Force at the centre of mass, N, world.")
    torque: Vector = Field(default=(0.0, 0.0, 0.0), description="Torque, N·m, world.")

    @model_validator(mode="after")
    def _acts(self) -> Exert:
        if not any(self.force) and not any(self.torque):
            raise refuse("a force or a torque other than 0")
        return self


class Goal(Section):
    """A pose the object passes through, or, when drawing, a point its tool passes through."""

    at: NonNegative = Field(description="Time, s; the first goal is at 0, each later than the one before.")
    position: Vector | None = Field(default=None, description="Origin of the object frame, m, world.")
    rotation: Rotation = Field(
        default=UPRIGHT,
        description="Orientation of the object: `{axis: [x, y, z], degrees: a}` or `{quaternion: [w, x, y, z]}`.",
        json_schema_extra={"default": "upright: object and world axes agree"},
    )
    tool_at: Vector | None = Field(
        default=None, description="Where the object's `tool` must be, m, world; instead of position and rotation."
    )
    angle: Number | None = Field(
        default=None,
        description="How far the joint of an `attached` object is turned from the first goal, degrees; instead of "
        "position and rotation.",
    )
    distance: Number | None = Field(
        default=None,
        description="How far an object on a slider is from the first goal, m; instead of position and rotation.",
    )
    exert: Exert | None = Field(
        default=None,
        description="What the object must exert on the world on its way to this goal, all the time from the goal "
        "before; it grows from and falls to nothing within a time step before and after. Not of the first goal.",
    )

    @property
    def on_joint(self) -> bool:
        """Whether it says where the joint of an attached object is, and the pose follows from that."""
        return self.angle is not None or self.distance is not None

    @model_validator(mode="after")
    def _one_kind(self) -> Goal:
        posed = self.position is not None or self.rotation != UPRIGHT
        if self.angle is not None and self.distance is not None:
            raise refuse("either angle or distance; not both")
        if self.on_joint and (posed or self.tool_at is not None):
            raise refuse("an angle or a distance alone: position and rotation follow from the joint")
        if self.tool_at is None and self.position is None and not self.on_joint:
            raise refuse("a position, or tool_at in a drawing task")
        if self.tool_at is not None and posed:
            raise refuse("either position and rotation, or tool_at; not both")
        return self

    @model_serializer(mode="wrap")
    def _of_its_kind(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        skipped = {"tool_at"} if self.tool_at is None else {"position", "rotation"}
        skipped |= {name for name in ("angle", "distance", "exert") if getattr(self, name) is None}
        if self.on_joint:
            skipped |= {"position", "rotation"}
        return {name: value for name, value in handler(self).items() if name not in skipped}


class Perturbation(Section):
    """A force and a torque on the object for some time, on top of gravity.

    The hand is designed to do the task both with and without it.
    """

    start: NonNegative = Field(alias="from", description="Begin, s.")
    end: NonNegative = Field(alias="to", description="End, s.")
    force: Vector = Field(default=(0.0, 0.0, 0.0), description="Force at the centre of mass, N, world.")
    torque: Vector = Field(default=(0.0, 0.0, 0.0), description="Torque, N·m, world.")

    @model_validator(mode="after")
    def _acts(self) -> Perturbation:
        if self.end <= self.start:
            raise refuse("a time `from` before the time `to`")
        if not any(self.force) and not any(self.torque):
            raise refuse("a force or a torque other than 0")
        return self
