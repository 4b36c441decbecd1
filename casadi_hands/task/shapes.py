"""The primitives an object is made of, and their solid and surface geometry."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Discriminator, Field, SerializerFunctionWrapHandler, Tag, model_serializer

from casadi_hands.task.fields import Positive, Section, Vector, vector


class _Primitive(Section):
    """A segment with a radius; a sphere's segment has no length."""

    radius: Positive = Field(description="Radius, m.")

    @property
    def segment(self) -> tuple[np.ndarray, np.ndarray]:
        """Ends of the axis, (3,) and (3,), m, object frame."""
        raise NotImplementedError

    @property
    def _length(self) -> float:
        start, end = self.segment
        return float(np.linalg.norm(end - start))

    @property
    def volume(self) -> float:
        """Volume, m³."""
        return float(np.pi * self.radius**2 * (self._length + 4 / 3 * self.radius))

    @property
    def centroid(self) -> np.ndarray:
        """Centre of the solid, (3,), m, object frame."""
        start, end = self.segment
        center: np.ndarray = (start + end) / 2
        return center

    @property
    def unit_inertia(self) -> np.ndarray:
        """Inertia of the solid with a mass of 1 kg about its centroid, (3, 3), m², object frame."""
        radius, length = self.radius, self._length
        cylinder = length / (length + 4 / 3 * radius)
        caps = 1 - cylinder
        along = cylinder * radius**2 / 2 + caps * 2 / 5 * radius**2
        # Each half sphere has its centre of mass 3/8 r beyond the end of the axis.
        across = cylinder * (radius**2 / 4 + length**2 / 12)
        across += caps * (2 / 5 * radius**2 + length**2 / 4 + 3 / 8 * radius * length)
        if length == 0:
            return across * np.eye(3)
        start, end = self.segment
        axis = (end - start) / length
        return across * np.eye(3) + (along - across) * np.outer(axis, axis)

    def nearest_on_axis(self, point: np.ndarray) -> np.ndarray:
        """Point of the axis nearest to ``point``; both (3,), m, object frame."""
        start, end = self.segment
        along = end - start
        if not along.any():
            return start
        share = np.clip((point - start) @ along / (along @ along), 0.0, 1.0)
        nearest: np.ndarray = start + share * along
        return nearest

    def signed_distance(self, point: np.ndarray) -> float:
        """Distance from the surface to ``point`` (3,), m; negative inside."""
        return float(np.linalg.norm(point - self.nearest_on_axis(point)) - self.radius)


class Sphere(_Primitive):
    """A ball."""

    center: Vector = Field(description="Centre, m, object frame.")

    @property
    def segment(self) -> tuple[np.ndarray, np.ndarray]:
        """The centre, twice: (3,) and (3,), m, object frame."""
        return np.array(self.center), np.array(self.center)

    @model_serializer(mode="wrap")
    def _tagged(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {"sphere": handler(self)}

    def moved(self, by: np.ndarray) -> Sphere:
        """The same sphere shifted by ``by`` (3,), m."""
        return Sphere(center=vector(np.array(self.center) + by), radius=self.radius)


class Capsule(_Primitive):
    """A cylinder with half a sphere at each end."""

    start: Vector = Field(description="One end of the axis, m, object frame.")
    end: Vector = Field(description="The other end, m, object frame; equal ends make a sphere.")

    @property
    def segment(self) -> tuple[np.ndarray, np.ndarray]:
        """Ends of the axis, (3,) and (3,), m, object frame."""
        return np.array(self.start), np.array(self.end)

    @model_serializer(mode="wrap")
    def _tagged(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {"capsule": handler(self)}

    def moved(self, by: np.ndarray) -> Capsule:
        """The same capsule shifted by ``by`` (3,), m."""
        return Capsule(start=vector(np.array(self.start) + by), end=vector(np.array(self.end) + by), radius=self.radius)


def _kind(value: Any) -> str | None:
    if isinstance(value, Sphere | Capsule):
        return type(value).__name__.lower()
    if isinstance(value, dict) and len(value) == 1:
        return str(next(iter(value)))
    return None


def _content(value: Any) -> Any:
    return next(iter(value.values())) if isinstance(value, dict) else value


Shape = Annotated[
    Annotated[Sphere, BeforeValidator(_content), Tag("sphere")]
    | Annotated[Capsule, BeforeValidator(_content), Tag("capsule")],
    Discriminator(_kind),
]
