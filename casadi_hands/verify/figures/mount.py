"""The joint of an attached object as the stability of a grasp needs it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.verify.held import Held
from casadi_hands.verify.reading.folder import Folder


@dataclass(frozen=True)
class Mount:
    """The joint of an attached object at the samples, palm frame.

    Attributes:
        pivot: (S, 3) m, a point of its axis.
        twist: (S, 6) of the object about it: m and rad at a coordinate's speed of 1.
        force, torque: (S, 3) of weight and world on the object, N at its centre of mass and N·m.
        stiffness: of its spring along the coordinate.
        length: m, that a turn of 1 rad is as large as.
    """

    pivot: np.ndarray
    twist: np.ndarray
    force: np.ndarray
    torque: np.ndarray
    stiffness: float
    length: float

    @classmethod
    def of(cls, folder: Folder, joint: Held, palm: Rotation) -> Mount:
        """Take the joint as seen from the palm, whose inverse orientations are given."""
        motion, axis = folder.motion, palm.apply(joint.axis)
        pulled = palm.apply(folder.object.mass * folder.gravity + motion.external_force)
        return cls(
            pivot=palm.apply(joint.pivot - motion.base_position),
            twist=np.hstack([joint.advance * axis, joint.turns * axis]),
            force=pulled,
            torque=palm.apply(motion.external_torque),
            stiffness=joint.stiffness,
            length=folder.length,
        )

    def loaded(self, sample: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Return the wrench (N, 6) of weight and world about the joint, with the object at positions (N, 3)."""
        force = self.force[sample]
        turning = np.cross(position - self.pivot[sample], force) + self.torque[sample]
        return np.hstack([force, turning])

    def held_back(self, k: int) -> np.ndarray:
        """Return rows (5, 6) that are 0 for twists that the joint allows at a sample."""
        scale = np.concatenate([np.full(3, self.length), np.ones(3)])
        rows: np.ndarray = self.length * np.linalg.svd((self.twist[k] / scale)[None])[2][1:] / scale
        return rows

    def sprung(self, k: int, twists: np.ndarray) -> np.ndarray:
        """Return what its spring holds of twists (6, d) that it allows at a sample, (d, d)."""
        along = self.twist[k] @ twists / (self.twist[k] @ self.twist[k])
        held: np.ndarray = self.stiffness * np.outer(along, along)
        return held
