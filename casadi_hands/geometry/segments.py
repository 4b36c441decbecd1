"""The distance between two segments, differentiable where they are parallel or cross."""

from __future__ import annotations

import casadi as ca
from casadi import SX

from casadi_hands.geometry.smooth import clamp, norm

_TIE = 1e-4  # pulls the closest points of parallel segments to their middles, relative to the squared lengths
_ROUNDING = 1e-4  # value of the distance of crossing segments


def segment_distance(start: SX, end: SX, other_start: SX, other_end: SX) -> SX:
    """Distance between two segments, all ends (3,) in one frame, in units in which segments are of order one.

    The closest points solve a box-constrained quadratic in the two fractions s and t, to which
    ``tie * ((s - 1/2)² + (t - 1/2)²)`` is added so that parallel segments have one solution; the distance is
    rounded off at zero. It is never too small, and too large by at most 1e-4 of the summed lengths where segments
    are 0.3 or more apart, by 1e-3 where they nearly touch and are nearly parallel.
    """
    along, other_along, between = end - start, other_end - other_start, start - other_start
    s, t = _shares(along, other_along, between)
    return norm(between + s * along - t * other_along, _ROUNDING)


def nearest_points(start: SX, end: SX, other_start: SX, other_end: SX) -> tuple[SX, SX]:
    """The closest points (3,) of two segments, as `segment_distance` takes them."""
    along, other_along = end - start, other_end - other_start
    s, t = _shares(along, other_along, start - other_start)
    return start + s * along, other_start + t * other_along


def _shares(along: SX, other_along: SX, between: SX) -> tuple[SX, SX]:
    """Of two segments, each as a vector (3,), at which their closest points are; ``between`` (3,) their starts."""
    length2, other_length2 = ca.sumsqr(along), ca.sumsqr(other_along)
    tie = _TIE * (length2 + other_length2) + 1e-9
    a, b, e = length2 + tie, ca.dot(along, other_along), other_length2 + tie
    c, f = ca.dot(along, between) - tie / 2, ca.dot(other_along, between) + tie / 2
    s = clamp((b * f - c * e) / (a * e - b * b), 0, 1)
    t = clamp((b * s + f) / e, 0, 1)
    return clamp((b * t - c) / a, 0, 1), t


def point_segment_distance(start: SX, end: SX, point: SX) -> SX:
    """Distance between a segment and a point, all (3,): what `segment_distance` is for a segment of no length."""
    along, between = end - start, start - point
    length2 = ca.sumsqr(along)
    tie = _TIE * length2 + 1e-9
    share = clamp((tie / 2 - ca.dot(along, between)) / (length2 + tie), 0, 1)
    return norm(between + share * along, _ROUNDING)
