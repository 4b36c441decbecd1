"""A finger in numbers: where its contact is and what its joints can push."""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from casadi_hands.kinematics import finger_kinematics
from casadi_hands.stages.finger_symbols import tip_point
from casadi_hands.stages.synthesis import FingerSeed

Array = NDArray[np.float64]


def contact_kinematics(finger: FingerSeed, strings: NDArray[np.int64], link_radius: float) -> tuple[Array, Array]:
    """Contact points (N, 3) and their Jacobians (N, 3, n) at the keyframes, palm frame.

    Args:
        finger: its ``tips`` hold one contact a string.
        strings: (N,) the string of each keyframe.
        link_radius: half extents.
    """
    function = finger_kinematics(finger.joints)
    # The same code serves CasADi's numbers; only its annotations speak of symbols.
    length, radius = ca.DM(finger.lengths[-1]), ca.DM(link_radius)
    on_link = [tip_point(ca.DM(tip), length, radius)[0] for tip in finger.tips]  # type: ignore[arg-type]
    base, axes = np.append(finger.base, 0), finger.axis_vectors.T
    points, jacobians = [], []
    for angles, string in zip(finger.angles, strings, strict=True):
        *_, point, jacobian = function(base, axes, finger.lengths, angles, on_link[string])
        points.append(np.asarray(point).reshape(-1))
        jacobians.append(np.asarray(jacobian))
    return np.array(points), np.array(jacobians)
