"""What a task shows before anything is solved: reasons why no hand can do it, or why hardly one will."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from casadi_hands.diagnosis.reason import Reason
from casadi_hands.problem.model import Model

WANDER = 0.65
"""Characteristic lengths by which stages may move a contact away from where the task puts it: a ball's, put 50° above
its equator, were moved by 0.6 of them in an experiment, and those 75° above it stayed there."""


@dataclass(frozen=True)
class Finding:
    """What a task shows.

    Attributes:
        reason: what is found, with numbers, and what to try.
        certain: whether it keeps any hand from the task; else it is a question.
    """

    reason: Reason
    certain: bool = True


def found(what: str, advice: str, certain: bool = True) -> Finding:
    """A finding, with what to try."""
    return Finding(Reason(what, advice, root=True), certain)


def mm(model: Model, lengths: float) -> str:
    """Lengths in mm, with the unit."""
    return f"{1e3 * lengths * model.units.length:.4g} mm"


def numbers(values: Sequence[float]) -> str:
    """``[0, 0, -1]``."""
    return f"[{', '.join(f'{value + 0.0:g}' for value in values)}]"
