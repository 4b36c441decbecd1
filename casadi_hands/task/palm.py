"""The palm: a disc, where it stands, and how it moves."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import Field, field_validator, model_validator

from casadi_hands.task.fields import Flag, Positive, Section, Vector, follows, refuse
from casadi_hands.task.rotation import rotation_matrix

# cos 10°: closer to vertical than this, the vertical no longer says how the palm is rolled.
_NEARLY_PARALLEL = 0.985


def _unit(vector: Any) -> np.ndarray:
    unit: np.ndarray = np.array(vector) / np.linalg.norm(vector)
    return unit


def _check_direction(value: Vector | None) -> Vector | None:
    if value is not None and not any(value):
        raise refuse("a direction: at least one number other than 0")
    return value


class Waypoint(Section):
    """A pose that the palm passes through."""

    at: Positive = Field(description="Time, s; later than the waypoint before.")
    position: Vector = Field(description="Centre of the palm's surface, m, world.")
    facing: Vector | None = Field(
        default=None,
        description="Where the fingers point, world; any length.",
        json_schema_extra={"default": "as before"},
    )

    _direction = field_validator("facing")(_check_direction)


class Palm(Section):
    """A disc with the fingers on one face.

    Its frame has the origin at the centre of that face, z where the fingers point and x towards `up`.
    """

    radius: Positive = Field(
        description="Radius of the disc, m.", json_schema_extra={"default": "1.2 × object's characteristic length"}
    )
    thickness: Positive = Field(
        default_factory=follows(lambda data: 0.2 * data["radius"]),
        description="Thickness of the disc, m; it lies behind the face with the fingers.",
        json_schema_extra={"default": "0.2 × palm.radius"},
    )
    auto: Flag = Field(
        default=False,
        exclude=True,
        description="Whether the program is to stand the palm where fingers reach best; `palm: auto` is short for "
        "`palm: {auto: true}`. What else is given of the palm, it keeps to.",
    )
    position: Vector = Field(
        description="Centre of the face with the fingers at the start, m, world.",
        json_schema_extra={"default": "required, but for `auto`"},
    )
    facing: Vector = Field(
        description="Where the fingers point at the start, world; any length.",
        json_schema_extra={"default": "required, but for `auto`"},
    )
    up: Vector | None = Field(
        default=None,
        description="Direction towards which the palm's x axis leans, world; it says how the palm is rolled.",
        json_schema_extra={"default": "world z; world x where the palm faces up or down"},
    )
    may_move: Flag = Field(
        default=False, alias="moves", description="Whether the program may move the palm to do the task better."
    )
    motion: tuple[Waypoint, ...] | None = Field(
        default=None,
        description="Poses at which the palm rests after the start: its motion, or, if it `moves`, a first guess.",
    )
    placed: Flag | None = Field(
        default=None, description="Whether the program stood the palm where it is; the program writes it."
    )

    _direction = field_validator("facing", "up")(_check_direction)

    @model_validator(mode="before")
    @classmethod
    def _anywhere(cls, value: Any) -> Any:
        if not isinstance(value, dict) or value.get("auto") is not True:
            return value
        for name in ("position", "motion"):
            if value.get(name) is not None:
                raise refuse(f"a palm without `{name}` where `auto: true` lets the program choose; or without `auto`")
        # Until it stands somewhere.
        given = {name: each for name, each in value.items() if each is not None}
        return {"position": (0.0, 0.0, 0.0), "facing": (0.0, 0.0, -1.0), **given}

    @model_validator(mode="after")
    def _roll_is_defined(self) -> Palm:
        faces = [self.facing, *(point.facing for point in self.motion or () if point.facing)]
        if self.up and any(np.linalg.norm(np.cross(_unit(face), _unit(self.up))) < 1e-6 for face in faces):
            raise refuse("an `up` that is not parallel to where the palm faces")
        return self

    @property
    def rotation(self) -> np.ndarray:
        """(3, 3) world <- palm at the start."""
        return _frame(_unit(self.facing), self.up)

    @property
    def waypoints(self) -> tuple[tuple[float, np.ndarray, np.ndarray], ...]:
        """Time (s), position (3,) (m, world) and rotation (3, 3) (world <- palm) of the start and every waypoint.

        Without `up` a waypoint's frame is the one before, turned the shortest way to the new facing.
        """
        poses = [(0.0, np.array(self.position), self.rotation)]
        for point in self.motion or ():
            before = poses[-1][2]
            facing = before[:, 2] if point.facing is None else _unit(point.facing)
            rotation = _frame(facing, self.up) if self.up else _shortest_turn(before[:, 2], facing) @ before
            poses.append((point.at, np.array(point.position), rotation))
        return tuple(poses)


def _frame(facing: np.ndarray, up: Vector | None) -> np.ndarray:
    if up is None:
        up = (0.0, 0.0, 1.0) if abs(facing[2]) < _NEARLY_PARALLEL else (1.0, 0.0, 0.0)
    x = _unit(np.array(up) - facing * (facing @ np.array(up)))
    return np.column_stack([x, np.cross(facing, x), facing])


def _shortest_turn(old: np.ndarray, new: np.ndarray) -> np.ndarray:
    axis = np.cross(old, new)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        if old @ new > 0:
            return np.eye(3)
        # Straight back: any axis across will do; take the one the default frame would.
        return rotation_matrix(np.pi * _frame(old, None)[:, 0])
    return rotation_matrix(axis / sine * np.arctan2(sine, old @ new))
