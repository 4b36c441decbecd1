"""Regions of the object's surface, where the program is to place contacts, and numbers of fingers in place of names."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    SerializerFunctionWrapHandler,
    Tag,
    model_serializer,
    model_validator,
)

from casadi_hands.task.fields import Positive, Section, Vector, refuse
from casadi_hands.task.shown import escaped

FEWEST, MOST = 2, 5
"""Fingers that `auto` stands for."""
MOST_COUNTED = 8
"""Fingers that may be asked for by their number."""
# What pydantic puts into the places of errors, and files do not have.
TAGS = ("<point>", "<region>")


def _names(value: Any) -> tuple[str, ...]:
    names = (value,) if isinstance(value, str) else value
    if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
        raise refuse("the name of a shape, or a list of those")
    return tuple(names)


Names = Annotated[tuple[str, ...], BeforeValidator(_names)]


class Region(Section):
    """Where on the object the program may place a contact; anywhere, where nothing is given."""

    near: Vector | None = Field(default=None, description="A point, m, object frame.")
    within: Positive | None = Field(default=None, description="How far from it the contact may be, m.")
    on: Names = Field(default=(), description="Name of the shape, or names of those, to touch.")
    not_on: Names = Field(default=(), description="Name of a shape, or names of those, not to touch.")

    @model_validator(mode="after")
    def _whole(self) -> Region:
        if (self.near is None) != (self.within is None):
            raise refuse("near: [x, y, z] and within: a distance, together")
        return self

    @model_serializer(mode="wrap")
    def _in_short(self, handler: SerializerFunctionWrapHandler) -> Any:
        return {name: value for name, value in handler(self).items() if value} or "anywhere"

    def shifted(self, by: np.ndarray) -> Region:
        """The same region seen from a frame whose origin is off by ``-by`` (3,), m."""
        if self.near is None:
            return self
        x, y, z = (float(value) for value in np.array(self.near) + by)
        return self.model_copy(update={"near": (x, y, z)})

    def __str__(self) -> str:
        """The region in words."""
        near = [] if self.near is None else [f"within {1e3 * (self.within or 0):g} mm of {list(self.near)} m"]
        on = [f"on {' or '.join(self.on)}"] if self.on else []
        off = [f"not on {' or '.join(self.not_on)}"] if self.not_on else []
        return ", ".join([*near, *on, *off]) or "anywhere"


def _kind(value: Any) -> str:
    """Of what is a mapping, a region; of all else a point, whose error then says what is allowed."""
    return TAGS[isinstance(value, dict | Region)]


def _spelled_out(value: Any) -> Any:
    if isinstance(value, dict):  # YAML 1.1, which other programs write, takes `on` for true
        return {"on" if name in ("true", "True") else name: each for name, each in value.items()}
    return {} if value == "anywhere" else value


Place: Any = Annotated[
    Annotated[Vector, Tag(TAGS[0])] | Annotated[Region, Tag(TAGS[1])],
    Discriminator(_kind),
    BeforeValidator(_spelled_out),
]
"""A point or a region."""
Asked = Annotated[Region, BeforeValidator(_spelled_out)]


def counted_fingers(value: Any) -> Any:
    """Fingers by name where a file gives their number, ``auto`` or ``{count: [least, most]}``; else what it gives."""
    given = None
    if value == "auto":
        value = [FEWEST, MOST]
    elif isinstance(value, dict) and set(value) == {"count"} and not isinstance(value["count"], dict):
        value = value["count"]
        given = f"a count of {escaped(str(value))}"
    elif isinstance(value, dict):
        return value
    least, most = value if isinstance(value, list | tuple) and len(value) == 2 else (value, value)
    if not (type(least) is int and type(most) is int and 1 <= least <= most <= MOST_COUNTED):
        names = "a mapping of names, such as thumb: {touches: [0, 0.02, 0]}"
        counted = f"their number, 1 to {MOST_COUNTED}, {{count: [least, most]}} of such with least <= most, or auto"
        raise refuse(f"{names}; or {counted}", given)
    return {f"finger{i + 1}": {"touches": {}, **({"optional": True} if i >= least else {})} for i in range(most)}
