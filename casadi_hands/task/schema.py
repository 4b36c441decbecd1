"""The JSON Schema of a task file, for editors; written from the sections and the bounds themselves."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic.fields import FieldInfo

from casadi_hands.task.attached import Attached
from casadi_hands.task.bounds import COUNTS, DIRECTIONS, LENGTHS, LONGEST_FINGER, range_of
from casadi_hands.task.fields import Section
from casadi_hands.task.hand import Ground
from casadi_hands.task.material import MATERIALS, Material
from casadi_hands.task.motion import Exert, Goal, Perturbation
from casadi_hands.task.palm import Palm
from casadi_hands.task.region import MOST_COUNTED, Region
from casadi_hands.task.rotation import Rotation
from casadi_hands.task.servos import SERVOS, Drive
from casadi_hands.task.shapes import SECTIONS
from casadi_hands.task.structure import fields_of, sections_in
from casadi_hands.task.task import Task

SCHEMA_FILE = Path(__file__).with_name("task.schema.json")
"""The schema as it is installed."""

# Later drafts have `prefixItems`, and let keywords stand beside a `$ref`; not all editors know them.
_DRAFT = "http://json-schema.org/draft-07/schema#"
_LIST = {"type": "array"}


def _some_of(*names: str) -> dict[str, Any]:
    """At least one of some fields."""
    return {"anyOf": [{"required": [name]} for name in names]}


_WORDS: dict[type[Section], list[str]] = {
    Material: list(MATERIALS),
    Drive: ["remote"],
    Ground: ["none"],
    Region: ["anywhere"],
    Palm: ["auto"],
}
"""What may stand in a section's place."""
_FORCE_OR_TORQUE = _some_of("force", "torque")
_RULES: dict[type[Section], dict[str, Any]] = {
    Goal: {
        **_some_of("position", "tool_at", "angle", "distance"),
        "not": {"required": ["position", "tool_at"], "properties": {"position": _LIST, "tool_at": _LIST}},
    },
    Exert: _FORCE_OR_TORQUE,
    Perturbation: _FORCE_OR_TORQUE,
    Palm: {
        "anyOf": [
            {"required": ["position", "facing"]},
            {
                "required": ["auto"],
                "properties": {"auto": {"const": True}, "motion": {"type": "null"}},
                "not": {"required": ["position"]},
            },
        ]
    },
    Attached: _some_of(*Attached.model_fields),
    Rotation: {"anyOf": [{"required": ["axis", "degrees"]}, {"required": ["quaternion"], "maxProperties": 1}]},
}
"""What fields are to others of their section."""
# Letters and digits of any script: other characters than those are told among ASCII's only.
_FINGER = {"pattern": r"^(?!ground$)[^\x00-\x20!-,./:-@\[-^`{-\x7f]+$", "maxLength": LONGEST_FINGER}
_NUMBERS = {"type": "array", "items": {"type": "number"}, "minItems": 4, "maxItems": 4}
_COUNT = {"type": "integer", "minimum": 1, "maximum": MOST_COUNTED}
_COUNTS = [_COUNT, {"type": "array", "items": _COUNT, "minItems": 2, "maxItems": 2}]
_COUNTED = {
    "type": "object",
    "properties": {"count": {"anyOf": _COUNTS}},
    "required": ["count"],
    "additionalProperties": False,
}
_NAMES = {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}
_QUATERNION = _NUMBERS | {"description": "[w, x, y, z], object to world, of any length but 0; instead of the others."}


def task_schema() -> dict[str, Any]:
    """The schema: it takes what `load_task` takes, and knows fields, kinds of values, numbers of them, and bounds.

    What fields are to each other and to physics is for ``casadi-hands check``.
    """
    raw = Task.model_json_schema(by_alias=True)
    found: dict[str, tuple[type[Section], set[str]]] = {}
    for section, prefix in _sections(Task, ""):
        found.setdefault(section.__name__, (section, set()))[1].add(prefix)
    parts = raw.pop("$defs") | {"Task": raw}
    written = {name: _section(parts[name], *found[name]) for name in sorted(found)}
    return {"$schema": _DRAFT, "title": "Task of casadi-hands", **written.pop("Task"), "$defs": written}


def schema_text() -> str:
    """The schema as its file has it."""
    return json.dumps(task_schema(), indent=1, ensure_ascii=False) + "\n"


def schema_line() -> str:
    """The comment by which editors find the schema: put it at the top of a task file."""
    return f"# yaml-language-server: $schema={SCHEMA_FILE.as_uri()}"


def _sections(section: type[Section], prefix: str) -> Iterator[tuple[type[Section], str]]:
    """Every section below one, with the path of its fields as `range_of` takes it."""
    yield section, prefix
    for name, field in fields_of(section).items():
        for inner in sections_in(field.annotation):
            yield from _sections(inner, f"{prefix}{name}.")


def _section(raw: dict[str, Any], section: type[Section], prefixes: set[str]) -> dict[str, Any]:
    """A section's part of the schema, of what pydantic makes of it."""
    properties = {}
    for name, field in fields_of(section).items():
        properties[name] = _field(_plain(raw["properties"][name]), field)
    if section is Rotation:
        properties["quaternion"] = dict(_QUATERNION)
    for name, value in properties.items():
        _bound(value, [prefix + name for prefix in sorted(prefixes)])
    if section is Drive:
        properties["servo"] |= {"enum": [*SERVOS, None]}
    if section is Region:
        for name in ("on", "not_on"):
            properties[name] = {"description": properties[name]["description"], **_NAMES}
        # YAML 1.1, which other programs write, takes `on` for true.
        properties |= {name: _NAMES for name in ("true", "True")}
    if section is Task:
        properties["name"] |= {"pattern": r"^[^\n\t]*$"}
        named = properties["fingers"]
        text = named.pop("description")
        named["propertyNames"] = _FINGER
        properties["fingers"] = {"description": text, "anyOf": [named, _COUNTED, *_COUNTS, {"const": "auto"}]}
    fields = fields_of(section)
    required = [name for name in raw.get("required", ()) if _default(fields[name]) is None]
    whole = {
        "type": "object",
        "properties": properties,
        "additionalProperties": False,
        **({"required": required} if required and section is not Rotation else {}),
        **_RULES.get(section, {}),
    }
    if section in _WORDS:
        whole = {"anyOf": [{"enum": _WORDS[section]}, whole]}
    return {"description": " ".join((section.__doc__ or "").split("\n\n")[0].split()), **whole}


def _default(field: FieldInfo) -> str | None:
    """A default that is told in words."""
    extra = field.json_schema_extra
    return str(extra["default"]) if isinstance(extra, dict) and "default" in extra else None


def _field(value: dict[str, Any], field: FieldInfo) -> dict[str, Any]:
    """A field with its description, and its default as a value or in words."""
    told, default = _default(field), value.pop("default", None)
    text = f"{field.description} Default: {told}." if told else str(field.description)
    if "$ref" in value:
        value = {"allOf": [{"$ref": value["$ref"]}]}
    kept = {} if told or default is None or isinstance(default, dict) else {"default": default}
    return {**value, "description": text, **kept}


def _plain(node: Any) -> Any:
    """The same without titles, lists of several of one kind as such, and shapes under their names."""
    if isinstance(node, list):
        return [_plain(each) for each in node]
    if not isinstance(node, dict):
        return node
    if {"$ref": "#/$defs/Sphere"} in node.get("oneOf", ()):
        return {
            "type": "object",
            "properties": {name: {"$ref": f"#/$defs/{section.__name__}"} for name, section in SECTIONS.items()},
            "additionalProperties": False,
            "minProperties": 1,
            "maxProperties": 1,
        }
    plain = {name: _plain(value) for name, value in node.items() if name not in ("title", "prefixItems")}
    if "oneOf" in plain:
        plain["anyOf"] = plain.pop("oneOf")
    if "prefixItems" in node:
        plain["items"] = _plain(node["prefixItems"][0])
    return plain


def _bound(node: dict[str, Any], paths: list[str]) -> None:
    """Give a field's numbers, texts and lists the bounds of `bounds`, the widest of all places that it stands at."""
    kind, path = node.get("type"), paths[0]
    for inner in (*node.get("anyOf", ()), *([node["items"]] if "items" in node else [])):
        _bound(inner, paths)
    if kind in ("number", "integer"):
        most = max(range_of(each).most for each in paths)
        least = min(range_of(each).least for each in paths)
        node["maximum"] = min(node.get("maximum", most), most)
        if node.get("exclusiveMinimum") == 0 and least > 0:
            node["minimum"] = least
            del node["exclusiveMinimum"]
        elif not node.keys() & {"minimum", "exclusiveMinimum"}:
            node["minimum"] = -most
    elif kind == "string" and path in LENGTHS:
        node["maxLength"] = LENGTHS[path]
    elif kind in ("array", "object") and path in COUNTS:
        node["maxItems" if kind == "array" else "maxProperties"] = COUNTS[path]
    if kind == "array" and path.split(".")[-1] in DIRECTIONS:
        node["contains"] = {"not": {"const": 0}}
