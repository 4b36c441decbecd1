"""The fields of a task for a form: what each means, what it is by default, and what the file has."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from casadi_hands.studio.document import Path, one_line, value_at
from casadi_hands.task import Task
from casadi_hands.task.fields import Section
from casadi_hands.task.reference import default_text, shape_of
from casadi_hands.task.shapes import SECTIONS
from casadi_hands.task.structure import fields_of, sections_in

_WRITTEN_BY_THE_PROGRAM = (("object", "meshes"), ("palm", "placed"))


@dataclass(frozen=True)
class Field:
    """One field.

    Attributes:
        path: in the file.
        about: what it means.
        default: in words, ``required`` where there is none.
        written: what the file has, as YAML on one line; empty where the default holds.
    """

    path: Path
    about: str
    default: str
    written: str

    @property
    def name(self) -> str:
        """Its name in its section."""
        return str(self.path[-1])


@dataclass(frozen=True)
class Form:
    """The fields of one section.

    Attributes:
        title: for people.
        path: of the section.
        fields: its own, in the schema's order.
        forms: of sections in it.
    """

    title: str
    path: Path
    fields: tuple[Field, ...]
    forms: tuple[Form, ...]


def form_of(text: str) -> Form:
    """The form of a task file.

    Args:
        text: YAML.

    Raises:
        TaskError: the text is not YAML.
    """
    return _form("task", (), Task, value_at(text, ()))


def _form(title: str, path: Path, section: type[Section], data: Any) -> Form:
    own, inner = [], []
    data = data if isinstance(data, Mapping) else {}
    for name, field in fields_of(section).items():
        where = (*path, name)
        if where in _WRITTEN_BY_THE_PROGRAM:
            continue
        given, below = data.get(name), sections_in(field.annotation)
        if len(below) == 1 and below[0] not in SECTIONS.values() and _opens(where):
            if shape_of(field) == "one":
                inner.append(_form(name, where, below[0], given))
            else:
                each = tuple(_form(label, at, below[0], value) for label, at, value in _entries(name, where, given))
                inner.append(Form(name, where, (), each))
        else:
            written = "" if given is None else one_line(given)
            own.append(Field(where, field.description or "", default_text(field), written))
    return Form(title, path, tuple(own), tuple(inner))


def _opens(path: Path) -> bool:
    """Whether a section is a form of its own, rather than one value in braces."""
    return len(path) == 1 and path[0] not in ("perturbations",)


def _entries(name: str, path: Path, given: Any) -> Iterator[tuple[str, Path, Any]]:
    """The sections of a list or a mapping that a file has."""
    singular = {"motion": "goal", "fingers": "finger"}.get(name, name)
    if isinstance(given, Mapping):
        for key, value in given.items():
            yield f"{singular} {key}", (*path, str(key)), value
    elif isinstance(given, Sequence) and not isinstance(given, str):
        for number, value in enumerate(given):
            label = "start" if number == 0 and name == "motion" else f"{singular} {number}"
            yield label, (*path, number), value
