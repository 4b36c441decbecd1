"""Read a result folder as any other program would: from its files alone."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from casadi_hands.errors import DesignError
from casadi_hands.problem.motion import Motion
from casadi_hands.problem.stored import LARGEST_TEXT, check_samples, read_bytes
from casadi_hands.task import Task, load_task
from casadi_hands.verify.bodies import Body, ground_body
from casadi_hands.verify.forms import FORMS
from casadi_hands.verify.reading.drive import Drive, read_drive
from casadi_hands.verify.reading.robot import Joint, Robot, read_robot
from casadi_hands.verify.reading.scene_file import Scene, read_scene
from casadi_hands.verify.reading.stored import entry, read_motion, read_record

STANDARD_GRAVITY = 9.81
"""m/s²; scales forces when the task has no gravity."""

FARTHEST_TURN = 1e6
"""rad; of a turn beyond, rounding leaves nothing."""


@dataclass(frozen=True)
class Folder:
    """One result folder in memory.

    Attributes:
        path: the folder.
        task: by which the folder is judged: from ``task.yaml``, or a file that the user trusts.
        written: from ``task.yaml``.
        trusted: the file that the user trusts, or None.
        motion: from ``motion.npz``.
        result: ``result.json``.
        links: URDF link name -> body, palm first.
        joints: URDF joint name -> joint.
        object: from ``object.urdf``; its frame's origin is the centre of mass.
        scene: from ``scene.xml``; None where there is none.
        task_hash: SHA-256 of ``task.yaml``.
        strange: what the two URDF files hold that the format does not have, a sentence each.
        drive: of motors that share joints, from ``result.json``; None where every joint has its own.
        model: numeric Pinocchio model of ``hand.urdf``; its world is the palm's frame.
    """

    path: Path
    task: Task
    written: Task
    trusted: Path | None
    motion: Motion
    result: dict[str, Any]
    links: dict[str, Body]
    joints: dict[str, Joint]
    object: Body
    scene: Scene | None
    task_hash: str
    strange: tuple[str, ...]
    drive: Drive | None
    model: pin.Model

    @cached_property
    def length(self) -> float:
        """Half the object's largest extent, m: the unit of lever arms."""
        boxes = np.array([shape.box for shape in self.object.shapes])
        return 0.5 * float(np.max(boxes[:, 1].max(axis=0) - boxes[:, 0].min(axis=0)))

    @cached_property
    def gravity(self) -> np.ndarray:
        """(3,) m/s², world."""
        return np.asarray(self.task.gravity, dtype=float)

    @cached_property
    def weight(self) -> float:
        """The unit of force, N: m·g, and m·9.81 when the task has no gravity.

        Where the object's joint resists with more at a goal, or the object exerts more on the world, as much as that; a
        torque is a force at the unit of lever arms.
        """
        weight = float(self.task.object.mass) * (float(np.linalg.norm(self.gravity)) or STANDARD_GRAVITY)
        loads, attached, motion = [weight], self.task.object.attached, self.motion
        for goal in self.task.motion:
            if goal.exert is not None:
                loads.append(float(np.linalg.norm(goal.exert.force)))
                loads.append(float(np.linalg.norm(goal.exert.torque)) / self.length)
        if attached is not None:
            joint, lever = attached.joint, 1.0 if attached.slider is not None else self.length
            travel = 0.0
            if motion.attachment_position is not None:
                times = np.array([goal.at for goal in self.task.motion])
                travel = float(np.abs(np.interp(times, motion.time, motion.attachment_position)).max())
            loads.append((joint.friction + joint.stiffness * travel) / lever)
        return max(loads)

    @cached_property
    def speed_unit(self) -> float:
        """The unit of speed, m/s: half the object's extent, fallen from rest, gives it the square root of two of it."""
        return float(np.sqrt(self.weight / self.task.object.mass * self.length))

    @cached_property
    def ground(self) -> Body | None:
        """The ground as a body, or None."""
        return None if self.task.ground is None else ground_body(float(self.task.ground.height))

    @cached_property
    def fingers(self) -> list[str]:
        """The task's names of the hand's fingers; a finger of the task whose contact never acts is not built."""
        return [name for name in self.task.fingers if name in self.motion.contact_names]

    def partner(self, contact: int) -> Body:
        """Return the body that the object touches at the contact with this index: a link, or the ground."""
        link = self.motion.contact_link[contact]
        if link != "ground":
            return self.links[link]
        assert self.ground is not None  # or the folder would not have been read
        return self.ground

    @property
    def legacy(self) -> bool:
        """Whether an earlier version wrote the folder, which said less."""
        return bool(self.unstated)

    @cached_property
    def unstated(self) -> tuple[str, ...]:
        """What an earlier version did not state in ``result.json``: the task's hash, bends of links."""
        fingers = entry(self.result, "hand", "fingers")
        links = [entry(finger, "links") for finger in (fingers if isinstance(fingers, list) else ())]
        stated = [link for each in links if isinstance(each, list) for link in each if isinstance(link, dict)]
        absent = {"task_hash": "task_hash" not in self.result, "bend": not all("bend" in link for link in stated)}
        return tuple(name for name, lacks in absent.items() if lacks)

    def friction(self, contact: int) -> float:
        """Return the friction coefficient of the contact with this index."""
        if self.motion.contact_link[contact] == "ground" and self.task.ground is not None:
            return float(self.task.ground.friction)
        return float(self.task.friction)

    def joint_columns(self) -> list[int]:
        """Return, for each column of the motion's angles, its index in the model's configuration."""
        return [self.model.joints[self.model.getJointId(name)].idx_q for name in self.motion.joint_names]

    def scenarios(self) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
        """Yield how to call it, the contact forces (S, C, 3) and the samples (S,) it is about, of each scenario.

        They are the plan, and the plan under the task's disturbances, at the samples where its forces are others.
        """
        plan, disturbed = self.motion.contact_force, self.motion.contact_force_disturbed
        yield "", plan, np.ones(len(self.motion.time), dtype=bool)
        if disturbed is not None:
            yield " under the task's perturbations", disturbed, np.any(disturbed != plan, axis=(1, 2))

    def call(self, body: str) -> str:
        """Return a body's name as the user knows it: ``finger0_link1`` -> ``finger 'thumb' (link 1)``."""
        finger, _, link = body.partition("_link")
        number = finger.removeprefix("finger")
        if not link or not number.isdecimal():
            return f"the {body}"
        index = int(number)
        return f"finger '{self.fingers[index] if index < len(self.fingers) else index}' (link {link})"


def read_folder(directory: str | Path, task: str | Path | None = None) -> Folder:
    """Read a result folder.

    Args:
        directory: the folder.
        task: the task file to judge by; the folder's own by default.

    Raises:
        DesignError: a file is missing or unreadable, an array has the wrong shape, or a name has no counterpart.
        TaskError: ``task.yaml``, or the file to judge by, is not a task.
    """
    path = Path(directory)
    if not path.is_dir():
        raise DesignError(f"{path}: not a directory")
    for name in ("task.yaml", "hand.urdf", "object.urdf", "motion.npz", "result.json"):
        if not (path / name).is_file():
            raise DesignError(f"{path / name}: missing; the design has no complete motion to check")
    hand, object_file = read_robot(path / "hand.urdf"), read_robot(path / "object.urdf")
    written = load_task(path / "task.yaml", within=True)
    motion, result = read_motion(path / "motion.npz"), read_record(path / "result.json")
    check_samples(path / "motion.npz", len(motion.time), written)
    motors = None if motion.motor_positions is None else motion.motor_positions.shape[1]
    folder = Folder(
        path=path,
        task=written if task is None else _numbered(load_task(task), written),
        written=written,
        trusted=None if task is None else Path(task),
        motion=motion,
        result=result,
        links=hand.links,
        joints=hand.joints,
        object=_object(path / "object.urdf", object_file),
        scene=read_scene(path / "scene.xml") if (path / "scene.xml").is_file() else None,
        task_hash=hashlib.sha256(read_bytes(path / "task.yaml", LARGEST_TEXT)).hexdigest(),
        drive=read_drive(path / "result.json", result, len(motion.joint_names), motors),
        strange=(*hand.strange, *object_file.strange),
        model=_model(path / "hand.urdf", hand),
    )
    _check_names(folder)
    for number, goal in enumerate(folder.task.motion, start=1):
        if not np.all(np.abs(goal.rotation.vector) < FARTHEST_TURN):
            raise DesignError(f"{task or path / 'task.yaml'}: goal {number} turns the object by more than can be told")
    return folder


def _numbered(task: Task, written: Task) -> Task:
    """The task with its fingers in the order of another that names the same; links are numbered by it."""
    if set(task.fingers) != set(written.fingers):
        return task
    return task.model_copy(update={"fingers": {name: task.fingers[name] for name in written.fingers}})


def _object(path: Path, robot: Robot) -> Body:
    """Return the object's body.

    Raises:
        DesignError: the file holds anything else, or the body has no surface.
    """
    if list(robot.links) != ["object"] or robot.joints:
        found = ", ".join([*(f"'{name}'" for name in robot.links), *(f"joint '{name}'" for name in robot.joints)])
        raise DesignError(f"{path}: holds {found or 'no link'}; it must hold one link 'object' and nothing else")
    body = robot.links["object"]
    if not body.shapes or not {type(shape) for shape in body.shapes} <= {form.shape for form in FORMS.values()}:
        *kinds, last = FORMS
        raise DesignError(f"{path}: no link 'object' made of shapes of the kinds {', '.join(kinds)} and {last}")
    return body


def _model(path: Path, robot: Robot) -> pin.Model:
    """Build the model of ``hand.urdf``.

    Raises:
        DesignError: its joints do not make a tree of its links that stands on the palm.
    """
    children = [joint.child for joint in robot.joints.values()]
    for name, joint in robot.joints.items():
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in robot.links:
                raise DesignError(f"{path}: the {role} of joint {name} is '{link}', no link of the file")
        if np.linalg.norm(joint.axis) < 1e-6:
            raise DesignError(f"{path}: joint {name} turns about no axis")
    if "palm" not in robot.links:
        raise DesignError(f"{path}: no link 'palm'")
    loose = [name for name in robot.links if name != "palm" and children.count(name) != 1]
    if loose or "palm" in children:
        raise DesignError(f"{path}: link '{(loose or ['palm'])[0]}' does not hang on one joint of the hand")
    above = {joint.child: joint.parent for joint in robot.joints.values()}
    for name in robot.links:
        link = name
        for _ in above:
            link = above.get(link, link)
        if link != "palm":
            raise DesignError(f"{path}: link '{name}' hangs in a ring, not on the palm")
    try:
        return pin.buildModelFromXML(robot.text)
    except (ValueError, RuntimeError) as error:
        raise DesignError(f"{path}: {error}") from None


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
        if link != "ground" and not folder.links[link].capsules:
            raise DesignError(f"{folder.path / 'hand.urdf'}: {folder.call(link)} has no capsule, which would touch")
