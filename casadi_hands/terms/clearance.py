"""How far bodies are into each other (eq. 2.20): fingers, object, palm, ground; all in the palm frame."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import casadi as ca
from casadi import SX

from casadi_hands.declared import Term, Weight
from casadi_hands.geometry import norm, penalty_spline, point_disc_distance, segment_distance
from casadi_hands.geometry.bodies import Surface
from casadi_hands.geometry.bodies.capsule import Segment
from casadi_hands.geometry.pairs import core_distance
from casadi_hands.geometry.segments import point_segment_distance

_ROUNDING = 1e-3  # half the width of the spline's transition, lengths
FOLD = -0.3
"""Cosine of the sharpest turn from a link to the next: there the next one's body, `SHORTEST_HINGE` off, is clear."""
_CROSSING = 1e-4  # value of distances that vanish, lengths
Links = tuple[list[tuple[SX, SX]], Sequence[SX]]
"""A finger's links: both ends (3,) of each one's axis, and its radius."""

COLLISION = Term(
    "collision",
    "Bodies overlapping",
    "eq. 2.20",
    "length",
    "sum",
    {"synthesis": Weight((0.1, 5.0, 100.0), "sample"), "whole_hand": Weight(100.0)},
)
PALM_CLEARANCE = Term(
    "palm_clearance", "Object and palm overlapping", "section 3.2.3", "length", "sum", {"floating": Weight(100.0)}
)


def overlap(depth: SX) -> SX:
    """The cost of how far bodies are into each other or the clearance asked of them, elementwise; plain values."""
    return penalty_spline(depth, _ROUNDING)


def links_and_object(
    ends: list[tuple[SX, SX]], radii: Sequence[SX], bodies: Sequence[Surface], margin: SX | None = None
) -> SX:
    """Distances (L·K,) between the surfaces of a finger's links and the object's bodies.

    Args:
        ends: both ends (3,) of each link's axis.
        radii: of the links.
        bodies: whose union the object is.
        margin: what costs nothing beyond; where it is given, distances of what is farther may be any that are more.
    """
    found = []
    for (start, end), radius in zip(ends, radii, strict=True):
        for body in bodies:
            enough = None if margin is None else margin + radius + body.radius + _ROUNDING
            found.append(core_distance(Segment(start, end), body.core, enough) - radius - body.radius)
    return ca.vertcat(*found)


def links_and_palm(ends: list[tuple[SX, SX]], radii: Sequence[SX], palm_radius: SX) -> SX:
    """Distances of links from the palm: the first by its far end, the others by both ends and the middle.

    Where two links meet, the farther one's radius counts: none is thinner than the one before.
    """
    meeting = [*radii[1:], radii[-1]]
    points = [(ends[0][1], meeting[0])]
    for j, (start, end) in enumerate(ends[1:], start=1):
        points += [((start + end) / 2, radii[j]), (end, meeting[j])]
    return ca.vertcat(*[point_disc_distance(point, palm_radius) - radius for point, radius in points])


def links_and_ground(ends: list[tuple[SX, SX]], radii: Sequence[SX], up: SX, height: SX) -> SX:
    """Heights (L + 1,) of links above the ground, whose normal is ``up`` and whose points p have up·p = height.

    Where two links meet, the farther one's radius counts: none is thinner than the one before.
    """
    points = [ends[0][0], *[end for _, end in ends]]
    pairs = zip(points, [*radii, radii[-1]], strict=True)
    return ca.vertcat(*[ca.dot(up, point) - height - radius for point, radius in pairs])


def links_and_links(links: Links, others: Links) -> SX:
    """Distances (L·M,) between the links of two fingers."""
    return ca.vertcat(*[_links_apart(a, b) for a in zip(*links, strict=True) for b in zip(*others, strict=True)])


def two_fingers(links: Links, others: Links, servo: SX | None = None) -> SX:
    """Distances between two fingers: of their links and, where joints hold servos in balls of a radius, of those."""
    apart = links_and_links(links, others)
    return apart if servo is None else ca.vertcat(apart, servos_and_finger(links, others, servo))


def links_of_one(ends: list[tuple[SX, SX]], radii: Sequence[SX]) -> SX:
    """Distances between links of one finger that are not neighbours."""
    links = list(zip(ends, radii, strict=True))
    pairs = [(links[i], links[j]) for i in range(len(links)) for j in range(i + 2, len(links))]
    return ca.vertcat(SX.zeros(0, 1), *[_links_apart(a, b) for a, b in pairs])


def _links_apart(link: tuple[tuple[SX, SX], SX], other: tuple[tuple[SX, SX], SX]) -> SX:
    """Distance between two links, each its ends and its radius."""
    return segment_distance(*link[0], *other[0]) - (link[1] + other[1])


def unfolded(ends: list[tuple[SX, SX]], radius: SX) -> SX:
    """How far neighbours (L - 1,) are from the sharpest fold, a cosine times a radius; no clearance is asked of it."""
    along = [(end - start) / norm(end - start, _ROUNDING) for start, end in ends]
    return ca.vertcat(SX.zeros(0, 1), *[radius * (ca.dot(a, b) - FOLD) for a, b in itertools.pairwise(along)])


# Servos: balls about the joints, which are where links begin.


def servos_and_rest(
    ends: list[tuple[SX, SX]],
    radii: Sequence[SX],
    servo: SX,
    palm_radius: SX,
    bodies: Sequence[Surface],
    up: SX | None,
    height: SX,
) -> SX:
    """Distances between a finger's servos and all that they are not in, but for other fingers.

    Those of the object's bodies; of the palm, but for the first joint, which stands on it; of links that do not meet at
    the joint; of servos that are no neighbours, since neighbours are a link's length apart; and of the ground.

    Args:
        ends: both ends (3,) of each link's axis.
        radii: of the links.
        servo: radius of the ball about a joint that holds its servo.
        palm_radius: of the disc.
        bodies: whose union the object is.
        up: (3,) the ground's normal, whose points p have up·p = height; None without a ground.
        height: of it.
    """
    found = [body.distance_and_normal(at, _CROSSING)[0] - servo for at, _ in ends for body in bodies]
    found += [point_disc_distance(at, palm_radius) - servo for at, _ in ends[1:]]
    for j, (at, _) in enumerate(ends):
        links = [link for i, link in enumerate(zip(ends, radii, strict=True)) if i not in (j - 1, j)]
        found += [point_segment_distance(*link, at) - radius - servo for link, radius in links]
        found += [norm(at - there, _CROSSING) - 2 * servo for there, _ in ends[j + 2 :]]
    if up is not None:
        found += [ca.dot(up, at) - height - servo for at, _ in ends]
    return ca.vertcat(*found)


def servos_and_finger(links: Links, others: Links, servo: SX) -> SX:
    """Distances between servos of two fingers, and of each one's from the other one's links."""
    apart = [
        point_segment_distance(*link, at) - radius - servo
        for one, other in ((links, others), (others, links))
        for at, _ in one[0]
        for link, radius in zip(*other, strict=True)
    ]
    between = [norm(at - there, _CROSSING) - 2 * servo for at, _ in links[0] for there, _ in others[0]]
    return ca.vertcat(*apart, *between)
