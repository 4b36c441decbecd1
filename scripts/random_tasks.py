"""Random tasks, each of a number alone: objects, contacts, goals and limits as people might give them, or nearly."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

Fields = dict[str, Any]


def random_task(number: int) -> str:
    """A task file; its object, its fingers, what it asks for and what it limits follow from the number.

    Args:
        number: any.
    """
    rng = np.random.default_rng((24, number))
    size = float(np.exp(rng.uniform(math.log(0.008), math.log(0.06))))
    shape, touched = _object(rng, size)
    density = float(np.exp(rng.uniform(math.log(100), math.log(4000))))
    mass = round(density * 4 * size**3, 6)
    away = float(rng.uniform(2.5, 5.0)) * size
    fields: Fields = {
        "name": f"random {number}",
        "object": {"mass": mass, "shapes": [shape]},
        "palm": {
            "radius": _round(rng.uniform(0.8, 2.0) * size),
            "position": [0, 0, _round(away)],
            "facing": [0, 0, -1],
        },
        "motion": _motion(rng, size),
        "fingers": {f"f{i}": {"touches": point} for i, point in enumerate(touched)},
        "friction": _round(rng.uniform(0.3, 1.2)),
        "search": {"trials": 4, "recombinations": 2, "max_joints": int(rng.integers(2, 4)), "seed": number},
    }
    return json.dumps(fields | _limits(rng, size, mass), indent=1)


def _object(rng: np.random.Generator, size: float) -> tuple[Fields, list[list[float]]]:
    """A shape of about this half width (m), upright, and where fingers touch it."""
    half = size * float(rng.uniform(0.5, 2.0))
    low, high = [0, 0, _round(-half)], [0, 0, _round(half)]
    kind = rng.choice(["sphere", "capsule", "cylinder", "box"])
    shapes: dict[str, Fields] = {
        "sphere": {"center": [0, 0, 0], "radius": _round(size)},
        "capsule": {"start": low, "end": high, "radius": _round(size)},
        "cylinder": {"start": low, "end": high, "radius": _round(size)},
        "box": {"center": [0, 0, 0], "size": [_round(2 * size), _round(2 * size), _round(2 * half)]},
    }
    count = int(rng.choice([2, 3, 3, 3, 4, 5]))
    height = float(rng.uniform(-0.3, 0.1)) * size
    turn = float(rng.uniform(0, 2 * math.pi))
    points = []
    for i in range(count):
        angle = turn + 2 * math.pi * i / count + float(rng.normal(0, 0.15))
        points.append([_round(size * math.cos(angle)), _round(size * math.sin(angle)), _round(height)])
    return {str(kind): shapes[str(kind)]}, points


def _motion(rng: np.random.Generator, size: float) -> list[Fields]:
    """Goals: moved, turned, or the same again, sometimes for long."""
    time, position, degrees = 0.0, np.zeros(3), 0.0
    axis = [_round(x) for x in rng.normal(size=3)]
    goals: list[Fields] = [{"at": 0, "position": [0, 0, 0]}]
    for _ in range(int(rng.integers(1, 4))):
        what = rng.choice(["moved", "turned", "both", "still"])
        time += float(rng.uniform(0.6, 3.0)) * (1 if what != "still" or rng.random() < 0.5 else 10)
        if what in ("moved", "both"):
            position = position + rng.normal(0, 0.5 * size, 3)
        if what in ("turned", "both"):
            degrees = float(np.clip(degrees + rng.normal(0, 30), -200, 200))
        goal: Fields = {"at": _round(time), "position": [_round(x) for x in position]}
        goals.append(goal | ({"rotation": {"axis": axis, "degrees": _round(degrees)}} if degrees else {}))
    return goals


def _limits(rng: np.random.Generator, size: float, mass: float) -> Fields:
    """What else a task may say, each now and then."""
    weight, chance = 9.81 * mass, rng.random(6)
    angles = rng.uniform(0, 2 * math.pi, 2)
    found: Fields = {}
    if chance[0] < 0.15:
        found["gravity"] = [0, 0, 0]
    if chance[1] < 0.2:
        found["actuator"] = {"torque": _round(weight * size * float(np.exp(rng.normal(1, 1)))), "speed": 10.0}
    if chance[2] < 0.2:
        push = [_round(0.3 * weight * math.cos(angles[0])), _round(0.3 * weight * math.sin(angles[0])), 0]
        found["perturbations"] = [{"from": 0.2, "to": 0.5, "force": push}]
    if chance[3] < 0.2:
        found["hand"] = {"joint_limits": [-_round(rng.uniform(20, 120)), _round(rng.uniform(20, 120))]}
    if chance[4] < 0.1:
        found["fingertip"] = {"torsion": 0}
    if chance[5] < 0.15:
        found["limits"] = {"slip": 0.001, "goal_position": 0.002}
    return found


def _round(number: float) -> float:
    return float(f"{number:.5g}")
