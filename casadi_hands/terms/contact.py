"""Terms of one contact point on the object; points, forces and normals in the object's frame."""

from __future__ import annotations

import casadi as ca
from casadi import SX

from casadi_hands.geometry import norm, project_to_capsule, soft_exponential


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


def off_surface(force: SX, activity: SX, point: SX, projection: SX) -> SX:
    """‖f‖ c ‖proj(r) - r‖² (eq. 2.10 and its form for fingers); a plain value."""
    return norm(force, 1e-3) * activity * ca.sumsqr(projection - point)


def gap_rate(force: SX, activity: SX, gap: SX, gap_before: SX, step: SX) -> SX:
    """‖c f‖ times the rate of proj(r) - r, (3,) (eq. 2.12); blind to sliding along the surface."""
    return activity * norm(force, 1e-3) * (gap - gap_before) / step


def slip(force: SX, activity: SX, point: SX, point_before: SX, step: SX) -> SX:
    """‖c f‖ times the velocity of the contact point over its body, (3,); what eq. 2.12 was meant to see."""
    return activity * norm(force, 1e-3) * (point - point_before) / step


def acceleration(point_before: SX, point: SX, point_after: SX, step: SX) -> SX:
    """Second difference over the step, (3,) (eq. 2.13, as printed)."""
    return (point_after - 2 * point + point_before) / step


def surface(point: SX, capsule: SX) -> tuple[SX, SX, SX]:
    """Projection (3,), outward normal (3,) and signed distance of a point from a primitive.

    Args:
        point: (3,).
        capsule: (7,) start, end and radius in the point's frame.
    """
    return project_to_capsule(point, capsule[:3], capsule[3:6], capsule[6])
