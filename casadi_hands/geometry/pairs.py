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
from casadi_hands.geometry.smooth import clamp, constant

_ROUNDS = 9  # of halving and false position
_TIE = 1e-4  # least bend of a distance along a segment, a share of its squared length over a length
_STEP = 1e-3  # longest of the last step, a share of the segment
_ROUNDING = 1e-4  # value of the distance of bodies that cross


def _segments(one: Segment, other: Segment) -> SX:
    return segment_distance(one.start, one.end, other.start, other.end)


def _segment_and_point(one: Segment, other: Point) -> SX:
    return point_segment_distance(one.start, one.end, other.at)


def _segment_and_core(one: Segment, other: Core) -> SX:
    """The least over the segment of the distance from a convex set, which is convex: where its slope vanishes.

    The root is bracketed by the segment's ends and narrowed by halves and by false position, whose steps are constants
    to derivatives; a step of Newton's from where they end has those of the root. Where the segment runs along a face,
    so that all of it is as near, that step is held back.
    """
    along = one.end - one.start
    slope = other.slopes(one.start, along)

    def within(low: SX, high: SX, below: SX, above: SX) -> SX:
        # Clamped, since the slopes at both ends of the bracket may vanish.
        return low + (high - low) * clamp(-below / (above - below + 1e-12), 0, 1)

    low, high = SX(0), SX(1)
    below, above = slope(low), slope(high)
    first, last = below >= 0, above <= 0  # where the nearest point is an end
    for _ in range(_ROUNDS):
        # By halves, too: along a face the slope is next to nothing until an edge, where it jumps.
        for where in ((low + high) / 2, None):
            at = within(low, high, below, above) if where is None else where
            here = slope(at)
            before = here < 0
            low, high = ca.if_else(before, at, low), ca.if_else(before, high, at)
            below, above = ca.if_else(before, here, below), ca.if_else(before, above, here)
    found = constant(within(low, high, below, above))
    share = SX.sym("share")
    bend = ca.substitute(ca.gradient(slope(share), share), share, found) + _TIE * ca.sumsqr(along)
    step = -slope(found) / bend
    newton = clamp(found + clamp(step, -_STEP, _STEP), 0, 1)
    nearest = one.start + ca.if_else(first, 0, ca.if_else(last, 1, newton)) * along
    return other.distance_and_normal(nearest, _ROUNDING)[0]


_TABLE: dict[tuple[type[Core], type[Core]], Callable[[Any, Any], SX]] = {
    (Segment, Segment): _segments,
    (Segment, Point): _segment_and_point,
}


def core_distance(one: Segment, other: Core) -> SX:
    """Distance between a segment and a core, in one frame, in units in which both are of order one."""
    return _TABLE.get((type(one), type(other)), _segment_and_core)(one, other)
