"""Paths over surfaces, and directions across them."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
from casadi import SX

from casadi_hands.geometry import norm


def path_between(points: Sequence[SX], normals: Sequence[SX], rotations: Sequence[SX]) -> SX:
    """The way (3,) of a contact over a body's surface from one knot to the next, seen from outside halfway between.

    The chord between the points, stretched to the arc where the surface bends (where it does, normals differ along the
    chord), and turned as the body is halfway: what rolls evenly over circles or lines goes the same way on both bodies,
    up to the fifth order in the turns.

    Args:
        points: (3,) each, on the surface, body frame.
        normals: (3,) each, unit, body frame.
        rotations: (3, 3) each, of the body.
    """
    chord, bend = points[1] - points[0], normals[1] - normals[0]
    # Along the bend the chord is stretched by asin(u)/u, u half the bend's length; a series of asin(u)/u - 1 in s = u².
    s = ca.sumsqr(bend) / 4
    arc = chord + (1 / 6 + s * (3 / 40 + s * (5 / 112 + s * 35 / 1152))) / 4 * ca.dot(chord, bend) * bend
    # The mean of two rotations is short of a rotation; a step of Newton's towards the nearest one.
    mean = (rotations[0] + rotations[1]) / 2
    turned = ca.mtimes(mean, arc)
    return 1.5 * turned - 0.5 * ca.mtimes(mean, ca.mtimes(mean.T, turned))


def tangents(normal: SX, helper: SX) -> tuple[SX, SX]:
    """Two unit vectors (3,) across a unit normal; ``helper`` (3,) must not be near it."""
    first = ca.cross(helper, normal)
    first = first / norm(first, 1e-9)
    return first, ca.cross(normal, first)
