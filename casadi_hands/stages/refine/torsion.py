"""Soft fingertips in the refine stage: a torsional moment at every contact, at its limit against the spin.

The moment on the object is ρ t n: ρ the radius of the torsional friction, n the object's outward normal, and t (m·g)
the variable ``torsion``. Where a contact rests, t is whatever balance asks, within its cone together with the
tangential force. Where it spins it is at its limit against the spin, so that the plan counts on nothing else. It
then slips a little, too, which the plan leaves out and keeps small.
"""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np
from casadi import SX

from casadi_hands.geometry.bodies import Body
from casadi_hands.nlp import Kernel
from casadi_hands.stages.refine.declaration import Declaration
from casadi_hands.terms import constraints as limits
from casadi_hands.terms import contact as contact_terms

ROUNDING = 1e-6  # lengths, of distances where they vanish


def twist_torque(kernel: Kernel, soft: bool, place: int | None = None) -> SX:
    """Declare the torque (3,) of all fingers' torsion, object frame, in a kernel; zero of hard points."""
    tag = "" if place is None else str(place)
    return kernel.variable(f"twist_torque{tag}", 3, "twist_torque", place) if soft else SX.zeros(3, 1)


@cache
def torque(kinds: tuple[type[Body], ...]) -> Kernel:
    """The torque (3,), object frame, of all fingers' torsion at a knot, as a variable of its own.

    Args:
        kinds: of the body that each finger touches.
    """
    kernel = Kernel("torsion_torque")
    total, radius = kernel.variable("twist_torque", 3), kernel.parameter("torsion_radius")
    made, torsions = SX.zeros(3, 1), []
    for i, kind in enumerate(kinds):
        point = kernel.variable(f"point{i}", 3, "point", i)
        torsions.append(kernel.variable(f"torsion{i}", 1, "torsion", i))
        touched = kind.surface(kernel.parameter(f"body{i}", kind.width, "body", i))
        made += torsions[i] * touched.distance_and_normal(point, ROUNDING)[1]
    kernel.constrain(limits.TORSION_OF_CONTACTS, radius * made - total)
    kernel.cost(contact_terms.TORSION, ca.vertcat(*torsions))
    return kernel


def _limit(force: SX, point: SX, body: SX, kind: type[Body], friction: SX) -> tuple[SX, SX]:
    """The largest torsion over its radius, m·g, beside a force (3,) at a point (3,), and the part (3,) of it across."""
    normal = kind.surface(body).distance_and_normal(point, ROUNDING)[1]
    pressing = -ca.dot(force, normal)
    across = force + pressing * normal
    return contact_terms.torsion_limit(pressing, ca.sumsqr(across), friction), across


@cache
def cone(kind: type[Body]) -> Kernel:
    """One contact's torsion at one knot, within the cone together with the tangential force."""
    kernel = Kernel("torsion_cone")
    force, point, torsion = kernel.variable("force", 3), kernel.variable("point", 3), kernel.variable("torsion", 1)
    body, friction = kernel.parameter("body", kind.width), kernel.parameter("sliding_friction")
    kernel.constrain(limits.TORSION_CONE, _limit(force, point, body, kind, friction)[0] ** 2 - torsion**2)
    return kernel


@cache
def law(kind: type[Body]) -> Kernel:
    """One contact's torsion from one knot to the next: at its limit against the spin, of a free size at rest.

    Constraints: ``torsion_law`` (1). ``holding`` is the share of the torsion that spin leaves free, bounded. Costs:
    ``pivot_slip`` (3), by which it would slip while it spins.
    """
    kernel = Kernel("torsion_law")
    forces = [kernel.variable(f"force{i}", 3, "force", i) for i in range(2)]
    points = [kernel.variable(f"point{i}", 3, "point", i) for i in range(2)]
    torsions = [kernel.variable(f"torsion{i}", 1, "torsion", i) for i in range(2)]
    spin, body = kernel.variable("spin", 1), kernel.parameter("body", kind.width)
    friction, holding = kernel.parameter("sliding_friction"), kernel.variable("holding", 1)
    scale, radius = kernel.parameter("spin_scale"), kernel.parameter("torsion_radius")
    fully = contact_terms.saturated(spin, scale)
    limited = [_limit(f, p, body, kind, friction) for f, p in zip(forces, points, strict=True)]
    most, across = ((limited[0][k] + limited[1][k]) / 2 for k in range(2))
    mean = (torsions[0] + torsions[1]) / 2
    kernel.constrain(limits.TORSION_LAW, mean + most * (fully - (1 - fully**2) * holding))
    kernel.cost(contact_terms.PIVOT_SLIP, contact_terms.pivot_slip(spin, scale, across, most, friction, radius))
    return kernel


def bind(of: Declaration) -> None:
    """Bind the torsion of all fingers' contacts."""
    structure, problem = of.structure, of.problem
    kinds = tuple(type(structure.model.touched[c]) for c in structure.contacts)
    own = [
        (of.point.entries(3 * i, 3 * i + 3, c), of.force.entries(3 * i, 3 * i + 3, c), of.torsion.entries(i, i + 1, c))
        for i, c in enumerate(structure.contacts)
    ]
    of.bind(
        np.arange(of.knots),
        torque(kinds),
        {"torsion": (0, 0)},
        twist_torque=of.twist_torque,
        point=[point for point, _, _ in own],
        torsion=[torsion for _, _, torsion in own],
        torsion_radius=problem["torsion_radius"],
        body=[problem[f"body{c}"] for c in structure.contacts],
    )
    for i, c in enumerate(structure.contacts):
        point, force, torsion = own[i]
        active, start = np.flatnonzero(structure.active[:, i]), np.flatnonzero(structure.active[:-1, i])
        of.bind(
            active,
            cone(kinds[i]),
            {"torsion_cone": (0, np.inf)},
            (c,),
            f"torsion_cone{c}",
            force=force.take(active),
            point=point.take(active),
            torsion=torsion.take(active),
            **problem.given("sliding_friction"),
            **of.of(c, active, "body"),
        )
        of.bind(
            start,
            law(kinds[i]),
            {"torsion_law": (0, 0)},
            (c,),
            f"torsion_law{c}",
            **{
                name: (rows.take(start), rows.take(start + 1))
                for name, rows in (("force", force), ("point", point), ("torsion", torsion))
            },
            spin=of.spin.take(start).entries(i, i + 1, c),
            holding=of.holding.take(start).entries(i, i + 1, c),
            **problem.given("sliding_friction", "spin_scale", "torsion_radius"),
            **of.of(c, start, "body"),
        )
