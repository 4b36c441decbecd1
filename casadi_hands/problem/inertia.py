"""Mass and inertia of the solids a hand is made of, in closed form."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from casadi_hands.task.servos import SERVOS

if TYPE_CHECKING:
    from casadi_hands.geometry.bodies import Solid
    from casadi_hands.problem.hand import Hand, Link

_LEVEL = 1e-6  # of a unit vector, what no direction can be read off


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
    body = capsule_inertial(link.length - link.hinge, link.radius, density)
    return replace(body, center=body.center + np.array([0.0, 0.0, link.hinge]))


def palm_inertial(hand: Hand) -> Inertial:
    """Mass properties of the palm: a disc from z = -thickness to z = 0 of its frame, and the balls of first joints."""
    mass = hand.density * pi * hand.palm_radius**2 * hand.palm_thickness
    across = mass * (hand.palm_radius**2 / 4 + hand.palm_thickness**2 / 12)
    center = np.array([0.0, 0.0, -hand.palm_thickness / 2])
    disc = Inertial(mass, center, np.diag([across, across, mass * hand.palm_radius**2 / 2]))
    return joined(disc, *(ball_inertial(ball, hand.density) for ball in hand.palm_balls))


def ball_inertial(ball: Solid, density: float) -> Inertial:
    """Mass properties of a solid ball; `density` in kg/m³."""
    mass = density * 4 / 3 * pi * ball.radius**3
    return Inertial(mass, ball.start, 2 / 5 * mass * ball.radius**2 * np.eye(3))


@dataclass(frozen=True)
class Case:
    """The case of a servo, its shaft on a joint's axis and its middle on the joint.

    Attributes:
        size: (3,) sides, m.
        center: (3,) in the frame of the body that holds it, m.
        turn: (3, 3) its axes in that frame: the shaft, the longest side across it, the other side.
        mass: kg.
    """

    size: np.ndarray
    center: np.ndarray
    turn: np.ndarray
    mass: float

    @property
    def inertial(self) -> Inertial:
        """Of an even box, in the frame of the body that holds it."""
        square = self.size**2
        local = self.mass / 12 * np.diag(square.sum() - square)
        return Inertial(self.mass, self.center, self.turn @ local @ self.turn.T)


def servo_cases(hand: Hand) -> dict[str, tuple[Case, ...]]:
    """The servos that each body of a hand holds, by its name: the palm those of first joints, a link the next joint's.

    Cases stand along the link that holds them as far as the joint's axis lets them.
    """
    if hand.servo is None:
        return {}
    servo = SERVOS[hand.servo]
    held: dict[str, tuple[Case, ...]] = {}
    for i, finger in enumerate(hand.fingers):
        center = np.array(finger.base)
        for j, link in enumerate(finger.links):
            body = f"finger{i}_link{j - 1}" if j else "palm"
            case = Case(np.array(servo.size), center, _along(link.turn.apply(link.axis)), servo.mass)
            held[body] = (*held.get(body, ()), case)
            center = np.array([0.0, 0.0, link.length])
    return held


def body_inertials(hand: Hand) -> dict[str, Inertial]:
    """Mass properties of every body of a hand by its name, the servos that it holds among them."""
    bodies = {"palm": palm_inertial(hand)}
    for i, finger in enumerate(hand.fingers):
        bodies |= {f"finger{i}_link{j}": link_inertial(link, hand.density) for j, link in enumerate(finger.links)}
    for name, cases in servo_cases(hand).items():
        bodies[name] = joined(bodies[name], *(case.inertial for case in cases))
    return bodies


def joined(*parts: Inertial) -> Inertial:
    """Mass properties of several bodies in one frame, as one."""
    mass = sum(part.mass for part in parts)
    center = sum((part.mass * part.center for part in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        arm = part.center - center
        inertia += part.inertia + part.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return Inertial(mass, center, inertia)


def _along(axis: np.ndarray) -> np.ndarray:
    """Axes (3, 3) by columns: a unit axis, the direction across it that is nearest to z, and the third."""
    across = np.array([0.0, 0.0, 1.0]) - axis[2] * axis
    if np.linalg.norm(across) < _LEVEL:
        across = np.array([1.0, 0.0, 0.0]) - axis[0] * axis
    across /= np.linalg.norm(across)
    return np.column_stack([axis, across, np.cross(axis, across)])
