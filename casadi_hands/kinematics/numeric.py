"""A finger in numbers: where its links and its contact are and what its joints can push."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from casadi_hands.kinematics import STAND, finger_kinematics
from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.kinematics.symbols import tip_point

Array = NDArray[np.float64]


def contact_kinematics(finger: FingerSeed, strings: NDArray[np.int64], radii: Sequence[float]) -> tuple[Array, Array]:
    """Contact points (N, 3) and their Jacobians (N, 3, n) at the keyframes, palm frame.

    Args:
        finger: its ``tips`` hold one contact a string.
        strings: (N,) the string of each keyframe.
        radii: (n,) of its links, lengths.
    """
    # The same code serves CasADi's numbers; only its annotations speak of symbols.
    length, radius = ca.DM(finger.lengths[-1]), ca.DM(radii[-1])
    on_link = [tip_point(ca.DM(tip), length, radius)[0] for tip in finger.tips]  # type: ignore[arg-type]
    tips = np.asarray(ca.horzcat(*on_link))[:, strings]
    *_, points, jacobians = _at(finger, radii, finger.angles, tips)
    count, joints = finger.angles.shape
    slopes = np.asarray(jacobians).reshape(3, count, joints).transpose(1, 0, 2)
    return np.ascontiguousarray(np.asarray(points).T), np.ascontiguousarray(slopes)


def link_frames(finger: FingerSeed, radii: Sequence[float], angles: Array) -> tuple[Array, Array]:
    """Origins (S, n, 3) and axes (S, n, 3, 3), one a column, of a finger's links at joint angles (S, n), palm frame.

    Args:
        finger: its morphology.
        radii: (n,) of its links, lengths.
        angles: (S, n) rad.
    """
    count, joints = angles.shape
    origins, rotations, *_ = _at(finger, radii, angles, np.zeros((3, count)))
    turned = np.asarray(rotations).reshape(3, count, joints, 3).transpose(1, 2, 0, 3)
    return np.ascontiguousarray(np.asarray(origins).T.reshape(count, joints, 3)), np.ascontiguousarray(turned)


def _at(finger: FingerSeed, radii: Sequence[float], angles: Array, on_link: Array) -> tuple[ca.DM, ...]:
    """What ``finger_kinematics`` gives, side by side, at angles (S, n) and points (3, S) of the last link."""
    count, joints = angles.shape
    base, turns = np.append(finger.base, STAND * radii[0]), np.hstack(list(finger.turns))
    given = (base[:, None], turns, finger.axis_vectors.T, finger.lengths[:, None])
    inputs = [np.tile(each, count) for each in given]
    return tuple(finger_kinematics(joints).map(count)(*inputs, angles.T, on_link))
