"""A motion of object and hand in numbers: its contacts in the palm's frame and what joints can push there."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

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
    origins, rotations = link_frames(own, model.link_radius, motion.angles[finger])
    axes = np.einsum("kjab,jb->kja", rotations, own.axis_vectors)
    contact = in_palm(model, motion, motion.point[:, motion.contacts[finger]])
    return np.ascontiguousarray(np.cross(axes, contact[:, None] - origins).transpose(0, 2, 1))
