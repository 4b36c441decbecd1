"""A first task file with comments, from a few answers: what the object is like, and what it shall do."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from casadi_hands.errors import TaskError
from casadi_hands.task.schema import schema_line
from casadi_hands.task.shown import escaped
from casadi_hands.task.thickness import OF_PALM

SIZES = {
    "sphere": ("diameter",),
    "capsule": ("length", "diameter"),
    "cylinder": ("length", "diameter"),
    "box": ("width", "length", "height"),
}
"""Shapes, and the sizes that each has. Lengths lie along y; fingers press along x, across the width or the diameter."""
MOTIONS = {"lift": "mm", "carry": "mm", "turn": "degrees", "tilt": "degrees"}
"""What the object may do, and the unit of how far."""
USUAL = {"sphere": (60.0,), "capsule": (90.0, 40.0), "cylinder": (90.0, 40.0), "box": (50.0, 60.0, 50.0)}
"""Sizes, mm, where none are given."""
MOST_FINGERS = 5
_BELOW = math.radians(12)  # the equator of what is round, so that squeezing also lifts
_FINGERS = ("thumb", "index", "middle", "ring", "little")
_TURNS = {"turn": ("[0, 0, 1]", 40.0), "tilt": ("[1, 0, 0]", 15.0)}


@dataclass(frozen=True)
class Idea:
    """What somebody wants a hand for.

    Attributes:
        name: of the task.
        shape: of the object, one of `SIZES`.
        size: mm, as `SIZES` names them; `USUAL` by default.
        mass: g; None for that of a solid of 500 kg/m³.
        motion: one of `MOTIONS`.
        amount: of it, mm or degrees; what its size makes usual by default.
        fingers: 2 to 5.
        table: whether the object stands on one at first.
    """

    name: str
    shape: str = "capsule"
    size: Sequence[float] = ()
    mass: float | None = None
    motion: str = "turn"
    amount: float | None = None
    fingers: int = 3
    table: bool = False

    def __post_init__(self) -> None:
        """Refuse what no task can be made of.

        Raises:
            TaskError: with the field, what was given and what is allowed.
        """
        _allow("shape", self.shape, SIZES)
        _allow("motion", self.motion, MOTIONS)
        names = SIZES[self.shape]
        if self.size and (len(self.size) != len(names) or not all(0 < each < math.inf for each in self.size)):
            given = " ".join(f"{each:g}" for each in self.size)
            raise TaskError(f"size: given {given}; allowed: {', '.join(names)} of the {self.shape}, mm, above 0")
        if self.shape == "capsule" and self.size and self.size[0] < self.size[1]:
            raise TaskError(f"size: given a capsule {self.size[0]:g} mm long; allowed: its diameter and more")
        for what, value in (("mass", self.mass), ("amount", self.amount)):
            if value is not None and not 0 < value < math.inf:
                raise TaskError(f"{what}: given {value:g}; allowed: a number greater than 0")
        if not 2 <= self.fingers <= MOST_FINGERS:
            raise TaskError(f"fingers: given {self.fingers}; allowed: 2 to {MOST_FINGERS}")
        if self.table and self.motion not in ("lift", "turn"):
            raise TaskError(f"table: given with {self.motion}; allowed: with lift or turn")

    @property
    def sides(self) -> tuple[float, float, float]:
        """Sizes along x, y and z, m."""
        size = [each / 1e3 for each in self.size or USUAL[self.shape]]
        if self.shape == "box":
            return size[0], size[1], size[2]
        return size[-1], size[0], size[-1]

    @property
    def kilograms(self) -> float:
        """The mass, kg."""
        if self.mass is not None:
            return self.mass / 1e3
        width, length, height = self.sides
        volume = {
            "sphere": math.pi / 6 * width**3,
            "capsule": math.pi / 4 * width**2 * (length - width) + math.pi / 6 * width**3,
            "cylinder": math.pi / 4 * width**2 * length,
            "box": width * length * height,
        }[self.shape]
        return float(f"{500 * volume:.2g}")

    @property
    def far(self) -> float:
        """How far the object goes, mm or degrees."""
        if self.amount is not None:
            return self.amount
        if self.motion in _TURNS:
            return _TURNS[self.motion][1]
        return float(f"{400 * max(self.sides) / 2:.1g}")


def starter(idea: Idea) -> str:
    """The text of a task file: a hand above the object, a thumb against the other fingers.

    Raises:
        TaskError: fingertips have no room on the object.
    """
    width, _, height = idea.sides
    longest = max(idea.sides) / 2
    palm = max(1.2 * longest, 0.8 * max(width, height))
    start = height / 2 if idea.table else 0.2
    rise = idea.far / 1e3 if idea.motion == "lift" else 0.0
    above = start + rise + max(2 * longest, 1.65 * max(width, height))
    lines = [
        schema_line(),
        "# Lengths are in m, masses in kg, times in s, angles in degrees; z of the world is up.",
        "# Check it with `casadi-hands check FILE`, and have a hand designed with `casadi-hands solve FILE`.",
        f"name: {_quoted(idea.name)}",
        "",
        "# The object, in a frame of its own; its shapes may be several: their union counts.",
        "object:",
        f"  mass: {_number(idea.kilograms)}",
        "  shapes:",
        f"    - {_shape(idea)}",
        "",
        "# The disc that the fingers stand on. `moves: true` lets the program move it.",
        "palm:",
        f"  radius: {_number(palm)}",
        f"  position: [0, 0, {_number(above)}]",
        "  facing: [0, 0, -1]  # where the fingers point: down",
        "",
        "# Where the object shall be, and when. It rests at the first goal and the last.",
        "motion:",
        *_goals(idea, start),
        "",
        *(["ground: {height: 0}  # the table", ""] if idea.table else []),
        "# Where each fingertip touches the object at first, in the object's frame. The program may shift it a little.",
        "# Fingers can only push, so they stand opposite each other.",
        "fingers:",
        *(f"  {name}: {{touches: {_list(point)}}}" for name, point in _contacts(idea, OF_PALM * palm)),
        "",
        "friction: 0.7  # of fingertips and object: rubber on most things has 0.5 to 1",
        "",
        "# Everything else has a default; `casadi-hands fields` lists all fields. For example:",
        "# hand: {link_radius: 0.008}    # how thick fingers are",
        "# actuator: {torque: 0.3}       # the strongest motors, N·m",
        "# motors: fewest                # few motors turn all joints",
        "# search: {seed: 1}             # another hand for the same task",
    ]
    return "\n".join(lines) + "\n"


def _shape(idea: Idea) -> str:
    width, length, height = idea.sides
    if idea.shape == "sphere":
        return f"sphere: {{center: [0, 0, 0], radius: {_number(width / 2)}}}"
    if idea.shape == "box":
        return f"box: {{center: [0, 0, 0], size: {_list((width, length, height))}}}"
    half = _number((length - (width if idea.shape == "capsule" else 0)) / 2)
    return f"{idea.shape}: {{start: [0, -{half}, 0], end: [0, {half}, 0], radius: {_number(width / 2)}}}"


def _goals(idea: Idea, start: float) -> list[str]:
    place, way = f"[0, 0, {_number(start)}]", idea.far / 1e3
    first = f"  - {{at: 0, position: {place}}}"
    if idea.motion == "lift":
        return [first, f"  - {{at: 2, position: [0, 0, {_number(start + way)}]}}"]
    if idea.motion == "carry":
        there = f"[0, {_number(way)}, {_number(start)}]"
        return [first, f"  - {{at: 2, position: {there}}}", f"  - {{at: 4, position: {place}}}"]
    turn = f"rotation: {{axis: {_TURNS[idea.motion][0]}, degrees: {_number(idea.far)}}}"
    return [first, f"  - {{at: 2, position: {place}, {turn}}}", f"  - {{at: 4, position: {place}}}"]


def _contacts(idea: Idea, tip: float) -> list[tuple[str, tuple[float, float, float]]]:
    """Fingers with where they touch: evenly around a ball, else the thumb against all others.

    Args:
        idea: of the object.
        tip: radius of a fingertip, m.
    """
    width, length, height = idea.sides
    radius, names = width / 2, _FINGERS[: idea.fingers]
    # On a table, tips keep clear of it by standing higher.
    low = -0.08 * height if idea.table and idea.shape == "box" else 0.1 * height
    if idea.shape != "box":
        low = radius * math.sin(-_BELOW / 2 if idea.table else _BELOW)
    across = radius if idea.shape == "box" else math.sqrt(radius**2 - low**2)
    if idea.shape == "sphere":
        turns = [2 * math.pi * number / len(names) for number in range(len(names))]
        apart = 2 * across * math.sin(math.pi / len(names))
        points = [(across * math.cos(turn), across * math.sin(turn), -low) for turn in turns]
    else:
        others = len(names) - 1
        room = 0.8 * (length - width) if idea.shape == "capsule" else 0.6 * length
        apart = room / max(others - 1, 1) if others > 1 else math.inf
        along = [0.0] if others == 1 else [room / 2 - apart * number for number in range(others)]
        points = [(across, 0.0, -low), *((-across, y, -low) for y in along)]
    if apart < 2.2 * tip:
        room_for = "a longer object, or fewer fingers"
        raise TaskError(f"fingers: given {len(names)} on {1e3 * length:g} mm; allowed: {room_for}")
    return list(zip(names, points, strict=True))


def _allow(what: str, given: str, allowed: Collection[str]) -> None:
    if given not in allowed:
        raise TaskError(f"{what}: given {escaped(given)}; allowed: {', '.join(allowed)}")


def _number(value: float) -> str:
    return f"{value:.4g}"


def _list(values: Sequence[float]) -> str:
    return f"[{', '.join(_number(round(value, 5) + 0.0) for value in values)}]"


def _quoted(name: str) -> str:
    """Text as YAML takes it whatever is in it."""
    plain = re.fullmatch(r"[A-Za-z]([A-Za-z _-]*[A-Za-z])?", name)
    if plain and name.lower() not in ("true", "false", "null", "yes", "no", "on", "off"):
        return name
    return "'" + name.replace("'", "''") + "'"
