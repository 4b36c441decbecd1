"""What the audit found: figures, their limits, and reasons in the user's words."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

_UNITS = {
    "m": (1000.0, " mm"),
    "deg": (1.0, " deg"),
    "rad": (1.0, " rad"),
    "weight": (1.0, " of the weight"),
    "N·m/rad": (1.0, " N·m/rad"),
    "weight/mm": (1.0, " weights/mm"),
    "N": (1.0, " N"),
    "N·m": (1.0, " N·m"),
    "Pa": (1e-6, " MPa"),
    "rad/s": (1.0, " rad/s"),
    "share": (100.0, " %"),
    "m/s": (1000.0, " mm/s"),
    "": (1.0, ""),
}

UNIT_OF = {
    **dict.fromkeys(
        ("goal_position", "penetration", "gap", "gap_between", "slip", "replay_position", "tip_deflection"), "m"
    ),
    **dict.fromkeys(("goal_angle", "joint_limit", "replay_angle"), "deg"),
    **dict.fromkeys(("residual", "residual_between", "friction_excess", "pull", "unsupplied_force"), "weight"),
    "torsion_excess": "weight",
    "least_stiffness": "N·m/rad",
    "bearing_force": "N",
    "bearing_moment": "N·m",
    "link_stress": "Pa",
    **dict.fromkeys(("speed", "torque", "replay_dropped", "torsion_shortfall", "slide_shortfall"), "share"),
    "disturbance_radius": "weight",
    "coupling": "rad",
}
"""Units of the limits."""


def worse(one: tuple[float, str], other: tuple[float, str]) -> tuple[float, str]:
    """Return the larger of two values with their findings; what is not a number is larger than all."""
    return other if math.isnan(other[0]) or other[0] > one[0] else one


def show(value: float, unit: str) -> str:
    """Return an SI value as a reader likes it: 0.0031 m -> ``3.1 mm``."""
    scale, suffix = _UNITS[unit]
    return f"{value * scale:.3g}{suffix}"


@dataclass(frozen=True)
class Figure:
    """One measured figure.

    Attributes:
        name: as in the certificate and, where it has a limit, in the task's ``limits``.
        value: the worst value over the motion, in ``unit``.
        limit: None when nothing is asked of the figure.
        unit: ``m``, ``deg``, ``rad``, ``weight`` (the object's), ``share``, ``N``, ``N·m``, ``Pa``, ``rad/s`` or none.
        finding: the worst case as a sentence with ``{value}`` in it.
        at_least: whether the limit is a least value rather than a largest one.
        by_interval: of a figure between samples, what each interval (S - 1,) has of it, in ``unit``; of slip
            (runs, S - 1), of every stretch from touch to lift, after a row of zeros.
    """

    name: str
    value: float
    limit: float | None
    unit: str
    finding: str
    at_least: bool = False
    by_interval: np.ndarray | None = field(default=None, compare=False, repr=False)

    @property
    def holds(self) -> bool:
        """Whether the limit is kept; a value that is not a number keeps none."""
        if self.limit is None:
            return True
        return self.value >= self.limit if self.at_least else self.value <= self.limit

    @property
    def text(self) -> str:
        """The finding with its value."""
        return self.finding.format(value=show(self.value, self.unit))

    @property
    def reason(self) -> str:
        """The finding, its value and the limit it misses."""
        return self.text if self.limit is None else f"{self.text}; limit {show(self.limit, self.unit)}"


def of_actuator(name: str, value: float, where: str, most: float | None, limit: float, unit: str) -> Figure:
    """Return what is asked of an actuator: a share of what the task's does, where it names that, else in its unit.

    Args:
        name: of the figure, and what the actuator has it of.
        value: asked, in ``unit``.
        where: as a phrase.
        most: of the task's actuator; None where it names none.
        limit: of the share.
        unit: of the value.
    """
    if most is None:
        return Figure(name, value, None, unit, f"{{value}} in {where}")
    return Figure(name, value / most, limit, "share", f"{{value}} of the actuator's {name} in {where}")


@dataclass(frozen=True)
class Audit:
    """All figures of one design.

    Attributes:
        name: of the task.
        figures: by name, in the order they are reported.
        problems: what is wrong with the files themselves, a sentence each.
        notes: what a reader should know though nothing is wrong with it, a sentence each.
    """

    name: str
    figures: dict[str, Figure]
    problems: tuple[str, ...]
    notes: tuple[str, ...] = ()

    @property
    def certified(self) -> bool:
        """Whether every limit holds."""
        return all(figure.holds for figure in self.figures.values())

    @property
    def reasons(self) -> list[str]:
        """Why the design is not certified; empty when it is."""
        missed = [f.reason for name, f in self.figures.items() if not f.holds and name != "structure"]
        return [*self.problems, *missed]

    def as_certificate(self) -> dict[str, dict[str, Any]]:
        """Return the ``certificate`` of result.json; a value that is not finite is null."""
        return {
            name: {
                "value": figure.value if math.isfinite(figure.value) else None,
                "limit": figure.limit,
                "holds": figure.holds,
                "unit": figure.unit,
                "where": figure.text,
            }
            for name, figure in self.figures.items()
        }
