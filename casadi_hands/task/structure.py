"""The schema as a tree that can be walked by path: its names and descriptions."""

from __future__ import annotations

import types
from collections.abc import Iterator
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from casadi_hands.task.fields import Section
from casadi_hands.task.shapes import SECTIONS
from casadi_hands.task.task import Task


def names_at(path: tuple[str | int, ...]) -> list[str]:
    """Fields of the section at ``path``; empty if there is no section."""
    section = _section_at(path)
    return section.file_names() if section else []


def description_at(path: tuple[str | int, ...]) -> str:
    """Description of the field at ``path``."""
    section = _section_at(path[:-1])
    field = fields_of(section).get(str(path[-1])) if section else None
    return (field.description or "") if field else ""


def paths_of(name: str) -> list[str]:
    """Places at most two names deep in the file where a field of this name exists, as dotted paths."""
    paths = [(path, path.split(".")) for path, _, _ in walk(Task)]
    return [path for path, names in paths if names[-1] == name and len(names) <= 2]


def fields_of(section: type[Section]) -> dict[str, FieldInfo]:
    """Fields of a section by the name a file uses."""
    return {field.alias or name: field for name, field in section.model_fields.items()}


def walk(section: type[Section], prefix: str = "") -> Iterator[tuple[str, FieldInfo, list[type[Section]]]]:
    """Every field below a section in depth-first order: path, field, and the sections its value is made of."""
    for name, field in fields_of(section).items():
        inner = sections_in(field.annotation)
        yield prefix + name, field, inner
        for child in inner:
            yield from walk(child, f"{prefix}{name}.")


def sections_in(annotation: Any) -> list[type[Section]]:
    """The sections a type mentions: itself, its options, its elements."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return [annotation]
    return [section for part in get_args(annotation) for section in sections_in(part)]


def _section_at(path: tuple[str | int, ...]) -> type[Section] | None:
    current: Any = Task
    for step in path:
        inner = sections_in(current)
        optional = _optional(current)
        if step in SECTIONS and SECTIONS[str(step)] in inner:
            current = SECTIONS[str(step)]
        elif optional and step in fields_of(optional):
            current = fields_of(optional)[str(step)].annotation
        elif isinstance(current, type) and issubclass(current, Section):
            field = fields_of(current).get(str(step))
            current = field.annotation if field else None
        else:
            # An element of a list, or a name in a mapping of names.
            arguments = [part for part in get_args(_inside(current)) if part is not str and part is not Ellipsis]
            current = arguments[0] if arguments else None
    return current if isinstance(current, type) and issubclass(current, Section) else _optional(current)


def _optional(annotation: Any) -> type[Section] | None:
    """The one section of an annotation such as ``Section | None``."""
    sections = sections_in(annotation)
    return sections[0] if get_origin(annotation) in (Union, types.UnionType) and len(sections) == 1 else None


def _inside(annotation: Any) -> Any:
    """The list or mapping in an annotation such as ``tuple[X, ...] | None``."""
    if get_origin(annotation) is Annotated:
        return _inside(get_args(annotation)[0])
    if get_origin(annotation) in (Union, types.UnionType):
        return next((part for part in get_args(annotation) if get_origin(part) in (tuple, dict)), annotation)
    return annotation
