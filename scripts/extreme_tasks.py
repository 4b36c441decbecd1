"""Tasks at the edge of what is allowed: one that a hand can do, with one thing at a time made extreme."""

from __future__ import annotations

import json
import math
from typing import Any

from casadi_hands.task.limits import Limits

Fields = dict[str, Any]


def plain(radius: float = 0.03, mass: float = 0.1, fingers: int = 3, seconds: float = 2.0) -> Fields:
    """A ball that fingers hold a little below its equator and lift by a third of its radius; lengths go with its own.

    Args:
        radius: of the ball, m.
        mass: kg.
        fingers: evenly around it.
        seconds: that the motion takes.
    """
    low = math.radians(12)
    angles = [2 * math.pi * each / fingers for each in range(fingers)]
    touched = [[math.cos(a) * math.cos(low), math.sin(a) * math.cos(low), -math.sin(low)] for a in angles]
    return {
        "object": {"mass": mass, "shapes": [ball(radius)]},
        "palm": {"radius": 1.2 * radius, "position": [0, 0, 3.5 * radius], "facing": [0, 0, -1]},
        "motion": [{"at": 0, "position": [0, 0, 0]}, {"at": seconds, "position": [0, 0, radius / 3]}],
        "fingers": {f"f{i}": {"touches": [radius * x for x in point]} for i, point in enumerate(touched)},
        "friction": 0.7,
    }


def ball(radius: float, center: list[float] | None = None) -> Fields:
    """A sphere among an object's shapes; lengths in m."""
    return {"sphere": {"center": center or [0, 0, 0], "radius": radius}}


def needle() -> Fields:
    """A rod half a metre long and 2 mm thick, held at its middle."""
    task = plain(0.001, 0.01)
    task["object"]["shapes"] = [{"capsule": {"start": [0, -0.25, 0], "end": [0, 0.25, 0], "radius": 0.001}}]
    task["palm"] = {"radius": 0.03, "position": [0, 0, 0.06], "facing": [0, 0, -1]}
    places = ((-0.001, 0.0), (0.001, 0.02), (0.001, -0.02))
    task["fingers"] = {f"f{i}": {"touches": [x, y, 0]} for i, (x, y) in enumerate(places)}
    return task


def turned(degrees: float) -> list[Fields]:
    """Goals of a turn about the palm's normal, in 4 s."""
    turn = {"axis": [0, 0, 1], "degrees": degrees}
    return [{"at": 0, "position": [0, 0, 0]}, {"at": 4, "position": [0, 0, 0], "rotation": turn}]


def palm_at(height: float) -> Fields:
    """A palm above the ball, m."""
    return {"radius": 0.036, "position": [0, 0, height], "facing": [0, 0, -1]}


EXTREME: dict[str, Fields] = {
    "an object of 1 mm": plain(0.0005, 1e-6),
    "an object of 1 m": plain(0.5, 5.0),
    "1 g": plain(mass=0.001),
    "50 kg": plain(0.1, 50.0),
    "friction of 0.05": plain() | {"friction": 0.05},
    "friction of 2": plain() | {"friction": 2.0},
    "half a second": plain(seconds=0.5),
    "a minute": plain(seconds=60.0),
    "one finger": plain(fingers=1) | {"gravity": [0, 0, 0]},
    "eight fingers": plain(fingers=8),
    "30 primitives": plain() | {"object": {"mass": 0.1, "shapes": [ball(0.03, [0, 0, 0.0001 * i]) for i in range(30)]}},
    "goals that are the start": plain()
    | {"motion": [{"at": 0, "position": [0, 0, 0]}, {"at": 2, "position": [0, 0, 0]}]},
    "a turn of 299 degrees": plain() | {"motion": turned(299.0)},
    "a palm 1 mm above the object": plain() | {"palm": palm_at(0.041)},
    "all limits 0": plain() | {"limits": dict.fromkeys(Limits.model_fields, 0)},
    "joints of a thousandth of a degree": plain() | {"hand": {"joint_limits": [-0.001, 0.001]}},
    "motors of a thousandth of a newton metre": plain() | {"actuator": {"torque": 0.001}},
    "motors of a thousandth of a radian a second": plain() | {"actuator": {"speed": 0.001}},
    "motors as soft as rubber bands": plain() | {"actuator": {"stiffness": 0.001}},
    "no gravity": plain() | {"gravity": [0, 0, 0]},
    "200 samples a second": plain() | {"time_step": 0.005},
    "links of a millimetre": plain() | {"hand": {"link_length": [0.0005, 0.001], "link_radius": 0.0002}},
    "a palm 2 m away": plain() | {"palm": palm_at(2.0)},
    "ten weights from the side": plain() | {"perturbations": [{"from": 0.5, "to": 1.5, "force": [9.81, 0, 0]}]},
    "40 goals": plain() | {"motion": [{"at": 0.5 * i, "position": [0, 0, 0.001 * (i % 2)]} for i in range(40)]},
    "a needle of half a metre": needle(),
}


def text_of(kind: str) -> str:
    """The task file of one of ``EXTREME``: JSON is YAML."""
    return json.dumps({"name": kind, **EXTREME[kind]}, indent=1)
