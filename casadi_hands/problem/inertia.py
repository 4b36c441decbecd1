"""Mass and inertia of the solids a hand is made of, in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from casadi_hands.problem.hand import Hand, Link


@dataclass(frozen=True)
class Inertial:
    """Mass properties of one rigid body.

    Attributes:
        mass: kg.
        center: (3,) centre of mass in the body's frame, m.
        inertia: (3, 3) about the centre of mass, axes of the body's frame, kg·m².
    """

    mass: float
    center: np.ndarray
    inertia: np.ndarray


def capsule_inertial(length: float, radius: float, density: float) -> Inertial:
    """Mass properties of a solid capsule whose axis runs from the origin to ``(0, 0, length)``.

    A cylinder and two half spheres; a half sphere's own centre of mass is 3/8 of the radius off its flat face.

    Args:
        length: of the axis, m.
        radius: m.
        density: kg/m³.
    """
    cylinder = density * pi * radius**2 * length
    ball = density * 4 / 3 * pi * radius**3
    along = cylinder * radius**2 / 2 + ball * 2 / 5 * radius**2
    across = cylinder * (length**2 / 12 + radius**2 / 4) + ball * (
        2 / 5 * radius**2 + length**2 / 4 + 3 / 8 * length * radius
    )
    return Inertial(cylinder + ball, np.array([0.0, 0.0, length / 2]), np.diag([across, across, along]))


def link_inertial(link: Link, density: float) -> Inertial:
    """Mass properties of a finger segment in its link frame; `density` in kg/m³."""
    return capsule_inertial(link.length, link.radius, density)


def palm_inertial(hand: Hand) -> Inertial:
    """Mass properties of the palm's disc, which reaches from z = -thickness to z = 0 of the palm frame."""
    mass = hand.density * pi * hand.palm_radius**2 * hand.palm_thickness
    across = mass * (hand.palm_radius**2 / 4 + hand.palm_thickness**2 / 12)
    center = np.array([0.0, 0.0, -hand.palm_thickness / 2])
    return Inertial(mass, center, np.diag([across, across, mass * hand.palm_radius**2 / 2]))
