"""A capsule's surface where derivatives must be smooth, and directions across it."""

from __future__ import annotations

import casadi as ca
from casadi import SX

from casadi_hands.geometry import norm

_KINK = 1e-3  # smoothing of a capsule's change from cylinder to cap, relative to its length


def from_axis(point: SX, start: SX, end: SX) -> SX:
    """The vector (3,) to a point from the nearest point of a capsule's axis, whose ends are rounded in effect."""
    along = end - start
    t = ca.dot(point - start, along) / (ca.sumsqr(along) + 1e-9)
    t = (ca.sqrt(t**2 + _KINK**2) - ca.sqrt((t - 1) ** 2 + _KINK**2) + 1) / 2
    return point - start - t * along


def smooth_surface(point: SX, start: SX, end: SX, radius: SX) -> tuple[SX, SX]:
    """Signed distance and outward normal (3,) of a capsule whose kink is rounded; all in one frame."""
    offset = from_axis(point, start, end)
    distance = norm(offset, 1e-6)
    return distance - radius, offset / distance


def tangents(normal: SX, helper: SX) -> tuple[SX, SX]:
    """Two unit vectors (3,) across a unit normal; ``helper`` (3,) must not be near it."""
    first = ca.cross(helper, normal)
    first = first / norm(first, 1e-9)
    return first, ca.cross(normal, first)
