"""Tasks of one ball under a palm, to be spoilt."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from casadi_hands.diagnosis.finding import Finding
from casadi_hands.diagnosis.impossible import findings
from casadi_hands.problem.si import build_model
from casadi_hands.task import parse_task

RADIUS = 0.022
PALM = "radius: 0.0264, position: [0, 0, 0.3], facing: [0, 0, -1]"


def ring(*elevations: float, turn: float = 120.0) -> list[list[float]]:
    """Points on the ball at elevations above its equator, degrees, each turned on from the one before."""
    at = [(np.radians(up), np.radians(turn * k)) for k, up in enumerate(elevations)]
    return [[float(RADIUS * x) for x in (np.cos(u) * np.cos(a), np.cos(u) * np.sin(a), np.sin(u))] for u, a in at]


def seen(
    palm: str = PALM,
    goals: Sequence[str] = ("position: [0, 0, 0.2]", "position: [0, 0, 0.19]"),
    touches: Sequence[Sequence[float]] | None = None,
    more: str = "",
) -> list[Finding]:
    """What is found of a ball of 60 g and 22 mm radius, that fingers `f0`, `f1`, ... touch."""
    touches = ring(0, 0, 0) if touches is None else touches
    task = parse_task(
        f"""
object: {{mass: 0.06, shapes: [{{sphere: {{center: [0, 0, 0], radius: {RADIUS}}}}}]}}
palm: {{{palm}}}
motion: [{", ".join(f"{{at: {3 * k}, {goal}}}" for k, goal in enumerate(goals))}]
fingers: {{{", ".join(f"f{k}: {{touches: {list(point)}}}" for k, point in enumerate(touches))}}}
{more}
"""
    )
    return findings(task, build_model(task))


def told(found: list[Finding]) -> tuple[str, bool]:
    """The text of the only finding, and whether it is certain."""
    (only,) = found
    return only.reason.text, only.certain
