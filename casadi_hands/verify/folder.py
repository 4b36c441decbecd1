"""Read a result folder as any other program would: from its files alone."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from casadi_hands.design import Motion
from casadi_hands.errors import DesignError
from casadi_hands.task import Task, load_task
from casadi_hands.verify.shapes import Body, ground_body, read_bodies

STANDARD_GRAVITY = 9.81
"""m/s²; scales forces when the task has no gravity."""


@dataclass(frozen=True)
class Folder:
    """One result folder in memory.

    Attributes:
        path: the folder.
        task: from ``task.yaml``.
        motion: from ``motion.npz``.
        result: ``result.json``.
        links: URDF link name -> body, palm first.
        object: from ``object.urdf``; its frame's origin is the centre of mass.
        model: numeric Pinocchio model of ``hand.urdf``; its world is the palm's frame.
    """

    path: Path
    task: Task
    motion: Motion
    result: dict[str, Any]
    links: dict[str, Body]
    object: Body
    model: pin.Model

    @cached_property
    def length(self) -> float:
        """Half the object's largest extent, m: the unit of lever arms."""
        low = np.min([np.minimum(s.start, s.end) - s.radius for s in self.object.capsules], axis=0)
        high = np.max([np.maximum(s.start, s.end) + s.radius for s in self.object.capsules], axis=0)
        return 0.5 * float(np.max(high - low))

    @cached_property
    def gravity(self) -> np.ndarray:
        """(3,) m/s², world."""
        return np.asarray(self.task.gravity, dtype=float)

    @cached_property
    def weight(self) -> float:
        """The unit of force, N: m·g, and m·9.81 when the task has no gravity."""
        return float(self.task.object.mass) * (float(np.linalg.norm(self.gravity)) or STANDARD_GRAVITY)

    @cached_property
    def ground(self) -> Body | None:
        """The ground as a body, or None."""
        return None if self.task.ground is None else ground_body(float(self.task.ground.height))

    def friction(self, contact: int) -> float:
        """Return the friction coefficient of the contact with this index."""
        if self.motion.contact_link[contact] == "ground" and self.task.ground is not None:
            return float(self.task.ground.friction)
        return float(self.task.friction)

    def joint_columns(self) -> list[int]:
        """Return, for each column of the motion's angles, its index in the model's configuration."""
        return [self.model.joints[self.model.getJointId(name)].idx_q for name in self.motion.joint_names]

    def call(self, body: str) -> str:
        """Return a body's name as the user knows it: ``finger0_link1`` -> ``finger 'thumb' (link 1)``."""
        finger, _, link = body.partition("_link")
        if not link:
            return f"the {body}"
        names = list(self.task.fingers)
        index = int(finger.removeprefix("finger"))
        return f"finger '{names[index] if index < len(names) else index}' (link {link})"


def read_folder(directory: str | Path) -> Folder:
    """Read a result folder.

    Raises:
        DesignError: a file is missing or unreadable, an array has the wrong shape, or a name has no counterpart.
        TaskError: ``task.yaml`` is not a task.
    """
    path = Path(directory)
    if not path.is_dir():
        raise DesignError(f"{path}: not a directory")
    for name in ("task.yaml", "hand.urdf", "object.urdf", "motion.npz", "result.json"):
        if not (path / name).is_file():
            raise DesignError(f"{path / name}: missing; the design has no complete motion to check")
    links = read_bodies(path / "hand.urdf")
    bodies = read_bodies(path / "object.urdf")
    if "object" not in bodies or not bodies["object"].capsules or bodies["object"].cylinders:
        raise DesignError(f"{path / 'object.urdf'}: no link 'object' made of spheres and capsules")
    try:
        result = json.loads((path / "result.json").read_text(encoding="utf-8"))
        model = pin.buildModelFromUrdf(str(path / "hand.urdf"))
    except ValueError as error:
        raise DesignError(f"{path}: {error}") from None
    if not isinstance(result, dict) or result.get("format") != 1:
        raise DesignError(f"{path / 'result.json'}: not a result of format 1")
    motion = _read_motion(path / "motion.npz")
    folder = Folder(path, load_task(path / "task.yaml"), motion, result, links, bodies["object"], model)
    _check_names(folder)
    return folder


def _read_motion(path: Path) -> Motion:
    names: list[str] = []
    optional: list[str] = []
    for name, item in Motion.__dataclass_fields__.items():
        (optional if item.default is None else names).append(name)
    try:
        with np.load(path, allow_pickle=False) as file:
            missing = [name for name in names if name not in file]
            if missing:
                raise DesignError(f"{path}: no array {', '.join(missing)}")
            arrays = {name: file[name] for name in [*names, *optional] if name in file}
    except (OSError, ValueError) as error:
        raise DesignError(f"{path}: not a NumPy archive: {error}") from None
    samples, joints, contacts = (arrays[key].size for key in ("time", "joint_names", "contact_names"))
    shapes = {
        "time": (samples,),
        "object_position": (samples, 3),
        "object_orientation": (samples, 4),
        "base_position": (samples, 3),
        "base_orientation": (samples, 4),
        "joint_angles": (samples, joints),
        "joint_names": (joints,),
        "contact_names": (contacts,),
        "contact_link": (contacts,),
        "contact_active": (samples, contacts),
        "contact_force": (samples, contacts, 3),
        "contact_point_object": (samples, contacts, 3),
        "contact_point_link": (samples, contacts, 3),
        "external_force": (samples, 3),
        "external_torque": (samples, 3),
        "joint_velocities": (samples, joints),
        "joint_torques": (samples, joints),
        "joint_commands": (samples, joints),
        "contact_force_disturbed": (samples, contacts, 3),
        "external_force_disturbed": (samples, 3),
        "external_torque_disturbed": (samples, 3),
    }
    for name, shape in shapes.items():
        if name not in arrays:
            continue
        if arrays[name].shape != shape:
            raise DesignError(f"{path}: {name} has shape {arrays[name].shape}, not {shape}")
        if arrays[name].dtype.kind == "f" and not np.all(np.isfinite(arrays[name])):
            raise DesignError(f"{path}: {name} holds a number that is not finite")
    if samples < 3 or not np.all(np.diff(arrays["time"]) > 0):
        raise DesignError(f"{path}: time must hold at least three increasing samples")
    if min(np.linalg.norm(arrays[f"{who}_orientation"], axis=1).min() for who in ("object", "base")) < 1e-3:
        raise DesignError(f"{path}: an orientation is the zero quaternion")
    words = {name: tuple(str(word) for word in arrays[name]) for name in names if arrays[name].dtype.kind in "US"}
    return Motion(**{**arrays, **words, "contact_active": arrays["contact_active"].astype(bool)})


def _check_names(folder: Folder) -> None:
    motion, model = folder.motion, folder.model
    if sorted(motion.joint_names) != sorted(model.names[1:]):
        raise DesignError(
            f"{folder.path / 'motion.npz'}: joint_names {list(motion.joint_names)} are not the joints of hand.urdf,"
            f" {list(model.names)[1:]}"
        )
    for name, link in zip(motion.contact_names, motion.contact_link, strict=True):
        if link == "ground" and folder.ground is None:
            raise DesignError(f"{folder.path / 'motion.npz'}: contact '{name}' is with the ground; the task has none")
        if link != "ground" and link not in folder.links:
            raise DesignError(f"{folder.path / 'motion.npz'}: contact '{name}' is on '{link}', no link of hand.urdf")
