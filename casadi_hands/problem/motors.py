"""The motors of a hand's joints: springs about their set points, as stiff as the task says.

A motor's own inertia (of rotor and gears, seen at the joint) answers with a natural frequency of 200 rad/s. Where the
task names no damping it is critical, the links beyond the joint moving along, stretched straight out.

Where joints share motors, the same spring and damper are between each joint and what its motors turn: a drum, a belt,
a flexure; the inertia is that of the joint's pulley then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING

from casadi_hands.problem.inertia import Inertial, body_inertials

if TYPE_CHECKING:
    from casadi_hands.problem.hand import Finger, Hand
    from casadi_hands.task import Actuator, Task

_FREQUENCY = 200.0  # rad/s, of the motor's inertia on its stiffness
_STIFFER, _QUICK = 100.0, 1000.0  # of motors that share joints: than their springs together; rad/s


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
        task: names the actuator.
        hand: whose links the motors move.
    """
    inertials = body_inertials(hand)
    return tuple(
        _motor(task.actuator, finger, j, [inertials[f"finger{i}_link{k}"] for k in range(len(finger.links))])
        for i, finger in enumerate(hand.fingers)
        for j in range(len(finger.links))
    )


def shared_motors(task: Task, hand: Hand) -> tuple[Motor, ...]:
    """The motors that share the joints, each a hundred times as stiff as all springs it pulls at, seen at its shaft.

    They are held at what they are told, with a natural frequency of 1000 rad/s, critically damped.

    Args:
        task: names the joints' stiffness.
        hand: with a drive.
    """
    assert hand.drive is not None
    return tuple(shared_motor(task.actuator.stiffness, column) for column in zip(*hand.drive.ratios, strict=True))


def shared_motor(stiffness: float, ratios: Sequence[float]) -> Motor:
    """A motor that turns joints of a stiffness, N·m/rad, by ratios (J,)."""
    stiff = _STIFFER * stiffness * sum(ratio**2 for ratio in ratios)
    return Motor(stiff, 2 * stiff / _QUICK, stiff / _QUICK**2)


def _motor(actuator: Actuator, finger: Finger, joint: int, bodies: Sequence[Inertial]) -> Motor:
    """The motor of one joint of a finger whose links have these mass properties."""
    armature = actuator.stiffness / _FREQUENCY**2
    if actuator.damping is not None:
        return Motor(actuator.stiffness, actuator.damping, armature)
    reach, links = 0.0, 0.0
    for link, body in zip(finger.links[joint:], bodies[joint:], strict=True):
        links += max(body.inertia[0, 0], body.inertia[1, 1]) + body.mass * (reach + body.center[2]) ** 2
        reach += link.length
    return Motor(actuator.stiffness, 2 * sqrt(actuator.stiffness * (armature + links)), armature)
