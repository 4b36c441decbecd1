"""A capsule: all points within a radius of a segment; a sphere is a capsule of no length."""

from __future__ import annotations

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from casadi_hands.geometry.smooth import norm

Array = NDArray[np.float64]
# The normal turns a corner where cap and cylinder meet, and contacts like to sit there: an optimiser jams on it. The
# rounding, a share of the segment's length, moves the surface by less than 1e-5 of that length.
_KINK = 1e-3


def closest_on_segment(point: SX, start: SX, end: SX) -> SX:
    """The point of a segment nearest to ``point``, smooth at the ends; all (3,) in one frame.

    A segment of no length is allowed.
    """
    along = end - start
    fraction = ca.dot(point - start, along) / (ca.sumsqr(along) + 1e-12)
    rounded = (norm(fraction, _KINK) - norm(fraction - 1, _KINK) + 1) / 2
    return start + rounded * along


def nearest_on_axis(point: Array, capsule: Array) -> tuple[Array, Array]:
    """The point of a capsule's axis nearest to a point, and the way (3,) from it, in numbers: nothing is rounded.

    Args:
        point: (3,).
        capsule: (7,) start, end and radius in the point's frame.
    """
    start, along = capsule[:3], capsule[3:6] - capsule[:3]
    squared = float(along @ along)
    share = np.clip((point - start) @ along / squared, 0, 1) if squared else 0.0
    return start + share * along, point - start - share * along


def project_to_capsule(point: SX, start: SX, end: SX, radius: SX) -> tuple[SX, SX, SX]:
    """The nearest point of a capsule's surface.

    Args:
        point: (3,).
        start: (3,) first end of the capsule's axis.
        end: (3,) other end.
        radius: of the capsule.

    Returns:
        The projection (3,), the outward unit normal there (3,), and the signed distance of ``point`` from
        the surface, negative inside. All in the frame and units of the arguments.
    """
    from_axis = point - closest_on_segment(point, start, end)
    distance = norm(from_axis)
    normal = from_axis / distance
    return point + (radius - distance) * normal, normal, distance - radius
