"""An object that a joint holds to the world, as a folder's files have it: where it may be, and what moves it there.

A wrench does work along the joint's coordinate q by its product with the twist, the object's velocity at a speed of 1,
which is constant in the object's frame; the rest of it is borne by the world. Along q

    M q'' = twist · (contacts + weight + external) + friction - stiffness q - damping q'

Friction is the file's ``attachment_friction``, linear between samples; q is the cubic with the file's positions and
velocities at both. Momentum is balanced over every interval: the speeds with which the object leaves a sample and
arrives at the next follow from the distance between the two and from these forces.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.spatial.transform import Rotation

from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.reading.stored import as_array, brief, entry
from casadi_hands.verify.report import show

_POINTS, _WEIGHTS = leggauss(8)
SHARES, WEIGHTS = (_POINTS + 1) / 2, _WEIGHTS / 2


@dataclass(frozen=True)
class Held:
    """The joint in the world; a coordinate is an angle, rad, or of a slider a distance, m.

    Attributes:
        turns: whether the object turns with the coordinate.
        axis: (3,) unit, world.
        pivot: (3,) m, where its point is at a coordinate of 0, world.
        advance: m/rad, of a slider 1.
        position, rotation: of the object at a coordinate of 0.
        twist: (6,) velocity of the centre of mass and angular velocity, object frame, at a speed of 1.
        mass: kg·m², of a slider kg.
        friction, stiffness, damping: along the coordinate, SI.
    """

    turns: bool
    axis: np.ndarray
    pivot: np.ndarray
    advance: float
    position: np.ndarray
    rotation: Rotation
    twist: np.ndarray
    mass: float
    friction: float
    stiffness: float
    damping: float

    def place(self, coordinates: np.ndarray) -> tuple[np.ndarray, Rotation]:
        """Return positions (T, 3), m, and orientations of the object at coordinates (T,)."""
        along = np.outer(coordinates * self.advance, self.axis)
        turn = Rotation.from_rotvec(np.outer(coordinates * self.turns, self.axis))
        return self.pivot + turn.apply(self.position - self.pivot) + along, turn * self.rotation

    def coordinates(self, positions: np.ndarray, rotations: Rotation) -> np.ndarray:
        """Return the coordinates (T,) of poses near the joint, continuous from 0 at its start."""
        if not self.turns:
            return np.asarray((positions - self.position) @ self.axis)
        turned = (rotations * self.rotation.inv()).as_quat(scalar_first=True)
        return np.unwrap(2 * np.arctan2(turned[:, 1:] @ self.axis, turned[:, 0]), period=2 * np.pi)

    def unit(self, folder: Folder) -> float:
        """Return the unit of what acts along the coordinate: N·m, or of a slider N."""
        return folder.weight * (folder.length if self.turns else 1.0)

    def fast(self, folder: Folder) -> float:
        """Return the speed of the coordinate from which on it moves."""
        return 0.03 * (1.0 if self.turns else folder.length)


def held(folder: Folder) -> Held | None:
    """Return the joint that the task holds the object with; None of a free object."""
    attached = folder.task.object.attached
    if attached is None:
        return None
    joint, first = attached.joint, folder.task.motion[0]
    rotation, position = Rotation.from_rotvec(first.rotation.vector), np.asarray(first.position, dtype=float)
    axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
    point = np.array(getattr(joint, "point", (0.0, 0.0, 0.0)))
    turns = attached.slider is None
    spin = axis if turns else np.zeros(3)
    advance = 1.0 if not turns else attached.screw.pitch / (2 * np.pi) if attached.screw is not None else 0.0
    velocity = np.cross(spin, -point) + advance * axis
    dry = attached.slider.friction_force if attached.slider else getattr(joint, "friction_torque", 0.0)
    return Held(
        turns=turns,
        axis=rotation.apply(axis),
        pivot=position + rotation.apply(point),
        advance=advance,
        position=position,
        rotation=rotation,
        twist=np.concatenate([velocity, spin]),
        mass=float(folder.object.mass * velocity @ velocity + spin @ folder.object.inertia @ spin),
        friction=dry,
        stiffness=joint.stiffness,
        damping=joint.damping,
    )


@dataclass(frozen=True)
class Course:
    """How the object goes along its joint at the samples, (S,) each: coordinate, speed, and friction along it."""

    position: np.ndarray
    velocity: np.ndarray
    friction: np.ndarray


def course(folder: Folder, joint: Held) -> Course:
    """Return what the file states; where it states nothing, what its poses say, without friction."""
    motion = folder.motion
    position, velocity, friction = motion.attachment_position, motion.attachment_velocity, motion.attachment_friction
    if position is None or velocity is None or friction is None:
        rotations = Rotation.from_quat(motion.object_orientation, scalar_first=True)
        position = joint.coordinates(motion.object_position, rotations)
        return Course(position, np.gradient(position, motion.time), np.zeros_like(position))
    return Course(position, velocity, friction)


def _stated_problems(folder: Folder, joint: Held, stated: Any) -> list[str]:
    """Where the joint of ``result.json`` is not the task's."""
    attached = folder.task.object.attached
    assert attached is not None
    if entry(stated, "joint") != attached.kind:
        return [f"attached: result.json says {brief(entry(stated, 'joint'))}, task.yaml says {attached.kind}"]
    back = joint.rotation.inv()
    due: dict[str, Any] = {
        "axis": back.apply(joint.axis),
        "friction": joint.friction,
        "stiffness": joint.stiffness,
        "damping": joint.damping,
    }
    if joint.turns:
        due |= {"point": back.apply(joint.pivot - joint.position), "advance": joint.advance}
    return [
        f"attached: {name} is {brief(entry(stated, name))} in result.json, which is not the task's"
        for name, value in due.items()
        if not _agrees(entry(stated, name), np.asarray(value), 1e-6 * max(folder.length, float(np.abs(value).max())))
    ]


def _agrees(stated: Any, due: np.ndarray, close: float) -> bool:
    found = as_array(stated, due.shape)
    return found is not None and bool(np.all(np.abs(found - due) <= close))


def joint_problems(folder: Folder) -> list[str]:
    """Return where the object is not on its joint, or the file does not say how it goes along it, a sentence each."""
    joint, motion = held(folder), folder.motion
    names = ("attachment_position", "attachment_velocity", "attachment_friction")
    given = [name for name in names if getattr(motion, name) is not None]
    stated = entry(folder.result, "attached")
    if joint is None:
        problems = [] if stated is None else ["attached: result.json has a joint, task.yaml has none"]
        return problems + [f"{name}: in motion.npz, though the object is attached to nothing" for name in given]
    problems = _stated_problems(folder, joint, stated)
    problems += [f"{name}: missing, though a joint holds the object" for name in names if name not in given]
    due, turn = joint.place(course(folder, joint).position)
    off = np.linalg.norm(motion.object_position - due, axis=1) / folder.length
    angle = (turn.inv() * Rotation.from_quat(motion.object_orientation, scalar_first=True)).magnitude()
    k = int(np.argmax(off + angle))
    if not off[k] + angle[k] <= 1e-6:
        problems.append(
            f"object_position: at {motion.time[k]:.3g} s the object is {show(off[k] * folder.length, 'm')} and "
            f"{np.degrees(angle[k]):.2g}° off the joint that holds it"
        )
    return problems
