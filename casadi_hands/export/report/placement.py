"""Contacts and palm that the program placed: the sets that it tried, and why one was taken."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from casadi_hands.export.report.markup import Html, number, paragraph, section, signed, table

if TYPE_CHECKING:
    from casadi_hands.problem.result import Result

_HEAD = ("Set", "grip, weights", "reach, weights", "stiffness", "off side-on", "joints", "", "contacts, mm")
_ABOUT = (
    "Grip: what the hardest-pressed contact presses with at least. Reach: what being off side-on to the palm, far from "
    "it, travelling far and on a curved surface costs. Stiffness: that the grasp asks for, by what joints have. "
    "Joints: of each finger, as the first stages found them; of sets that need as many the cheaper one was taken."
)


def placement_section(design: Result) -> Html:
    """What ``placement.json`` tells; nothing where all was given."""
    told, parts = design.placement, []
    palm, sets = told.get("palm"), told.get("sets")
    if isinstance(palm, Mapping):
        parts.append(paragraph(number(f"The palm was placed: {palm.get('why', '')}.")))
    if isinstance(sets, list) and sets:
        parts.append(paragraph(number(f"Contacts were placed: {told.get('why', '')}.")))
        rows = [row for k, each in enumerate(sets) if isinstance(each, Mapping) for row in _row(k, each, told)]
        parts += [table(_HEAD, rows), paragraph(_ABOUT, "note")]
    return section("placement", "Where palm and contacts are", *parts) if parts else Html("")


def _row(k: int, each: Mapping[str, Any], told: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """A set's row, if it is told of as the program does."""
    points = each.get("points")
    figures = [each.get(name) for name in ("grip", "reach", "wobble", "worst_angle")]
    if not isinstance(points, Mapping) or not all(_is_number(value) for value in figures):
        return
    places = ", ".join(f"{name} {_place(point)}" for name, point in points.items())
    joints = "+".join(str(count) for count in each.get("joints") or ())
    words = [
        *(["taken"] if told.get("chosen") == k else []),
        *([f"{each['lacking']} fingers need more"] if each.get("lacking") else []),
        *([f"{each['idle']} idle"] if each.get("idle") else []),
        *([f"{each['singular']} in singular poses"] if each.get("singular") else []),
        *(["broke off"] if each.get("broke_off") else []),
    ]
    grip, reach, wobble, angle = (float(value) for value in figures if value is not None)
    numbers = (signed(grip, 2), signed(reach, 2), signed(wobble, 2), f"{signed(angle, 0)}°")
    yield str(k + 1), *numbers, joints, ", ".join(words), places


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _place(point: Any) -> str:
    """A point in mm."""
    if not isinstance(point, list | tuple) or not all(_is_number(value) for value in point):
        return "?"
    return f"[{', '.join(signed(1e3 * value, 1) for value in point)}]"
