"""The reference of the task file's fields, written from the schema itself."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from casadi_hands.task.bounds import ANYTHING, COUNTS, LENGTHS, MOST_PLACES, MOST_SAMPLES, RANGES
from casadi_hands.task.fields import Section
from casadi_hands.task.nodes import MOST_LEVELS, MOST_NODES
from casadi_hands.task.rotation import Rotation
from casadi_hands.task.structure import fields_of, sections_in
from casadi_hands.task.task import Task
from casadi_hands.task.textfile import LARGEST


def describe_fields() -> str:
    """Markdown: a table for each section of the task file, with every field's default and meaning; and the bounds."""
    tables = [line for name, section in _sections(Task, "") for line in [*_table(name, section), ""]]
    return "\n".join([*tables, *_bounds(), ""])


def _sections(section: type[Section], name: str) -> Iterator[tuple[str, type[Section]]]:
    """A section and all below it, with the path at which a file writes them."""
    yield name, section
    for field_name, field in fields_of(section).items():
        for inner in sections_in(field.annotation):
            path = f"{name}.{field_name}" if name else field_name
            if "list" in shape_of(field) or "mapping" in shape_of(field):
                path += "[]" if "list" in shape_of(field) else ".<name>"
            if len(sections_in(field.annotation)) > 1:
                path += f".{inner.__name__.lower()}"
            yield from _sections(inner, path)


def _table(name: str, section: type[Section]) -> Iterator[str]:
    yield f"### {f'`{name}`' if name else 'The task file'}"
    yield ""
    # Only the first paragraph: the rest of a docstring is for who reads the code.
    yield " ".join((section.__doc__ or "").split("\n\n")[0].split())
    yield ""
    yield "| field | default | meaning |"
    yield "|---|---|---|"
    for field_name, field in fields_of(section).items():
        yield f"| `{field_name}` | {default_text(field)} | {field.description} |"
    if section is Rotation:
        yield "| `quaternion` | | Instead of axis and degrees: [w, x, y, z], object to world, of any length but 0. |"


def _bounds() -> Iterator[str]:
    yield "### Bounds"
    yield ""
    yield (
        "What is beyond is refused before anything is computed with it. A name stands for every field that ends with "
        "it; zero and signs are up to the field."
    )
    yield ""
    yield "| field | at least | at most | |"
    yield "|---|---|---|---|"
    for name, each in RANGES.items():
        yield f"| `{name}` | {f'{each.least:g}' if each.least else ''} | {each.most:g} | {each.unit} |"
    yield f"| any other number | | {ANYTHING.most:g} | |"
    for name, most in COUNTS.items():
        yield f"| `{name}` | | {most} | of them |"
    for name, most in LENGTHS.items():
        yield f"| `{name}` | | {most} | characters |"
    yield f"| `object.shapes` × `motion` | | {MOST_PLACES} | shapes times goals |"
    yield f"| `duration` / `time_step` | | {MOST_SAMPLES} | samples |"
    yield f"| the file | | {LARGEST} | bytes |"
    yield f"| the file, aliases written out | | {MOST_NODES} | names and values, in {MOST_LEVELS} levels |"


def shape_of(field: FieldInfo) -> str:
    """Whether a field holds a ``list`` of sections, a ``mapping`` from names to them, or ``one`` value."""
    text = str(field.annotation)
    return "mapping" if "dict[" in text else "list" if "..." in text else "one"


def default_text(field: FieldInfo) -> str:
    """What a field is where a file does not give it, in words."""
    extra = field.json_schema_extra
    if isinstance(extra, dict) and "default" in extra:
        return str(extra["default"])
    default = field.default
    if default is PydanticUndefined:
        return "required"
    if default is None or default == ():
        return "none"
    if isinstance(default, Section | dict):
        return "its fields' defaults"
    if isinstance(default, bool):
        return str(default).lower()
    if isinstance(default, tuple):
        return f"[{', '.join(f'{value:g}' for value in default)}]"
    return f"{default:g}" if isinstance(default, float) else f'"{default}"' if default == "" else str(default)
