"""The morphology of one finger."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FingerSeed:
    """A start for one finger, nondimensional, palm frame.

    Attributes:
        base: (2,).
        lengths: (n,).
        frames: (n, 3, 3) rotations whose third columns are the axes at ``axes`` = 0.
        axes: (n, 2) exponential coordinates from those.
        bends: (n, 2) rotation vector of each link at zero angle, about its parent's x and y axes, rad.
        angles: (N, n) at the keyframes, rad.
        tips: (strings, 2) surface coordinates of the contact in each string of active keyframes.
    """

    base: Array
    lengths: Array
    frames: Array
    axes: Array
    bends: Array
    angles: Array
    tips: Array

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.lengths)

    @property
    def axis_vectors(self) -> Array:
        """(n, 3) unit axes, each in its link's frame."""
        angle = np.sqrt((self.axes**2).sum(axis=1) + 1e-10)
        local = np.column_stack([(np.sin(angle) / angle)[:, None] * self.axes, np.cos(angle)])
        return np.asarray(np.einsum("nij,nj->ni", self.frames, local))

    @property
    def turns(self) -> Array:
        """(n, 3, 3) rotation of each link at zero angle, parent <- link."""
        return np.asarray(Rotation.from_rotvec(np.column_stack([self.bends, np.zeros(self.joints)])).as_matrix())


def frame_about(axis: Array) -> Array:
    """A rotation (3, 3) whose third column is ``axis``."""
    helper = np.eye(3)[np.argmin(np.abs(axis))]
    x = np.cross(helper, axis)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])
