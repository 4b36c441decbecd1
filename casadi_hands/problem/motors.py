"""Position-control gains of a hand's joints, derived from what the hand has to hold.

A motor is stiff enough that the load a joint may meet deflects it by 50 mrad, and its own inertia (of rotor and
gears, seen at the joint) answers with a natural frequency of 200 rad/s, critically damped. Every number follows
from mass, gravity and lengths, so a task scaled in length and gravity gets the same behaviour.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING

from casadi_hands.problem.inertia import link_inertial

if TYPE_CHECKING:
    from casadi_hands.problem.hand import Finger, Hand
    from casadi_hands.task import Task

_DEFLECTION = 0.05  # rad, under the reference load
_FREQUENCY = 200.0  # rad/s, of the motor's inertia on its stiffness


@dataclass(frozen=True)
class Motor:
    """A position-controlled joint.

    Attributes:
        stiffness: N·m/rad.
        damping: N·m·s/rad.
        armature: inertia of rotor and gears seen at the joint, kg·m².
    """

    stiffness: float
    damping: float
    armature: float


def joint_motors(task: Task, hand: Hand) -> tuple[Motor, ...]:
    """A motor for every joint, in the order of ``hand.joint_names``.

    Args:
        task: gives the object's mass and weight.
        hand: gives lengths, and the links' own masses.
    """
    gravity = task.force_unit / task.object.mass  # 9.81 where the task has none
    return tuple(
        _motor(finger, j, hand.density, task.object.mass, gravity)
        for finger in hand.fingers
        for j in range(len(finger.links))
    )


def _motor(finger: Finger, joint: int, density: float, object_mass: float, gravity: float) -> Motor:
    """The motor of one joint, for the finger stretched straight out from it."""
    reach, links_mass, links_inertia = 0.0, 0.0, 0.0
    for link in finger.links[joint:]:
        body = link_inertial(link, density)
        links_mass += body.mass
        links_inertia += body.inertia[0, 0] + body.mass * (reach + link.length / 2) ** 2
        reach += link.length
    stiffness = (object_mass + links_mass) * gravity * reach / _DEFLECTION
    armature = stiffness / _FREQUENCY**2
    return Motor(stiffness, 2 * sqrt(stiffness * (armature + links_inertia)), armature)
