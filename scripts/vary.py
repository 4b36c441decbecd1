"""A task file, changed a little: another size and mass of the object, other goals and contacts."""

from __future__ import annotations

import io
import zlib
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML
from scipy.spatial.transform import Rotation as Turn

from casadi_hands.errors import HandsError, TaskError
from casadi_hands.geometry.bodies import Body
from casadi_hands.task import Task, parse_task
from casadi_hands.task.object import ManipulatedObject
from casadi_hands.task.rotation import UPRIGHT, Rotation, rotation_matrix
from casadi_hands.task.textfile import read
from casadi_hands.task.yamlfile import TaskFile

SIZE, MASS, GOAL, TURN, CONTACT = 0.2, 0.3, 0.2, 0.2, 15.0
"""Largest change: shares, and degrees for contacts."""
_TRIES = 200
_RESTING = 1e-3  # lengths above the ground: less is the rounding of numbers typed by hand
_DIGITS = 9


@dataclass(frozen=True)
class Change:
    """What is different.

    Attributes:
        size, mass: factors of the object.
        goal, turn: factors of the goals' displacement and turn from the first goal.
        contacts: for each finger, how far its contact moves, degrees, and in which direction along the surface, rad.
    """

    size: float
    mass: float
    goal: float
    turn: float
    contacts: dict[str, tuple[float, float]]

    def __str__(self) -> str:
        """The change in a line."""
        farthest = max(abs(degrees) for degrees, _ in self.contacts.values())
        return (
            f"object × {self.size:.2f}, mass × {self.mass:.2f}, displacements × {self.goal:.2f}, "
            f"turns × {self.turn:.2f}, contacts moved by up to {farthest:.0f}°"
        )


def write_variation(file: Path, number: int, seed: int, folder: Path) -> tuple[Path, Change]:
    """Write a variation of a task file as a task file of its own.

    Changes are drawn until the file is a task whose fingertips fit side by side and above the ground: others could
    not be solved by any hand, and say nothing.

    Args:
        file: the task file.
        number: of the variation; file, seed and number fix it.
        seed: of the series.
        folder: where it is written, as ``NAME-variationN.yaml``.

    Raises:
        TaskError: the file is not a task.
        HandsError: no such change was found.
    """
    text = read(file)
    parse_task(text, str(file), file.stem)
    data = TaskFile(text, str(file)).data
    random = np.random.default_rng([seed, number, zlib.crc32(file.stem.encode())])
    for _ in range(_TRIES):
        change = draw_change(random, list(data["fingers"]))
        made = varied(data, change)
        made["name"] = f"{data.get('name', file.stem)}, variation {number}"
        body = f"# Variation {number} of {file.name} (seed {seed}): {change}.\n{_yaml(made)}"
        try:
            task = parse_task(body)
        except TaskError:
            continue
        if fingertips_fit(task):
            target = folder / f"{file.stem}-variation{number}.yaml"
            folder.mkdir(parents=True, exist_ok=True)
            target.write_text(body, encoding="utf-8")
            return target, change
    raise HandsError(f"{file}: none of {_TRIES} changes gives a task that can be done")


def draw_change(random: np.random.Generator, fingers: list[str]) -> Change:
    """Draw every change, evenly within its limits."""
    size, mass, goal, turn = (1 + random.uniform(-width, width) for width in (SIZE, MASS, GOAL, TURN))
    contacts = {name: (random.uniform(-CONTACT, CONTACT), random.uniform(0, np.pi)) for name in fingers}
    return Change(size, mass, goal, turn, contacts)


def varied(data: dict[str, Any], change: Change) -> dict[str, Any]:
    """The content of a task file with a change made to it; defaults that were not written stay so, and follow.

    The object grows about the origin of its frame, and everything given in that frame with it. Goals keep the first
    one; above a ground it is the clearance that is scaled, so that an object that rests at a goal rests there again.
    """
    made = deepcopy(data)
    body = ManipulatedObject.model_validate(data["object"])
    made["object"] = _vary_object(data["object"], body, change)
    for name, finger in made["fingers"].items():
        moved = move_contact(body, np.array(finger["touches"], dtype=float), *change.contacts[name])
        finger["touches"] = _plain(change.size * moved)
    if "tool" in data:
        made["tool"] = _plain(change.size * np.array(data["tool"]))
    ground = data.get("ground")
    if isinstance(ground, dict) and "touches" in ground:
        made["ground"]["touches"] = _plain(change.size * np.array(ground["touches"]))
    height = float(ground.get("height", 0.0)) if isinstance(ground, dict) else None
    made["motion"] = _vary_motion(data["motion"], body, height, change)
    start = np.array(data["palm"]["position"])
    # A palm that moves does so to follow the object.
    for point in made["palm"].get("motion") or ():
        point["position"] = _plain(start + change.goal * (np.array(point["position"]) - start))
    return made


def move_contact(body: ManipulatedObject, point: np.ndarray, degrees: float, heading: float) -> np.ndarray:
    """Move a contact along the surface of its primitive.

    It turns about the nearest point of the primitive's core and is put back on the surface. (About the object's
    middle, 15 degrees would take a contact on a pencil to the pencil's other side.)

    Args:
        body: the object.
        point: (3,) near its surface, m, object frame.
        degrees: by which it turns.
        heading: direction along the surface, rad.

    Returns:
        (3,) on the surface.
    """
    solid = _touched(body, point)
    out = solid.outward(point)
    across = np.linalg.svd(out[None])[2][1:]
    axis = np.cos(heading) * across[0] + np.sin(heading) * across[1]
    return solid.on_surface(solid.core_point(point) + solid.ball * rotation_matrix(np.radians(degrees) * axis) @ out)


def _touched(body: ManipulatedObject, point: np.ndarray) -> Body:
    """The primitive whose surface is nearest to a point (3,)."""
    solids: list[Body] = [shape.body for shape in body.shapes]
    return min(solids, key=lambda each: abs(each.signed_distance(point)))


def fingertips_fit(task: Task) -> bool:
    """Whether fingertips fit at all contacts at the start: beside each other and above the ground."""
    radius = task.fingertip.radius
    _, position, vector = task.goal_poses()[0]
    tips = []
    for finger in task.fingers.values():
        point = np.array(finger.point)
        out = _touched(task.object, point).outward(point)
        tips.append(position + rotation_matrix(vector) @ (point + radius * out))
    apart = all(np.linalg.norm(a - b) >= 2 * radius for i, a in enumerate(tips) for b in tips[:i])
    above = task.ground is None or all(tip[2] - radius >= task.ground.height for tip in tips)
    return apart and above


def _vary_object(data: dict[str, Any], body: ManipulatedObject, change: Change) -> dict[str, Any]:
    made = {**data, "mass": round(change.mass * data["mass"], _DIGITS), "shapes": []}
    for shape in body.shapes:
        ((kind, fields),) = shape.model_dump().items()
        scaled = {name: _plain(change.size * np.array(value)) for name, value in fields.items()}
        made["shapes"].append({kind: scaled})
    if "center_of_mass" in data:
        made["center_of_mass"] = _plain(change.size * np.array(data["center_of_mass"]))
    if "inertia" in data:
        # Not rounded: moments of inertia of small objects have few digits before the ninth.
        made["inertia"] = (change.mass * change.size**2 * np.array(data["inertia"])).tolist()
    return made


def _vary_motion(
    goals: list[dict[str, Any]], body: ManipulatedObject, height: float | None, change: Change
) -> list[dict[str, Any]]:
    """The goals, displaced and turned more or less from the first one."""
    made = deepcopy(goals)
    where = "tool_at" if "tool_at" in goals[0] else "position"
    start = np.array(goals[0][where], dtype=float)
    first = _rotation(goals[0]).vector
    for old, new in zip(goals, made, strict=True):
        place = start + change.goal * (np.array(old[where]) - start)
        if where == "position":
            rotation = _rotation(old)
            vector = scaled_turn(first, rotation.vector, change.turn)
            if height is not None:
                clearance = _clearance(body, np.array(old["position"]), rotation.matrix, height)
                rests = abs(clearance) <= _RESTING * body.characteristic_length
                turned = rotation_matrix(vector)
                lowest = turned @ (change.size * body.lowest_point(turned))
                place[2] = height + (0.0 if rests else change.goal * clearance) - lowest[2]
            _set_rotation(new, vector)
        new[where] = _plain(place)
    return made


def scaled_turn(first: np.ndarray, vector: np.ndarray, factor: float) -> np.ndarray:
    """An orientation turned ``factor`` times as far from the first one; all rotation vectors (3,), rad.

    About one axis, turns beyond 180 degrees keep their way round.
    """
    if np.linalg.norm(np.cross(first, vector)) <= 1e-9 * np.linalg.norm(first) * np.linalg.norm(vector):
        straight: np.ndarray = first + factor * (vector - first)
        return straight
    start = Turn.from_rotvec(first)
    between = (Turn.from_rotvec(vector) * start.inv()).as_rotvec()
    turned: np.ndarray = (Turn.from_rotvec(factor * between) * start).as_rotvec()
    return turned


def _clearance(body: ManipulatedObject, position: np.ndarray, rotation: np.ndarray, height: float) -> float:
    """Height of the object's lowest point above the ground, m."""
    return float((position + rotation @ body.lowest_point(rotation))[2]) - height


def _rotation(goal: dict[str, Any]) -> Rotation:
    return Rotation.model_validate(goal["rotation"]) if "rotation" in goal else UPRIGHT


def _set_rotation(goal: dict[str, Any], vector: np.ndarray) -> None:
    angle = float(np.linalg.norm(vector))
    goal.pop("rotation", None)
    if angle > 0:
        goal["rotation"] = {"axis": _plain(vector / angle), "degrees": round(float(np.degrees(angle)), _DIGITS)}


def _plain(value: np.ndarray) -> Any:
    """Numbers for the file; without minus zeros."""
    return (np.round(value, _DIGITS) + 0.0).tolist()


def _yaml(data: dict[str, Any]) -> str:
    yaml = YAML(typ="rt")
    yaml.default_flow_style = None  # lists of numbers on one line
    yaml.width = 1000
    stream = io.StringIO()
    yaml.dump(data, stream)
    return stream.getvalue()
