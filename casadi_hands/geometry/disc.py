"""The palm's face: a disc in the plane z = 0 of its frame, the palm's body below it."""

from __future__ import annotations

import casadi as ca
from casadi import SX

from casadi_hands.geometry.smooth import norm


def point_disc_distance(point: SX, radius: SX) -> SX:
    """Signed distance of a point from a disc's body, whose face is at z = 0 and which fills z < 0 beneath it.

    Above the face it is the distance to the disc; below it is the larger of height and distance to the rim's
    cylinder, so that both ways out of the body are seen.

    Args:
        point: (3,) in the disc's frame.
        radius: of the disc.
    """
    height = point[2]
    beyond = norm(point[:2], 1e-6) - radius
    outside = norm(ca.vertcat(ca.fmax(height, 0), ca.fmax(beyond, 0)))
    inside = ca.fmin(ca.fmax(height, beyond), 0)
    return outside + inside
