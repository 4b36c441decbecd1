"""How many and how large a task's parts may be: what is beyond is no task, whatever its physics, and is refused first.

The ranges are far wider than hands are; they keep computing with a task short, and its numbers finite.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from casadi_hands.task.problem import Problem
from casadi_hands.task.shown import shown
from casadi_hands.task.task import Task


class Range(NamedTuple):
    """Sizes that numbers may have; zero and signs are the schema's to judge.

    Attributes:
        least: of a number that is not zero.
        most: of any.
        unit: of both.
    """

    least: float
    most: float
    unit: str = ""

    @property
    def in_unit(self) -> str:
        """The unit as it follows a number."""
        return f" {self.unit}" if self.unit else ""


COUNTS = {
    "object.shapes": 100,
    "motion": 200,
    "palm.motion": 200,
    "perturbations": 100,
    "keep_out": 100,
    "fingers": 20,
    "fingers.regrasps": 50,
}
"""Most elements of lists and mappings, by the path of their field."""

LENGTHS = {"name": 200, "about": 2000}
"""Most characters of texts."""
LONGEST_FINGER = 60

MOST_SAMPLES = 3000
"""Of a motion."""
MOST_PLACES = 2000
"""Shapes of the object times goals."""

_PLACE = Range(0.0, 1e5, "m")
_SIZE = Range(1e-6, 1e5, "m")
_TIME = Range(1e-4, 1e6, "s")
_SHARE = Range(1e-6, 1e6)
RANGES = {
    "object.mass": Range(1e-6, 1e5, "kg"),
    "object.inertia": Range(0.0, 1e12, "kg·m²"),
    "gravity": Range(0.0, 2e4, "m/s²"),
    "friction": Range(1e-3, 100.0),
    "center": _PLACE,
    "center_of_mass": _PLACE,
    "vertices": _PLACE,
    "start": _PLACE,
    "end": _PLACE,
    "position": _PLACE,
    "touches": _PLACE,
    "near": _PLACE,
    "within": _SIZE,
    "tool": _PLACE,
    "tool_at": _PLACE,
    "ground.height": _PLACE,
    "radius": _SIZE,
    "size": _SIZE,
    "edge_radius": Range(1e-8, 1e5, "m"),
    "palm.thickness": _SIZE,
    "hand.link_radius": _SIZE,
    "hand.link_length": _SIZE,
    "hand.hinge_length": _SIZE,
    "hand.clearance": Range(0.0, 1e5, "m"),
    "fingertip.radius": _SIZE,
    "fingertip.torsion": Range(0.0, 1e5, "m"),
    "at": Range(0.0, 1e6, "s"),
    "perturbations.from": Range(0.0, 1e6, "s"),
    "perturbations.to": _TIME,
    "regrasps.from": _TIME,
    "regrasps.to": _TIME,
    "duration": _TIME,
    "time_step": _TIME,
    "degrees": Range(0.0, 1e6, "degrees"),
    "perturbations.force": Range(0.0, 1e6, "N"),
    "perturbations.torque": Range(0.0, 1e6, "N·m"),
    "density": Range(1e-2, 1e6, "kg/m³"),
    "hand.material.stiffness": Range(0.0, 1e14, "Pa"),
    "hand.material.strength": Range(0.0, 1e12, "Pa"),
    "hand.safety_factor": Range(0.0, 1e3),
    "hand.ratios": _SHARE,
    "hand.contact_force": _SHARE,
    "actuator.torque": Range(1e-9, 1e6, "N·m"),
    "actuator.speed": Range(1e-6, 1e6, "rad/s"),
    "actuator.stiffness": Range(1e-9, 1e9, "N·m/rad"),
    "actuator.damping": Range(1e-9, 1e9, "N·m·s/rad"),
    "motors": Range(0.0, 1e3),
    "search.trials": Range(0.0, 1e4),
    "search.recombinations": Range(0.0, 1e3),
    "search.seed": Range(0.0, 2.0**63),
}
"""By the path of a field or its end."""
ANYTHING = Range(0.0, 1e12)
"""Of every other number."""
DIRECTIONS = ("facing", "up", "axis", "quaternion")
SHORTEST_DIRECTION = 1e-100
"""Largest component of a direction that is one."""


def bound(data: dict[str, Any]) -> list[Problem]:
    """Find what a task may not have, before anything is computed with it.

    Args:
        data: of a file, before it is known to be a task, or of a task.
    """
    return list(_bound(data, (), ""))


def bound_together(task: Task) -> list[Problem]:
    """Find a motion of more samples, or more shapes at more goals, than can be computed with."""
    places = len(task.object.shapes) * len(task.motion)
    if places > MOST_PLACES:
        given = f"{len(task.object.shapes)} shapes at {len(task.motion)} goals"
        return [Problem(("object", "shapes"), given, f"at most {MOST_PLACES}, shapes times goals")]
    samples = task.duration / task.time_step
    if samples <= MOST_SAMPLES:
        return []
    last = task.motion[-1].at
    given = f"{task.duration:g} s in steps of {task.time_step:g} s, {samples:.3g} samples"
    allowed = f"a motion of at most {MOST_SAMPLES} samples, duration / time_step"
    field = type(task).model_fields["time_step"]
    if task.time_step != field.default:
        return [Problem(("time_step",), given, allowed)]
    path = ("duration",) if task.duration != last else ("motion", len(task.motion) - 1, "at")
    return [Problem(path, given, allowed)]


def _bound(value: Any, path: tuple[str | int, ...], name: str) -> Iterator[Problem]:
    """Problems of a value and all in it; ``name`` is its path without numbers in lists and names of fingers."""
    if isinstance(value, dict | list | tuple):
        most = COUNTS.get(name)
        if most is not None and len(value) > most:
            yield Problem(path, f"{len(value):,} of them", f"at most {most}")
            return
    if isinstance(value, dict):
        for key, each in value.items():
            named = path == ("fingers",)
            if named and len(key) > LONGEST_FINGER:
                allowed = f"names of at most {LONGEST_FINGER} characters"
                yield Problem(path, f"{shown(key)}, {len(key)} characters", allowed)
                continue
            inner = name if named else f"{name}.{key}" if name else key
            yield from _bound(each, (*path, key), inner)
    elif isinstance(value, list | tuple):
        yield from _direction(value, path, name)
        for number, each in enumerate(value):
            yield from _bound(each, (*path, number), name)
    elif isinstance(value, str):
        yield from _text(value, path, name)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield from _size(value, path, name)


def _size(value: float, path: tuple[str | int, ...], name: str) -> Iterator[Problem]:
    allowed, size = range_of(name), abs(value)
    # What is infinite, and no number, the schema refuses.
    if size != math.inf and size > allowed.most:
        yield Problem(path, shown(value), f"at most {allowed.most:g}{allowed.in_unit} in size")
    elif 0 < value < allowed.least:
        yield Problem(path, shown(value), f"at least {allowed.least:g}{allowed.in_unit}")


def _text(value: str, path: tuple[str | int, ...], name: str) -> Iterator[Problem]:
    most = LENGTHS.get(name)
    if most is not None and len(value) > most:
        yield Problem(path, f"{shown(value)}, {len(value):,} characters", f"at most {most} characters")
    if name == "name" and any(c in value for c in "\n\t"):
        yield Problem(path, shown(value), "text in a line, without tabs")


def _direction(value: Sequence[Any], path: tuple[str | int, ...], name: str) -> Iterator[Problem]:
    if name.split(".")[-1] not in DIRECTIONS or not all(isinstance(each, int | float) for each in value):
        return
    if 0 < max((abs(each) for each in value), default=0) < SHORTEST_DIRECTION:
        yield Problem(path, shown(value), f"a direction with a number of at least {SHORTEST_DIRECTION:g}")


def range_of(name: str) -> Range:
    """The range of the longest end of a path that has one."""
    parts = name.split(".")
    if parts[0] in ("limits", "weights"):
        return ANYTHING
    ends = (".".join(parts[start:]) for start in range(len(parts)))
    return next((RANGES[end] for end in ends if end in RANGES), ANYTHING)
