"""A motion of object and hand in numbers: its contacts in the palm's frame and what joints can push there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.geometry.contact_points import rounded_normals
from casadi_hands.kinematics.numeric import link_frames
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model

Array = NDArray[np.float64]


def object_rotation(model: Model, vector: Array) -> Array:
    """(3, 3) from the object's frame to the world's, of a rotation vector (3,) from the reference."""
    return np.asarray(pin.exp3(vector) @ pin.Quaternion(*model.reference).matrix())


def in_world(model: Model, motion: WholeHand, points: Array) -> Array:
    """Object points (S, 3), one a sample, in the world."""
    return turned_to_world(model, motion, points) + motion.position


def turned_to_world(model: Model, motion: WholeHand, vectors: Array) -> Array:
    """Vectors (S, 3) of the object's frame in the world's."""
    turns = np.array([object_rotation(model, v) for v in motion.vector])
    return np.asarray(np.einsum("sij,sj->si", turns, vectors))


def turned_to_palm(motion: WholeHand, vectors: Array) -> Array:
    """Vectors (S, 3) of the world's frame in the palm's."""
    palms = np.array([pin.Quaternion(*q).matrix() for q in motion.palm_quaternion])
    return np.asarray(np.einsum("sji,sj->si", palms, vectors))


def in_palm(model: Model, motion: WholeHand, points: Array) -> Array:
    """Object points (S, 3), one a sample, in the palm's frame."""
    return turned_to_palm(motion, in_world(model, motion, points) - motion.palm_position)


def contact_jacobians(model: Model, motion: WholeHand, finger: int) -> Array:
    """(S, 3, n) of the point of the last link where a finger's contact on the object is, palm frame, lengths/rad.

    Args:
        model: the task.
        motion: of the samples.
        finger: index of the finger among the motion's.
    """
    own = motion.fingers[finger]
    origins, rotations = link_frames(own, model.radii(own.joints), motion.angles[finger])
    axes = np.einsum("kjab,jb->kja", rotations, own.axis_vectors)
    contact = in_palm(model, motion, motion.point[:, motion.contacts[finger]])
    return np.ascontiguousarray(np.cross(axes, contact[:, None] - origins).transpose(0, 2, 1))


def joint_torques(model: Model, motion: WholeHand) -> Array:
    """(S, J) with which joints exert the contacts' forces and torsional moments, m·g·length."""
    found = []
    for i, (contact, finger) in enumerate(zip(motion.contacts, motion.fingers, strict=True)):
        force = turned_to_palm(motion, turned_to_world(model, motion, motion.force[:, contact]))
        torque = np.einsum("sij,si->sj", contact_jacobians(model, motion, i), force)
        if motion.torsion is not None:
            normals = rounded_normals(motion.point[:, contact], model.touched[contact])
            moment = model.torsion * motion.torsion[:, contact, None] * normals
            moment = turned_to_palm(motion, turned_to_world(model, motion, moment))
            _, rotations = link_frames(finger, model.radii(finger.joints), motion.angles[i])
            torque += np.einsum("sjab,jb,sa->sj", rotations, finger.axis_vectors, moment)
        found.append(torque)
    return np.hstack(found)


def torques_in_all(model: Model, motion: WholeHand) -> Array:
    """(K, S, J) joint torques of the motion as planned and, where the task disturbs it, under that; m·g·length."""
    forces = [each for each in (motion.force, motion.disturbed) if each is not None]
    return np.array([joint_torques(model, replace(motion, force=force)) for force in forces])


def forces_of_joint_errors(model: Model, motion: WholeHand, finger: int, error: float) -> Array:
    """(S,) by how much a finger's normal force changes, m·g, where its joints' sensors are off and the object is held.

    Args:
        model: the task.
        motion: of the samples.
        finger: index of the finger among the motion's.
        error: of each sensor, rad, to either side.
    """
    contact = motion.contacts[finger]
    normals = np.array([model.touched[contact].outward(point) for point in motion.point[:, contact]])
    normals = turned_to_palm(motion, turned_to_world(model, motion, normals))
    # Joints with hardly any moment arm push against the structure, not the object.
    inverse = np.linalg.pinv(contact_jacobians(model, motion, finger), rcond=0.1)
    return np.asarray(error * model.stiffness * np.abs(np.einsum("snj,sj->sn", inverse, normals)).sum(axis=1))


def contact_slips(model: Model, motion: WholeHand, finger: int) -> Array:
    """(S - 1, 3) by which a finger's contact goes farther over the object than over the last link, object frame.

    Args:
        model: the task.
        motion: of the samples.
        finger: index of the finger among the motion's.
    """
    own = motion.fingers[finger]
    origins, links = (each[:, -1] for each in link_frames(own, model.radii(own.joints), motion.angles[finger]))
    points = motion.point[:, motion.contacts[finger]]
    on_link = np.einsum("sba,sb->sa", links, in_palm(model, motion, points) - origins)
    palms = np.array([pin.Quaternion(*q).matrix() for q in motion.palm_quaternion])
    turns = np.einsum("sba,sbc->sac", palms, [object_rotation(model, v) for v in motion.vector])
    ways = [
        np.einsum("sab,sb->sa", r[:-1] + r[1:], np.diff(p, axis=0)) / 2 for r, p in ((turns, points), (links, on_link))
    ]
    return np.asarray(np.einsum("sba,sb->sa", turns[:-1], ways[0] - ways[1]))


def contact_spins(model: Model, motion: WholeHand, finger: int, normals: Array) -> Array:
    """(S - 1,) rad by which the object turns against a finger's last link from sample to sample.

    Args:
        model: the task.
        motion: of the samples.
        finger: index of the finger among the motion's.
        normals: (S, 3) about which, object frame.
    """
    own = motion.fingers[finger]
    _, rotations = link_frames(own, model.radii(own.joints), motion.angles[finger])
    palms = np.array([pin.Quaternion(*q).matrix() for q in motion.palm_quaternion])
    turns = np.array([object_rotation(model, v) for v in motion.vector])
    relative = np.einsum("sba,scb,scd->sad", rotations[:, -1], palms, turns)
    changes = np.einsum("sba,sbc->sac", relative[:-1], relative[1:])
    return np.array([pin.log3(change) @ normal for change, normal in zip(changes, normals, strict=False)])
