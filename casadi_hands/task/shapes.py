"""The primitives an object is made of, as a task file gives them; what they are is said in `geometry.bodies`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import cached_property, reduce
from operator import or_
from typing import Annotated, Any, Self

import numpy as np
from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    PrivateAttr,
    SerializerFunctionWrapHandler,
    Tag,
    create_model,
    model_serializer,
    model_validator,
)

from casadi_hands.geometry.bodies import KINDS, Body
from casadi_hands.task.fields import Positive, Section, Vector, follows, refuse, vector
from casadi_hands.task.mesh import Mesh, Uniform
from casadi_hands.task.rotation import UPRIGHT, Rotation

MOST_POINTS = 500


class Primitive(Section):
    """A primitive of the object; its class names the shape."""

    name: str | None = Field(default=None, min_length=1, description="What regions of contacts call it.")
    _part_of: tuple[Mesh, int] | None = PrivateAttr(None)

    @cached_property
    def body(self) -> Body:
        """The body, m, object frame."""
        kind = KINDS[type(self).__name__.lower()]
        return kind(**{name: _value(getattr(self, name)) for name in type(self).model_fields if name != "name"})

    @property
    def uniform(self) -> tuple[Uniform, ...]:
        """What it adds to the object's volume, centre and inertia: itself, or the mesh of which it is a part."""
        if self._part_of is not None:
            mesh, number = self._part_of
            return () if number else (mesh.solid,)
        return (Uniform(self.body.volume, self.body.centroid, self.body.unit_inertia),)

    @property
    def begins(self) -> Mesh | None:
        """The mesh of which it is the first part."""
        return self._part_of[0] if self._part_of is not None and self._part_of[1] == 0 else None

    def on_its_own(self) -> None:
        """Forget of which mesh it is a part, once all that follows from the mesh is known."""
        self._part_of = None

    @cached_property
    def edges(self) -> np.ndarray:
        """The body's edges (E, 2, 3), m, object frame."""
        return np.array(self.body.edges(), float)

    @cached_property
    def bounding_box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner of the box around the body, (3,) and (3,), m, object frame."""
        return self.body.bounding_box

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if allowed := self.body.impossible():
            raise refuse(allowed)
        return self

    @model_serializer(mode="wrap")
    def _tagged(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {type(self).__name__.lower(): {n: v for n, v in handler(self).items() if (n, v) != ("name", None)}}

    def moved(self, by: np.ndarray) -> Primitive:
        """The same primitive shifted by ``by`` (3,), m."""
        moved = {name: getattr(self, name) for name in type(self).model_fields}
        for each in fields(KINDS[type(self).__name__.lower()]):
            value = moved[each.name]
            if each.metadata["is"] in ("point", "middle"):
                moved[each.name] = vector(np.add(value, by))
            elif each.metadata["is"] == "points":
                moved[each.name] = tuple(vector(np.add(point, by)) for point in value)
        return type(self)(**moved)


def _value(given: Any) -> Any:
    """A field as a body has it."""
    if isinstance(given, Rotation):
        return given.vector
    return np.array(given) if isinstance(given, tuple) else given


Points = Annotated[tuple[Vector, ...], Field(min_length=4, max_length=MOST_POINTS)]
_TYPES: dict[str, Any] = {
    "middle": Vector,
    "point": Vector,
    "points": Points,
    "positive": Positive,
    "rotation": Rotation,
    "sizes": tuple[Positive, Positive, Positive],
}
_DEFAULTS: dict[str, tuple[Callable[[], Any], str]] = {
    "middle": (lambda: (0.0, 0.0, 0.0), "the object frame's origin"),
    "rotation": (lambda: UPRIGHT, "not turned"),
}


def _section(kind: type[Body]) -> Any:
    """The section of a task file that gives a body of a kind."""
    given: dict[str, Any] = {}
    for each in fields(kind):
        what = each.metadata["is"]
        default = each.metadata.get("default")
        more: dict[str, Any] = {}
        if default is not None:
            more = {
                "default_factory": follows(default),
                "json_schema_extra": {"default": each.metadata["default_text"]},
            }
        elif what in _DEFAULTS:
            factory, text = _DEFAULTS[what]
            more = {"default_factory": factory, "json_schema_extra": {"default": text}}
        given[each.name] = (_TYPES[what], Field(description=each.metadata["about"], **more))
    return create_model(kind.__name__, __base__=Primitive, __doc__=kind.__doc__, **given)


def spelled(section: Any) -> str:
    """The fields that a section must have, as in a file."""
    required = [name for name, given in section.model_fields.items() if given.is_required()]
    return f"{{{', '.join(required)}}}"


SECTIONS: dict[str, Any] = {**{name: _section(kind) for name, kind in KINDS.items()}, "mesh": Mesh}
# Tasks go to other processes with their sections, which are found there by their names.
globals().update({section.__name__: section for section in SECTIONS.values()})
Sphere, Capsule = SECTIONS["sphere"], SECTIONS["capsule"]


def _kind(value: Any) -> str | None:
    if isinstance(value, Primitive | Mesh):
        return type(value).__name__.lower()
    if isinstance(value, dict) and len(value) == 1:
        return str(next(iter(value)))
    return None


def _content(value: Any) -> Any:
    return next(iter(value.values())) if isinstance(value, dict) else value


Shape: Any = Annotated[
    reduce(or_, [Annotated[section, BeforeValidator(_content), Tag(name)] for name, section in SECTIONS.items()]),
    Discriminator(_kind),
]


def parts_of(mesh: Mesh) -> tuple[Primitive, ...]:
    """Convex shapes that stand for a mesh.

    Raises:
        ValidationError: one of them cannot have the edge radius.
    """
    edge = {} if mesh.edge_radius is None else {"edge_radius": mesh.edge_radius}
    parts = tuple(
        SECTIONS["convex"](vertices=[vector(v) for v in part], **edge, name=mesh.name) for part in mesh.vertices
    )
    for number, part in enumerate(parts):
        part._part_of = (mesh, number)
    return parts
