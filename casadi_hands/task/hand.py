"""The hand's limits, its contacts with the object, and the object's with the ground."""

from __future__ import annotations

from pydantic import Field, field_validator

from casadi_hands.task.fields import NonNegative, Number, Pair, Positive, Section, Vector, refuse


class FingerSpec(Section):
    """A finger, known by its contact with the object."""

    touches: Vector = Field(
        description="Where the fingertip touches at the start, m, object frame; moved onto the nearest surface."
    )


class Ground(Section):
    """A level floor."""

    height: Number = Field(default=0.0, description="Height, m, world z.")
    friction: Positive = Field(
        description="Coulomb friction of object and ground.", json_schema_extra={"default": "as `friction`"}
    )
    touches: Vector = Field(
        description="Where the object may rest on the ground, m, object frame; moved onto the nearest surface.",
        json_schema_extra={"default": "the object's lowest point at the first goal"},
    )


class HandSpec(Section):
    """What fingers can be built."""

    link_radius: Positive = Field(
        description="Radius of every link, m.", json_schema_extra={"default": "0.13 × palm.radius"}
    )
    link_length: Pair = Field(
        description="Shortest and longest link, m.",
        json_schema_extra={
            "default": "[2 × link_radius, palm.radius + the farthest contact from the palm's centre over the goals]"
        },
    )
    joint_limits: Pair = Field(default=(-90.0, 90.0), description="Lower and upper limit of every joint, degrees.")
    density: Positive = Field(default=1150.0, description="Density of links and palm, kg/m³.")
    contact_force: Positive | None = Field(
        default=None,
        description="Largest component of a contact force along an axis of the object frame, over the object's weight.",
        json_schema_extra={"default": "20, or where the task's loads need more, 4 times their least"},
    )
    clearance: NonNegative = Field(
        description="Distance that bodies which do not touch keep from each other, m.",
        json_schema_extra={"default": "0.02 × object's characteristic length"},
    )

    @field_validator("link_length")
    @classmethod
    def _lengths_in_order(cls, value: Pair) -> Pair:
        if not 0 < value[0] <= value[1]:
            raise refuse("[min, max] with 0 < min <= max")
        return value

    @field_validator("joint_limits")
    @classmethod
    def _limits_in_order(cls, value: Pair) -> Pair:
        if not -180 <= value[0] < value[1] <= 180:
            raise refuse("[lower, upper] in degrees with -180 <= lower < upper <= 180")
        return value


class Actuator(Section):
    """The motor of every joint."""

    torque: Positive = Field(description="Largest torque, N·m.")
    speed: Positive = Field(description="Largest speed, rad/s.")
