"""The motions that a solve ends with, as they are written: that of the object alone, and that of object and hand.

And the motors that share joints, whose limits follow from the motion.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from casadi_hands.geometry.bodies.capsule import Capsule
from casadi_hands.geometry.contact_points import on_bodies, rounded_normals
from casadi_hands.kinematics.numeric import link_frames
from casadi_hands.problem.attachment import MOVING, dry_friction
from casadi_hands.problem.drive import Drive
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.hand_motion import OnJoint, WholeHand
from casadi_hands.problem.holds import with_holds
from casadi_hands.problem.model import Model, sampled_points
from casadi_hands.problem.motion import Motion
from casadi_hands.problem.motors import shared_motor
from casadi_hands.problem.palm_motion import poses_at
from casadi_hands.problem.placement import (
    in_palm,
    in_world,
    object_rotation,
    torques_in_all,
)
from casadi_hands.problem.si import LEAST, RESERVE, motion_in_si
from casadi_hands.task import Task

Array = NDArray[np.float64]
KINKS = 1e-7, 5e-5
"""Lengths by which the rounding of kinks moves surfaces: more than a solver's accuracy, and at most."""


def floating_motion(model: Model, floating: Floating) -> Motion:
    """The object's motion of stage 1, with no joints and every contact's link named ``none``."""
    schedule = model.schedule
    pose = poses_at(model, floating.pose)
    count = len(schedule.samples)
    point = sampled_points(model, floating.point)
    active = floating.active[schedule.sample_keyframes]
    names = tuple(contact.name for contact in model.contact_table)
    links = ["none"] * model.contacts + (["ground"] if model.ground is not None else [])
    force, nowhere, angles = floating.force * active[:, :, None], np.zeros_like(point), np.zeros((count, 0))
    palm = model.palm_position, model.palm_quaternion
    object_pose = pose[:, :3], pose[:, 3:]
    motion = motion_in_si(model, *object_pose, *palm, angles, (), names, links, active, force, point, nowhere)
    return with_holds(schedule, motion)


def whole_hand_motion(model: Model, result: WholeHand) -> Motion:
    """The motion of stage 3 as it is written.

    Each contact's point on the link is the point of its surface nearest the object's. A contact without a finger, since
    it never acts, is left out.
    """
    return with_holds(model.schedule, _at_samples(model, result))


def _at_samples(model: Model, result: WholeHand) -> Motion:
    count = len(result.force)
    names = tuple(contact.name for contact in model.contact_table)
    point = np.array([_on_surfaces(p, model) for p in result.point])
    on_link = np.zeros_like(point)
    links = ["none"] * model.contacts + (["ground"] if model.ground is not None else [])
    for i, (finger, contact) in enumerate(zip(result.fingers, result.contacts, strict=True)):
        links[contact] = f"finger{i}_link{finger.joints - 1}"
        link = Capsule(np.array([0, 0, model.hinge]), np.array([0, 0, finger.lengths[-1]]), model.tip_radius)
        origins, rotations = link_frames(finger, model.radii(finger.joints), result.angles[i])
        from_origin = in_palm(model, result, point[:, contact]) - origins[:, -1]
        local = np.einsum("sji,sj->si", rotations[:, -1], from_origin)
        on_link[:, contact] = on_bodies(local, [link] * count)
    if model.ground is not None:
        on_link[:, -1] = in_world(model, result, point[:, -1])
        on_link[:, -1, 2] = model.ground
    angles = np.hstack(result.angles) if result.angles else np.zeros((count, 0))
    joint_names = tuple(f"finger{i}_joint{j}" for i, f in enumerate(result.fingers) for j in range(f.joints))
    object_pose, palm = (result.position, result.vector), (result.palm_position, result.palm_quaternion)
    touch = [c for c, link in enumerate(links) if link != "none"]
    contacts = tuple(names[c] for c in touch), [links[c] for c in touch]
    active, force, point, on_link = result.active[:, touch], result.force[:, touch], point[:, touch], on_link[:, touch]
    motion = motion_in_si(model, *object_pose, *palm, angles, joint_names, *contacts, active, force, point, on_link)
    motion = _on_joint(model, motion, result)
    if result.torsion is not None:
        # As physics had them: where contacts pass a kink of the surface, true normals turn at once.
        normals = np.stack([rounded_normals(point[:, k], model.touched[c]) for k, c in enumerate(touch)], axis=1)
        moments = model.torsion * result.torsion[:, touch, None] * normals
        turns = np.array([object_rotation(model, v) for v in result.vector])
        motion = replace(motion, contact_moment=np.einsum("sij,scj->sci", turns, moments) * model.units.torque)
    disturbance = model.disturbance
    if result.disturbed is None or disturbance is None:
        return motion
    rotations = np.array([object_rotation(model, v) for v in result.vector])
    return replace(
        motion,
        contact_force_disturbed=np.einsum("sij,scj->sci", rotations, result.disturbed[:, touch]) * model.units.force,
        external_force_disturbed=model.scenarios[1].force * model.units.force,
        external_torque_disturbed=model.scenarios[1].torque * model.units.torque,
    )


def _on_surfaces(points: Array, model: Model) -> Array:
    """Contact points (C, 3) on the surfaces that they touch.

    Constraints round the kinks of some bodies, which puts points off the true surface by next to nothing; there they
    stay, since forces that act there are what moves the object.
    """
    moved = on_bodies(points, model.touched)
    off = np.linalg.norm(moved - points, axis=1)[:, None]
    return np.where((off > KINKS[0]) & (off < KINKS[1]), points, moved)


def _on_joint(model: Model, motion: Motion, result: WholeHand) -> Motion:
    """The motion with how an attached object goes along its joint; before the refinement as its poses say."""
    joint = model.attachment
    if joint is None:
        return motion
    found = result.on_joint
    if found is None:
        coordinate = joint.coordinates(result.position, result.vector)
        speed = np.gradient(coordinate, model.schedule.samples)
        found = OnJoint(coordinate, speed, dry_friction(joint, speed, MOVING))
    unit, force = (1.0, model.units.torque) if joint.turning else (model.units.length, model.units.force)
    return replace(
        motion,
        attachment_position=found.coordinate * unit,
        attachment_velocity=found.speed * unit,
        attachment_friction=found.friction * force,
    )


def drive_of(task: Task, model: Model, motion: WholeHand) -> Drive:
    """The motors that share joints, in SI; their limits as those of joints in `hand_of`, by virtual work.

    Args:
        task: names the actuator.
        model: for the units.
        motion: with a coupling.
    """
    coupling, actuator = motion.coupling, task.actuator
    assert coupling is not None
    torques = float(np.abs(torques_in_all(model, motion) @ coupling.ratios).max())
    speeds = np.diff(coupling.positions, axis=0) / np.diff(model.schedule.samples)[:, None]
    speed = float(np.abs(speeds).max())
    # From sample to sample motors go straight: where they change their speed, their rotors ask for torque, too.
    jolts = np.abs(np.diff(speeds, axis=0, prepend=0.0, append=0.0)).max(axis=0)
    motors = [shared_motor(actuator.stiffness, column) for column in coupling.ratios.T.tolist()]
    rotor = max(motor.damping / 2 * jolt for motor, jolt in zip(motors, jolts, strict=True))
    return Drive(
        ratios=tuple(tuple(row) for row in coupling.ratios.tolist()),
        offsets=tuple(coupling.offsets.tolist()),
        effort=actuator.torque or max(RESERVE * torques, LEAST) * model.units.torque + float(rotor),
        velocity=actuator.speed or max(RESERVE * speed, LEAST),
    )
