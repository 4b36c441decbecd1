"""Contacts that may slide in the refine stage: friction on its cone against the slip, as physics asks.

Over an interval between knots, φ says which way the contact slides: 0 at rest, a unit vector where it is quick. The
mean tangential force on the object is μ f_n (φ + (1 - φ²) s): s, the variable ``sticking``, is whatever balance asks,
within the margin's share of friction. At rest that is the friction cone with its margin; where the contact slides
nothing of it is left, and friction is on its cone. The object is dragged along by the fingertip: with the slip, which
is how much farther the contact goes over the object than over the link.
"""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from casadi_hands.geometry.bodies import Body
from casadi_hands.geometry.surface import tangents
from casadi_hands.nlp import Kernel
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.placement import contact_slips
from casadi_hands.stages.refine.declaration import FREE, Declaration
from casadi_hands.stages.refine.touching import runs
from casadi_hands.terms import constraints as limits
from casadi_hands.terms import contact as contact_terms

Array = NDArray[np.float64]
ROUNDING = 1e-6  # lengths, of distances where they vanish
SLIP_SCALE = 2.5e-4  # m/s: a contact that slides quicker has its friction on the cone, or nearly so
STRAIGHT = 0.1  # of that scale: slower slip counts as at least that much of the way
FREE_AT_FIRST = 0.3  # share of the friction, less than any margin leaves to contacts at rest
WHOLE = 0.999  # of the friction that forces at knots may use, so that rounding takes none out of the cone


@cache
def law(kind: type[Body]) -> Kernel:
    """One contact from one knot to the next: its mean tangential force follows the slip.

    Constraints: ``law`` (2: over friction), ``sticking`` (1: room of the free part).
    """
    kernel = Kernel("sliding_law")
    forces = [kernel.variable(f"force{i}", 3, "force", i) for i in range(2)]
    points = [kernel.variable(f"point{i}", 3, "point", i) for i in range(2)]
    slip, sticking = kernel.variable("slip", 2), kernel.variable("sticking", 2)
    body, helper = kernel.parameter("body", kind.width), kernel.parameter("helper", 3)
    friction, margin = kernel.parameter("sliding_friction"), kernel.parameter("slide_margin")
    across, pressing = SX.zeros(2, 1), SX.zeros(1, 1)
    for force, point in zip(forces, points, strict=True):
        normal = kind.surface(body).distance_and_normal(point, ROUNDING)[1]
        first, second = tangents(normal, helper)
        across += ca.vertcat(ca.dot(first, force), ca.dot(second, force)) / 2
        pressing -= ca.dot(force, normal) / 2
    way = contact_terms.saturated(slip, kernel.parameter("slip_scale"))
    used = way + (1 - ca.sumsqr(way)) * sticking
    kernel.constrain(limits.SLIDING_LAW, across / friction - pressing * used)
    kernel.constrain(limits.STICKING, margin**2 - ca.sumsqr(sticking))
    return kernel


@cache
def path(intervals: int) -> Kernel:
    """How far one contact slides from touch to lift, lengths."""
    kernel = Kernel("slide_path")
    slips = [kernel.variable(f"slip{i}", 2, "slip", i) for i in range(intervals)]
    steps = [kernel.parameter(f"step{i}", 1, "step", i) for i in range(intervals)]
    least = STRAIGHT * kernel.parameter("slip_scale")
    ways = [step * ca.sqrt(ca.sumsqr(slip) + least**2) for slip, step in zip(slips, steps, strict=True)]
    kernel.constrain(limits.WITHIN_SLIP, ca.sum1(ca.vertcat(*ways)))
    return kernel


def bind(of: Declaration) -> None:
    """Bind the friction of all fingers' contacts to their slip, and keep each stretch from touch to lift."""
    structure, problem = of.structure, of.problem
    for i, c in enumerate(structure.contacts):
        start = np.flatnonzero(structure.active[:-1, i])
        point, force = (rows.entries(3 * i, 3 * i + 3, c) for rows in (of.point, of.force))
        slip = of.slip.entries(2 * i, 2 * i + 2, c)
        of.bind(
            start,
            law(type(structure.model.touched[c])),
            {"law": (0.0, 0.0), "sticking": (0.0, np.inf)},
            (c,),
            f"sliding{c}",
            force=(force.take(start), force.take(start + 1)),
            point=(point.take(start), point.take(start + 1)),
            slip=slip.take(start),
            sticking=of.sticking.take(start).entries(2 * i, 2 * i + 2, c),
            **problem.given("sliding_friction", "slide_margin", "slip_scale"),
            **of.of(c, start, "body", "helper"),
        )
        for k, run in enumerate(runs(structure.active[:-1, i])):
            each = [run[j : j + 1] for j in range(len(run))]
            of.bind(
                run[:1],
                path(len(run)),
                {"path": FREE},
                (c,),
                f"slide{c}_{k}",
                slip=[slip.take(interval) for interval in each],
                step=of.steps(*each),
                **problem.given("slip_scale"),
            )


def start(model: Model, motion: WholeHand, helpers: Array, active: NDArray[np.bool_]) -> dict[str, Array]:
    """Slip (S - 1, 2 F) of a motion's contacts, and the free part of their friction, within any margin.

    Args:
        model: the task.
        motion: on the knots.
        helpers: (F, S, 3) across each contact's normal, object frame.
        active: (S, F) when each contact touches.
    """
    slips, stickings = [], []
    scale, steps = SLIP_SCALE / model.units.length, np.diff(model.schedule.samples)[:, None]
    for i, c in enumerate(motion.contacts):
        normals = np.array([model.touched[c].outward(point) for point in motion.point[:, c]])
        first, second, force = np.cross(helpers[i], normals), np.zeros_like(normals), motion.force[:, c]
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        second = np.cross(normals, first)
        touching = active[:-1, i, None]
        moved = contact_slips(model, motion, i) / steps
        slip = touching * np.column_stack([(t[:-1] * moved).sum(axis=1) for t in (first, second)])
        across = np.column_stack([(t * force).sum(axis=1) for t in (first, second)])
        pressing = np.maximum(-(force * normals).sum(axis=1, keepdims=True), 1e-3)
        used, left = ((a[1:] + a[:-1]) / 2 for a in (across / model.friction, pressing))
        way = slip / np.sqrt((slip**2).sum(axis=1, keepdims=True) + scale**2)
        free = touching * (used / left - way) / (1 - (way**2).sum(axis=1, keepdims=True))
        size = np.linalg.norm(free, axis=1, keepdims=True)
        slips.append(slip)
        stickings.append(free * np.minimum(1.0, FREE_AT_FIRST / np.maximum(size, 1e-9)))
    return {"slip": np.hstack(slips), "sticking": np.hstack(stickings)}
