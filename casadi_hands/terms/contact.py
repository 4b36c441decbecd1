"""Terms of one contact point on the object; points, forces and normals in the object's frame."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
from casadi import SX

from casadi_hands.declared import Term, Weight
from casadi_hands.geometry import norm, soft_exponential

FORCE_REGULARISATION = Term(
    "force_regularisation", "Forces that act", "eq. 2.7", "m·g", weights={"floating": Weight(0.01)}
)
RAW_FORCE = Term(
    "raw_force", "Forces whether their contact is active or not", "", "m·g", weights={"floating": Weight(0.01)}
)
FRICTION_CONE = Term("friction_cone", "Friction", "eq. 2.8", "", "sum", {"floating": Weight(0.1)})
CONTACT_ON_OBJECT = Term(
    "contact_on_object",
    "Contact on the object's surface",
    "eq. 2.10",
    "m·g·length²",
    "sum",
    {"floating": Weight(100.0), "whole_hand": Weight(100.0)},
)
SLIP_ON_OBJECT = Term(
    "slip_on_object",
    "Change of the gap to the object",
    "eq. 2.12",
    "m·g·length/s",
    weights={"floating": Weight(100.0), "whole_hand": Weight(10.0)},
)
TANGENTIAL_SLIP = Term(
    "tangential_slip", "Slip of the contact along the object", "", "m·g·length/s", weights={"floating": Weight(10.0)}
)
CONTACT_ACCELERATION = Term(
    "contact_acceleration", "Contacts' acceleration", "eq. 2.13", "length/s", weights={"floating": Weight(0.01)}
)
CONTACT_PATCH = Term(
    "contact_patch", "Contacts away from where the task put them", "", "length", weights={"floating": Weight(1.0)}
)
# The ground's contact takes the weights of the fingers' ones.
GROUND_FRICTION_CONE = replace(FRICTION_CONE, name="ground_friction_cone", weights={}, weighs_as="friction_cone")
CONTACT_ON_GROUND = replace(CONTACT_ON_OBJECT, name="contact_on_ground", weights={}, weighs_as="contact_on_object")
SLIP_ON_GROUND = replace(TANGENTIAL_SLIP, name="slip_on_ground", weights={}, weighs_as="tangential_slip")
CONTACT_ON_FINGER = Term(
    "contact_on_finger",
    "Contact on the fingertip's surface",
    "eq. 2.19",
    "m·g·length²",
    "sum",
    {"whole_hand": Weight(100.0)},
)
SLIP_ON_FINGER = Term(
    "slip_on_finger",
    "Slip of the contact along the fingertip",
    "",
    "m·g·length/s",
    weights={"whole_hand": Weight(10.0)},
)
FRICTION_CONE_HAND = replace(
    FRICTION_CONE,
    name="friction_cone_hand",
    about="Friction against the fingertip's normal",
    equation="eq. 2.30",
    weights={"whole_hand": Weight(0.1)},
)
# The refinement's.
STAY_POINT = Term(
    "stay_point", "Contacts away from where they begin", "", "length", weights={"refine": Weight(1.0, "knot")}
)
STAY_FORCE = Term(
    "stay_force", "Forces other than those it begins with", "", "m·g", weights={"refine": Weight(0.02, "knot")}
)
GRIP = Term(
    "grip",
    "Normal force, which stiffness has to make up for",
    "",
    "m·g",
    weights={"refine": Weight(0.05, "knot")},
)
GROUND_LOAD = Term(
    "ground_load",
    "The ground's normal force, whose friction along a line or a face resists turns that are not planned to be",
    "",
    "m·g",
    weights={"refine": Weight(20.0, "knot")},
)
GROUND_WANDER = Term(
    "ground_wander",
    "Changes of how fast the contact on the ground moves along the object, which little load leaves free",
    "",
    "length/s",
    weights={"refine": Weight(10.0, "knot")},
)
FRICTION_MARGIN = Term(
    "friction_margin",
    "Fourth power of the friction in use",
    "eq. 2.8",
    "",
    weights={"refine": Weight(0.02, "knot")},
)
SLIP = Term("slip", "Slip from knot to knot", "eq. 2.12", "length/s", weights={"refine": Weight(3.0, "knot")})
SPIN = Term("spin", "Spin about the contact's normal", "", "rad/s", weights={"refine": Weight(0.1, "knot")})
PIVOT_SLIP = Term(
    "pivot_slip",
    "Slip of contacts that spin, which goes with what they bear across; 0 until a motion resists slow spins",
    "",
    "length/s",
    weights={"refine": Weight(3000.0, "knot")},
)
TORSION = Term("torsion", "Torsion, over its radius", "", "m·g", weights={"refine": Weight(0.01, "knot")})


def friction_cone(force: SX, inward_normal: SX, friction: SX, sharpness: SX) -> SX:
    """exp(α(‖f_t‖ - μ f_n)), f_n into the body (eq. 2.8, 2.30); a plain value, continued quadratically above 10.

    Args:
        force: (3,) on the body, m·g.
        inward_normal: (3,) unit, into the body.
        friction: μ.
        sharpness: α.
    """
    pressing = ca.dot(force, inward_normal)
    tangential = norm(force - pressing * inward_normal, 1e-3)
    return soft_exponential(sharpness * (tangential - friction * pressing))


def cone_margin(force: SX, inward_normal: SX, friction: SX) -> SX:
    """μ f_n - ‖f_t‖ in m·g, rounded to the safe side where the tangential force vanishes; negative outside the cone."""
    pressing = ca.dot(force, inward_normal)
    return friction * pressing - norm(force - pressing * inward_normal, 1e-3)


def cone_margin_squared(pressing: SX, across: SX, friction: SX) -> SX:
    """(μ f_n)² - f_t² in (m·g)²; negative outside the cone, for normal forces that are bounded below.

    Without a square root, whose rounding (see ``cone_margin``) an exact motion would rest on; the soft stages,
    where normal forces may turn negative, need the other form, which tells the two cones apart.

    Args:
        pressing: normal force f_n, m·g.
        across: square of the tangential force f_t, (m·g)².
        friction: μ.
    """
    return (friction * pressing) ** 2 - across


def off_surface(force: SX, invariant: SX, point: SX, projection: SX) -> SX:
    """‖f‖ c ‖proj(r) - r‖² (eq. 2.10 and its form for fingers); a plain value."""
    return norm(force, 1e-3) * invariant * ca.sumsqr(projection - point)


def gap_rate(force: SX, invariant: SX, gap: SX, gap_before: SX, step: SX) -> SX:
    """‖c f‖ times the rate of proj(r) - r, (3,) (eq. 2.12); blind to sliding along the surface."""
    return invariant * norm(force, 1e-3) * (gap - gap_before) / step


def slip(force: SX, invariant: SX, point: SX, point_before: SX, step: SX) -> SX:
    """‖c f‖ times the velocity of the contact point over its body, (3,); what eq. 2.12 was meant to see."""
    return invariant * norm(force, 1e-3) * (point - point_before) / step


def acceleration(point_before: SX, point: SX, point_after: SX, step: SX) -> SX:
    """Second difference over the step, (3,) (eq. 2.13, as printed)."""
    return (point_after - 2 * point + point_before) / step


def friction_in_use(pressing: SX, across: SX, friction: SX) -> SX:
    """Square of the share of friction in use, softened where nothing presses.

    Args:
        pressing: normal force, m·g.
        across: square of the tangential force, (m·g)².
        friction: μ.
    """
    return across / (friction * pressing + 0.1) ** 2


def spin(change: SX, normal: SX, step: SX) -> SX:
    """Rate of turn about a normal (3,), rad/s, of a change of orientation (3, 3) in one step."""
    turned = ca.vertcat(change[2, 1] - change[1, 2], change[0, 2] - change[2, 0], change[1, 0] - change[0, 1]) / 2
    return ca.dot(turned, normal) / step


def pivoting(spin: SX, quick: float = 0.05) -> SX:
    """Residual whose square is the spin's size, rad/s, and quadratic where it is slow: a contact stays or it pivots."""
    return spin / ca.sqrt(ca.sqrt(spin**2 + quick**2))


def torsion_limit(pressing: SX, across: SX, friction: SX, rounding: float = 1e-6) -> SX:
    """Largest torsion over its radius, m·g: √(f_n² - f_t²/μ²), rounded where nothing is left of it.

    A soft fingertip slips where (f_t / μ)² + (m / ρ)² exceeds f_n² (the ellipse of Howe and Cutkosky, 1996).

    Args:
        pressing: normal force f_n, m·g.
        across: square of the tangential force f_t, (m·g)².
        friction: μ.
        rounding: (m·g)².
    """
    left = pressing**2 - across / friction**2
    return ca.sqrt((left + ca.sqrt(left**2 + rounding**2)) / 2)


def pivot_slip(spin: SX, scale: SX, across: SX, most: SX, friction: SX, radius: SX, rounding: float = 0.05) -> SX:
    """How fast a soft fingertip that spins slips, (3,) lengths/s: ρ |w| f_t / (μ² t), and nothing where it rests.

    Slip and spin together are normal to the ellipse of `torsion_limit`. |w| is smooth: w²/√(w² + scale²).

    Args:
        spin: w, rad/s, about the normal.
        scale: rate of spin that is quick, rad/s.
        across: (3,) tangential force f_t, m·g.
        most: the limit of the torsion over its radius, t, m·g.
        friction: μ.
        radius: ρ, of the torsional friction, lengths.
        rounding: m·g, of the limit where nothing is left of it.
    """
    quick = spin**2 / ca.sqrt(spin**2 + scale**2)
    return quick * radius * across / (friction**2 * (most + rounding))


def saturated(rate: SX, scale: SX) -> SX:
    """Which way a contact slides or spins: its rate over its size where it is quick, and 0 where it rests.

    Args:
        rate: (n,) of slip or spin.
        scale: what is quick, in the same unit.
    """
    return rate / ca.sqrt(ca.sumsqr(rate) + scale**2)
