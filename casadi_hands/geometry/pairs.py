"""Distances between two cores, looked up by their kinds; links are segments, so one of the two always is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
from casadi import SX

from casadi_hands.geometry.bodies.body import Core
from casadi_hands.geometry.bodies.capsule import Segment
from casadi_hands.geometry.bodies.sphere import Point
from casadi_hands.geometry.segments import point_segment_distance, segment_distance
from casadi_hands.geometry.smooth import clamp, norm

_ROUNDS = 6  # of alternating projection
_ROUNDING = 1e-4  # value of the distance of bodies that cross


def _segments(one: Segment, other: Segment) -> SX:
    return segment_distance(one.start, one.end, other.start, other.end)


def _segment_and_point(one: Segment, other: Point) -> SX:
    return point_segment_distance(one.start, one.end, other.at)


def _segment_and_core(one: Segment, other: Core) -> SX:
    """By alternating projection: nearest points of two convex sets, each nearest to the other's, converge to them."""
    along = one.end - one.start
    point = (one.start + one.end) / 2
    for _ in range(_ROUNDS):
        nearest = point - other.offset(point)
        share = clamp(ca.dot(nearest - one.start, along) / (ca.sumsqr(along) + 1e-12), 0, 1)
        point = one.start + share * along
    return norm(other.offset(point), _ROUNDING) - other.depth(point)


_TABLE: dict[tuple[type[Core], type[Core]], Callable[[Any, Any], SX]] = {
    (Segment, Segment): _segments,
    (Segment, Point): _segment_and_point,
}


def core_distance(one: Segment, other: Core) -> SX:
    """Distance between a segment and a core, in one frame, in units in which both are of order one."""
    return _TABLE.get((type(one), type(other)), _segment_and_core)(one, other)
