"""What a finger's links and bearings bear, in the stages' numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass

from casadi_hands.problem.units import Units, round_off
from casadi_hands.task import Task

_WITHIN = 0.85  # of a limit; links have a weight, too, and soft fingertips twist


@dataclass(frozen=True)
class Strength:
    """What the structure may be loaded with, within the task's limits.

    Attributes:
        moment: on a joint's bearing, across its axis, m·g·length.
        stress: in a link, m·g/length².
        deflection: of a fingertip, lengths.
        stiffness: Young's modulus of the links, m·g/length².
    """

    moment: float
    stress: float
    deflection: float
    stiffness: float

    @classmethod
    def of(cls, task: Task, units: Units) -> Strength:
        """That of a task."""
        limits, pressure = task.limits, units.force / units.length**2
        return cls(
            moment=round_off(_WITHIN * limits.bearing_moment / units.torque),
            stress=round_off(_WITHIN * limits.link_stress / pressure),
            deflection=round_off(_WITHIN * limits.tip_deflection / units.length),
            stiffness=round_off(task.hand.material.stiffness / pressure),
        )

    @property
    def parameters(self) -> dict[str, float]:
        """Of the blocks that hold a finger to it, by name."""
        return {
            "bearing_moment": self.moment,
            "link_stress": self.stress,
            "tip_deflection": self.deflection,
            "flexibility": 4 / (math.pi * self.stiffness),
        }
