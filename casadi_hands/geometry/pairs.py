"""Distances between two cores, looked up by their kinds; links are segments, so one of the two always is."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import casadi as ca
from casadi import MX, SX, Function

from casadi_hands.geometry.bodies.capsule import Segment
from casadi_hands.geometry.bodies.sphere import Point
from casadi_hands.geometry.core import Core, Placed
from casadi_hands.geometry.segments import point_segment_distance, segment_distance
from casadi_hands.geometry.smooth import clamp, constant, norm

_ROUNDS = 9  # of halving and false position
_TIE = 1e-4  # least bend of a distance along a segment, a share of its squared length over a length
_STEP = 1e-3  # longest of the last step, a share of the segment
_ROUNDING = 1e-4  # value of the distance of bodies that cross
_FAR = 1e3  # lengths: the distance of what need not be found


def _segments(one: Segment, other: Segment) -> SX:
    return segment_distance(one.start, one.end, other.start, other.end)


def _segment_and_point(one: Segment, other: Point) -> SX:
    return point_segment_distance(one.start, one.end, other.at)


def _segment_and_core(one: Segment, core: Core, enough: SX | None = None) -> SX:
    """The least over the segment of the distance from a convex set, which is constant in its own frame.

    All that it takes to find it is a function of its own, whose results are constants to derivatives: those of the
    distance are a quadratic's. So they cost the same however many faces the core has.
    """
    start, end = one.start, one.end
    parts = list(vars(core).values())  # its fields
    nearest, used = _nearest(type(core), tuple(part.shape for part in parts))
    here = constant(start), constant(end)
    given, ball = (*here, *[parts[k] for k in used]), core.bound()
    if enough is not None and ball is not None:
        least = norm((here[0] + here[1]) / 2 - ball[0]) - norm(here[1] - here[0]) / 2 - ball[1]
        nearest, given = _unless_far(nearest), (least < enough, *given)
    # Rounded, too: that is what makes them constants.
    value, gradient, bends = (constant(x) for x in nearest(*given))
    moved = ca.vertcat(start, end) - ca.vertcat(*here)
    return value + ca.dot(moved, gradient + ca.mtimes(bends, moved))


@cache
def _unless_far(nearest: Function) -> Function:
    """A function of whether a segment may be near, and of what another takes, which is only called where it may be."""
    sizes = [nearest.size_in(i) for i in range(nearest.n_in())]
    far = Function("far", [SX.sym("x", size) for size in sizes], [SX(_FAR), SX(6, 1), SX(6, 6)])
    inputs = [MX.sym("x", size) for size in [(1, 1), *sizes]]
    # As an MX: among SX both would be computed, always.
    either = Function.if_else("either", nearest, far).call(inputs)
    return Function(f"{nearest.name()}_unless_far", inputs, either, _constants(len(inputs)))


@cache
def _nearest(kind: type[Core], shapes: tuple[tuple[int, int], ...]) -> tuple[Function, list[int]]:
    """What finds how near a segment is to a core, and which of the core's fields it takes.

    Where the segment runs along a face, so that all of it is as near, its nearest point stays where it is as the ends
    move; else how that moves follows from the derivatives of the distance's slope.

    Args:
        kind: of the core.
        shapes: of its fields.

    Returns:
        Both ends (3,) and fields -> the distance, its gradient (6,) by the ends, and half of its Hessian (6, 6), that
        of what stands above the diagonal twice and below not.
    """
    start, end, at = SX.sym("start", 3), SX.sym("end", 3), SX.sym("at")
    parts = [SX.sym(f"part{k}", *shape) for k, shape in enumerate(shapes)]
    core, along, ends = kind(*parts), end - start, ca.vertcat(start, end)
    slope = core.slopes(start, along)
    found, at_end = _root(slope)
    value, rates, bends = _expanded(slope(at), ca.vertcat(at, ends), ca.vertcat(found, ends))
    bend = rates[0] + _TIE * ca.sumsqr(along)
    step = -value / bend
    newton = found + clamp(step, -_STEP, _STEP)
    held = ca.logic_or(at_end, ca.logic_or(ca.fabs(step) >= _STEP, ca.fabs(newton - 0.5) >= 0.5))
    share = ca.if_else(at_end, found, clamp(newton, 0, 1))
    moves = ca.vertcat(-rates[1:].T / bend, SX.eye(6))  # of the share and the ends by the ends
    turns = -ca.mtimes([moves.T, bends, moves]) / bend
    point, by = SX.sym("point", 3), SX.sym("by", 6)
    value, gradient, hessian = _expanded(core.distance_and_normal(point, _ROUNDING)[0], point, start + share * along)
    place = share + ca.if_else(held, 0, ca.dot(moves[0, :].T, by) + ca.bilin(turns, by, by) / 2)
    moved = by[:3] + place * (along + by[3:] - by[:3]) - share * along
    distance = value + ca.dot(gradient, moved) + ca.bilin(hessian, moved, moved) / 2
    value, gradient, hessian = _expanded(distance, by, SX.zeros(6))
    if beside := core.beside(start, end):
        least, instead = beside
        more, others = ca.logic_or(least > value, value > instead), _expanded(instead, ends, ends)
        value, gradient, hessian = (
            ca.if_else(more, a, b) for a, b in zip(others, (value, gradient, hessian), strict=True)
        )
    results = ca.cse([value, gradient, ca.triu(hessian, False) + ca.diag(ca.diag(hessian)) / 2])
    used = [k for k, part in enumerate(parts) if any(ca.depends_on(each, part) for each in results)]
    inputs = [start, end, *[parts[k] for k in used]]
    return Function(f"nearest_{kind.__name__}", inputs, results, _constants(len(inputs))), used


def _root(slope: Callable[[SX], SX]) -> tuple[SX, SX]:
    """The share of a segment at which a convex function's slope vanishes, or an end's, and whether it is an end's.

    It is bracketed by the segment's ends, and narrowed by halves and by false position.
    """

    def within(low: SX, high: SX, below: SX, above: SX) -> SX:
        # Clamped, since the slopes at both ends of the bracket may vanish.
        return low + (high - low) * clamp(-below / (above - below + 1e-12), 0, 1)

    low, high = SX(0), SX(1)
    below, above = slope(low), slope(high)
    first, last = below >= 0, above <= 0
    for _ in range(_ROUNDS):
        # By halves, too: along a face the slope is next to nothing until an edge, where it jumps.
        for halved in (True, False):
            where = (low + high) / 2 if halved else within(low, high, below, above)
            here = slope(where)
            before = here < 0
            low, high = ca.if_else(before, where, low), ca.if_else(before, high, where)
            below, above = ca.if_else(before, here, below), ca.if_else(before, above, here)
    found = ca.if_else(first, 0, ca.if_else(last, 1, within(low, high, below, above)))
    return found, ca.logic_or(first, last)


def _expanded(value: SX, x: SX, at: SX) -> tuple[SX, SX, SX]:
    """A function's value, gradient (n,) and Hessian (n, n) at a point (n,)."""
    hessian, gradient = ca.hessian(value, x)
    found = ca.substitute(ca.horzcat(ca.densify(hessian), gradient, value * SX.ones(x.shape)), x, at)
    return found[0, -1], found[:, -2], found[:, :-2]


def _constants(inputs: int) -> dict[str, Any]:
    """Options of a function whose three results are constants to derivatives."""
    return {"never_inline": True, "is_diff_in": [False] * inputs, "is_diff_out": [False] * 3}


_TABLE: dict[tuple[type[Core], type[Core]], Callable[[Any, Any], SX]] = {
    (Segment, Segment): _segments,
    (Segment, Point): _segment_and_point,
}


def core_distance(one: Segment, other: Core, enough: SX | None = None) -> SX:
    """Distance between a segment and a core, in one frame, in units in which both are of order one.

    Args:
        one: the segment.
        other: the core.
        enough: where it is more, it need not be found; any such distance may be given then.
    """
    if isinstance(other, Placed):
        return core_distance(Segment(other.own(one.start), other.own(one.end)), other.core, enough)
    closed = _TABLE.get((type(one), type(other)))
    return closed(one, other) if closed else _segment_and_core(one, other, enough)
