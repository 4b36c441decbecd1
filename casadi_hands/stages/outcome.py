"""From nondimensional results back to SI: the hand and the motion that are written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from casadi_hands.design import Finger, Hand, Link, Motion
from casadi_hands.kinematics import STAND
from casadi_hands.motion import continuous
from casadi_hands.stages.finger_numbers import link_frames
from casadi_hands.stages.floating import Floating
from casadi_hands.stages.grasp import on_capsules
from casadi_hands.stages.model import Model, quaternion
from casadi_hands.stages.object_side import sampled_points
from casadi_hands.stages.palm_motion import poses_at
from casadi_hands.stages.synthesis import FingerSeed
from casadi_hands.stages.whole_hand import WholeHand
from casadi_hands.stages.whole_hand_numbers import (
    contact_jacobians,
    in_palm,
    in_world,
    object_rotation,
    turned_to_palm,
    turned_to_world,
)
from casadi_hands.task import Task

Array = NDArray[np.float64]
_RESERVE = 1.5  # of torque and speed limits over what the motion uses, where the task names no actuator
_LEAST = 0.01  # of the object's weight × half extent, and rad/s: no joint is so weak or slow that none could drive it


def hand_of(
    task: Task, model: Model, fingers: Sequence[FingerSeed], contacts: Sequence[int], effort: float, speed: float
) -> Hand:
    """The hand in SI; limits of the actuator if the task names one, else 1.5 times the motion's own torque and speed.

    Args:
        task: for what the stages do not know.
        model: for the units.
        fingers: morphology, nondimensional.
        contacts: index of each finger's contact.
        effort: largest joint torque of the motion, N·m.
        speed: largest joint speed of the motion, rad/s.
    """
    length = model.units.length
    built = []
    for finger, contact in zip(fingers, contacts, strict=True):
        links = tuple(
            Link(float(part * length), model.link_radius * length, _triple(a / np.linalg.norm(a)))
            for part, a in zip(finger.lengths, finger.axis_vectors, strict=True)
        )
        base = _triple(np.append(finger.base, STAND * model.link_radius) * length)
        built.append(Finger(model.contact_names[contact], base, links))
    actuator = task.actuator
    return Hand(
        palm_radius=task.palm.radius,
        palm_thickness=task.palm.thickness,
        fingers=tuple(built),
        joint_lower=model.joint_limits[0],
        joint_upper=model.joint_limits[1],
        effort=max(_RESERVE * effort, _LEAST * model.units.torque) if actuator is None else actuator.torque,
        velocity=max(_RESERVE * speed, _LEAST) if actuator is None else actuator.speed,
        density=task.hand.density,
    )


def design_change(model: Model, before: WholeHand, after: WholeHand) -> dict[str, dict[str, float]]:
    """For each finger how far its base moved and its lengths changed at most, m, and its axes turned, rad."""
    changes = {}
    for contact, old, new in zip(before.contacts, before.fingers, after.fingers, strict=True):
        cosines = np.clip((new.axis_vectors * old.axis_vectors).sum(axis=1), -1, 1)
        changes[model.contact_names[contact]] = {
            "base": float(np.linalg.norm(new.base - old.base)) * model.units.length,
            "lengths": float(np.abs(new.lengths - old.lengths).max()) * model.units.length,
            "axes": float(np.arccos(cosines).max()),
        }
    return changes


def _triple(vector: Array) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z


def floating_motion(model: Model, floating: Floating) -> Motion:
    """The object's motion of stage 1, with no joints and every contact's link named ``none``."""
    schedule = model.schedule
    pose = poses_at(model, floating.pose)
    count = len(schedule.samples)
    point = sampled_points(model, floating.point)
    active = floating.active[schedule.sample_keyframes]
    names = model.contact_names + (("ground",) if model.ground is not None else ())
    links = ["none"] * model.contacts + (["ground"] if model.ground is not None else [])
    force, nowhere, angles = floating.force * active[:, :, None], np.zeros_like(point), np.zeros((count, 0))
    palm = model.palm_position, model.palm_quaternion
    return _motion(model, pose[:, :3], pose[:, 3:], *palm, angles, (), names, links, active, force, point, nowhere)


def whole_hand_motion(model: Model, result: WholeHand) -> Motion:
    """The motion of stage 3; each contact's point on the link is the point of its surface nearest the object's.

    A contact without a finger, since it never acts, is left out.
    """
    count = len(result.force)
    names = model.contact_names + (("ground",) if model.ground is not None else ())
    capsules = model.capsules if model.ground is None else np.vstack([model.capsules, model.ground.capsule])
    point = np.array([on_capsules(p, capsules) for p in result.point])
    on_link = np.zeros_like(point)
    links = ["none"] * model.contacts + (["ground"] if model.ground is not None else [])
    for i, (finger, contact) in enumerate(zip(result.fingers, result.contacts, strict=True)):
        links[contact] = f"finger{i}_link{finger.joints - 1}"
        tip = np.array([*np.zeros(3), 0, 0, finger.lengths[-1], model.link_radius])
        origins, rotations = link_frames(finger, model.link_radius, result.angles[i])
        from_origin = in_palm(model, result, point[:, contact]) - origins[:, -1]
        local = np.einsum("sji,sj->si", rotations[:, -1], from_origin)
        on_link[:, contact] = on_capsules(local, np.tile(tip, (count, 1)))
    if model.ground is not None:
        on_link[:, -1] = in_world(model, result, point[:, -1])
        on_link[:, -1, 2] = model.ground.height
    angles = np.hstack(result.angles) if result.angles else np.zeros((count, 0))
    joint_names = tuple(f"finger{i}_joint{j}" for i, f in enumerate(result.fingers) for j in range(f.joints))
    object_pose, palm = (result.position, result.vector), (result.palm_position, result.palm_quaternion)
    touch = [c for c, link in enumerate(links) if link != "none"]
    contacts = tuple(names[c] for c in touch), [links[c] for c in touch]
    active, force, point, on_link = result.active[:, touch], result.force[:, touch], point[:, touch], on_link[:, touch]
    motion = _motion(model, *object_pose, *palm, angles, joint_names, *contacts, active, force, point, on_link)
    if result.disturbed is None:
        return motion
    rotations = np.array([object_rotation(model, v) for v in result.vector])
    return replace(
        motion,
        contact_force_disturbed=np.einsum("sij,scj->sci", rotations, result.disturbed[:, touch]) * model.units.force,
        external_force_disturbed=model.perturbation_force * model.units.force,
        external_torque_disturbed=model.perturbation_torque * model.units.torque,
    )


def _motion(
    model: Model,
    position: Array,
    vector: Array,
    palm_position: Array,
    palm_quaternion: Array,
    angles: Array,
    joint_names: tuple[str, ...],
    contact_names: tuple[str, ...],
    contact_link: Sequence[str],
    active: NDArray[np.bool_],
    force: Array,
    point: Array,
    on_link: Array,
) -> Motion:
    """Dress nondimensional arrays as a ``Motion`` in SI, forces turned into the world."""
    units = model.units
    rotations = np.array([object_rotation(model, v) for v in vector])
    scale = np.full(len(contact_names), units.length)
    return Motion(
        time=model.schedule.samples,
        object_position=position * units.length,
        object_orientation=continuous(np.array([quaternion(r) for r in rotations])),
        base_position=palm_position * units.length,
        base_orientation=continuous(palm_quaternion),
        joint_angles=angles,
        joint_names=joint_names,
        contact_names=contact_names,
        contact_link=tuple(contact_link),
        contact_active=active,
        contact_force=np.einsum("sij,scj->sci", rotations, force) * units.force,
        contact_point_object=point * units.length,
        contact_point_link=on_link * scale[None, :, None],
        external_force=np.zeros_like(position),
        external_torque=np.zeros_like(position),
    )


def joint_loads(model: Model, result: WholeHand) -> tuple[float, float]:
    """Largest joint torque (N·m, from contact forces, disturbed ones too) and speed (rad/s) of a motion."""
    torque, speed = 0.0, 0.0
    steps = np.diff(model.schedule.samples)[:, None]
    for i, contact in enumerate(result.contacts):
        speed = max(speed, float(np.abs(np.diff(result.angles[i], axis=0) / steps).max()))
        jacobians = contact_jacobians(model, result, i)
        for forces in (result.force, result.disturbed):
            if forces is not None:
                force = turned_to_palm(result, turned_to_world(model, result, forces[:, contact]))
                torque = max(torque, float(np.abs(np.einsum("sij,si->sj", jacobians, force)).max()))
    return torque * model.units.torque, speed
