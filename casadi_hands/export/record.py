"""``result.json``: the structure, the costs, the certificate and how they came about."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.errors import DesignError
from casadi_hands.export.checked import FORMAT
from casadi_hands.problem.drive import Drive
from casadi_hands.problem.hand import Finger, Hand, Link
from casadi_hands.problem.result import Result
from casadi_hands.task import task_to_yaml

if TYPE_CHECKING:
    from casadi_hands.task import Task

STATUSES = ("certified", "feasible", "failed")
_PACKAGES = ("casadi-hands", "casadi", "pin", "coal", "mujoco", "numpy")


def design_record(design: Result) -> dict[str, Any]:
    """All of ``result.json`` as plain lists and dictionaries; a number that is not finite becomes None.

    Args:
        design: whole or partial.
    """
    task = design.task
    record = {
        "format": FORMAT,
        "status": design.status,
        "reason": design.reason,
        "task": task.name,
        "task_hash": hashlib.sha256(task_to_yaml(task).encode("utf-8")).hexdigest(),
        "object": {
            "mass": task.object.mass,
            "inertia": np.asarray(task.object.inertia),
            "shapes": [_shape(shape) for shape in task.object.shapes],
        },
        "friction": task.friction,
        "gravity": task.gravity,
        "ground_height": task.ground.height if task.ground else None,
        "ground_friction": task.ground.friction if task.ground else None,
        "attached": _attached(task),
        "goals": _goals(task),
        "hand": _hand(design.hand) if design.hand else None,
        "degrees_of_freedom": design.hand.degrees_of_freedom if design.hand else None,
        "samples": len(design.motion.time) if design.motion else None,
        "costs": design.costs,
        "certificate": design.certificate,
        "replays": design.replays,
        "stages": design.stages,
        "seconds": design.seconds,
        "versions": _versions(),
    }
    plain: dict[str, Any] = _plain(record)
    return plain


def record_text(record: dict[str, Any]) -> str:
    """The record as indented JSON; strict, so that any reader of JSON can read it."""
    return json.dumps(record, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def hand_from_record(record: dict[str, Any]) -> Hand | None:
    """The hand of a record, or None where no stage has designed one.

    Args:
        record: what `design_record` returned, read back from JSON.

    Raises:
        DesignError: an entry is missing or of the wrong kind.
    """
    entry = record.get("hand")
    if entry is None:
        return None
    try:
        return Hand(
            palm_radius=float(entry["palm"]["radius"]),
            palm_thickness=float(entry["palm"]["thickness"]),
            fingers=tuple(
                Finger(
                    name=str(finger["name"]),
                    base=_vector(finger["base"]),
                    links=tuple(_link(link) for link in finger["links"]),
                )
                for finger in entry["fingers"]
            ),
            **{name: float(entry[name]) for name in _HAND_NUMBERS},
            servo=None if entry.get("servo") is None else str(entry["servo"]),
            drive=_drive_from_record(entry),
        )
    except KeyError as error:
        raise DesignError(f"the hand lacks {error}") from error
    except (TypeError, ValueError) as error:
        raise DesignError(f"the hand cannot be read: {error}") from error


def _drive_from_record(entry: dict[str, Any]) -> Drive | None:
    if entry.get("ratios") is None:
        return None
    return Drive(
        ratios=tuple(tuple(float(ratio) for ratio in row) for row in entry["ratios"]),
        offsets=tuple(float(offset) for offset in entry["offsets"]),
        effort=float(entry["motor_effort"]),
        velocity=float(entry["motor_velocity"]),
    )


_HAND_NUMBERS = ("joint_lower", "joint_upper", "effort", "velocity", "density")


def _hand(hand: Hand) -> dict[str, Any]:
    return {
        "palm": {"radius": hand.palm_radius, "thickness": hand.palm_thickness},
        "fingers": [
            {
                "name": finger.name,
                "base": finger.base,
                "links": [
                    {
                        "length": link.length,
                        "radius": link.radius,
                        "axis": link.turn.apply(link.axis) if any(link.bend) else link.axis,
                        "bend": link.bend,
                        "hinge": link.hinge,
                    }
                    for link in finger.links
                ],
            }
            for finger in hand.fingers
        ],
        **{name: getattr(hand, name) for name in _HAND_NUMBERS},
        **({} if hand.servo is None else {"servo": hand.servo}),
        "motors": hand.motors,
        **(_drive(hand.drive) if hand.drive else {}),
    }


def _drive(drive: Drive) -> dict[str, Any]:
    numbers = {"motor_effort": drive.effort, "motor_velocity": drive.velocity}
    return {"ratios": drive.ratios, "offsets": drive.offsets, **numbers}


def _shape(shape: Any) -> dict[str, Any]:
    given = shape.body.as_mapping()
    if shape.body.kind == "capsule" and np.array_equal(given["start"], given["end"]):
        return {"type": "sphere", "center": given["start"], "radius": given["radius"]}
    return {"type": shape.body.kind, **given}


def _attached(task: Task) -> dict[str, Any] | None:
    """The joint that holds the object to the world, axis and point in the object's frame."""
    if task.object.attached is None:
        return None
    joint = task.object.attached.joint
    turning = {"point": joint.pivot, "advance": joint.advance} if joint.turns else {}
    resisting = {"friction": joint.friction, "stiffness": joint.stiffness, "damping": joint.damping}
    return {"joint": task.object.attached.kind, "axis": joint.direction, **turning, **resisting}


def _goals(task: Task) -> list[dict[str, Any]]:
    if task.tool is not None:
        return [{"time": goal.at, "point": goal.tool_at, "tool_point": task.tool} for goal in task.motion]
    return [
        {
            "time": goal.at,
            "position": goal.position,
            "orientation": rotation_quaternion(goal.rotation.vector),
            **({"exert": goal.exert.model_dump()} if goal.exert else {}),
        }
        for goal in task.motion
    ]


def rotation_quaternion(vector: np.ndarray) -> np.ndarray:
    """Unit quaternion (4,), [w, x, y, z], of a rotation vector (3,), rad."""
    angle = float(np.linalg.norm(vector))
    # np.sinc(x) is sin(πx)/(πx), defined at 0.
    return np.array([np.cos(angle / 2), *(np.sinc(angle / (2 * np.pi)) / 2 * np.asarray(vector))])


def _link(link: Mapping[str, Any]) -> Link:
    """A link as recorded, its axis in its parent's frame; earlier folders tell no bend and no hinge, and have none."""
    x, y = (float(value) for value in link.get("bend", (0.0, 0.0)))
    axis = Rotation.from_rotvec([x, y, 0.0]).inv().apply(_vector(link["axis"])) if x or y else link["axis"]
    hinge = float(link.get("hinge", 0.0))
    return Link(float(link["length"]), float(link["radius"]), _vector(axis), (x, y), hinge)


def _vector(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def _plain(value: Any) -> Any:
    """The value in the types of JSON; arrays become lists, a number that is not finite None."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float):
        return value if isfinite(value) else None
    return value


@cache
def _versions() -> dict[str, str]:
    """Versions of this package and of its numerical dependencies, of those installed."""
    found = {}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
