"""Which servos of the library would do what a motion asks of its motors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from casadi_hands.export.report.words import joint_title
from casadi_hands.task.servos import SERVOS, Servo

if TYPE_CHECKING:
    from casadi_hands.problem.hand import Hand
    from casadi_hands.problem.motion import Motion


@dataclass(frozen=True)
class Demand:
    """What a motion asks of one motor.

    Attributes:
        name: of the joint that it turns, or of the motor where motors share joints.
        torque: (T,) N·m, its size.
        speed: (T,) rad/s, its size at the same times.
    """

    name: str
    torque: np.ndarray
    speed: np.ndarray


@dataclass(frozen=True)
class Fit:
    """How much of a servo is used; 1 is all of it.

    Attributes:
        servo: its name.
        torque: the largest torque over what it can hold.
        moment: the largest torque over what it gives for a moment.
        speed: the largest speed over what it has left at the torque of that time; infinite beyond its stall torque.
    """

    servo: str
    torque: float
    moment: float
    speed: float

    @property
    def does(self) -> bool:
        """Whether it would do, all the time."""
        return self.torque <= 1.0 and self.speed <= 1.0

    @property
    def words(self) -> str:
        """The same as a reader likes it."""
        if self.does:
            return "would do"
        if self.moment >= 1.0:
            return "too weak"
        if self.speed > 1.0:
            return "too slow"
        return "only for moments"


def demands(hand: Hand, motion: Motion) -> list[Demand]:
    """What a motion asks of the motors: of each joint's own, or of those that share the joints.

    A shared motor feels its joints' torques times its ratios, by virtual work, and goes straight from sample to sample.

    Args:
        hand: with its drive.
        motion: with the torques and velocities of its joints.
    """
    assert motion.joint_torques is not None
    assert motion.joint_velocities is not None
    if hand.drive is None or motion.motor_positions is None:
        names = [joint_title(hand, i, j) for i, finger in enumerate(hand.fingers) for j in range(len(finger.links))]
        torque, speed = np.abs(motion.joint_torques), np.abs(motion.joint_velocities)
    else:
        names = [f"motor {m + 1}" for m in range(hand.motors)]
        felt = np.abs(motion.joint_torques @ np.array(hand.drive.ratios))
        torque = np.maximum(felt[1:], felt[:-1])
        speed = np.abs(np.diff(motion.motor_positions, axis=0)) / np.diff(motion.time)[:, None]
    return [Demand(name, torque[:, k], speed[:, k]) for k, name in enumerate(names)]


def fit(name: str, asked: list[Demand]) -> Fit:
    """How much of a servo the most demanding of motors uses, if all are of this kind.

    Args:
        name: in `SERVOS`.
        asked: of each motor.
    """
    servo = SERVOS[name]
    largest = max((float(each.torque.max(initial=0.0)) for each in asked), default=0.0)
    speed = max((_speed_share(servo, each) for each in asked), default=0.0)
    return Fit(name, largest / servo.continuous, largest / servo.stall, speed)


def lightest(asked: Demand) -> str | None:
    """The lightest servo that would do in one place, or None where none of the library does."""
    doing = [name for name in SERVOS if fit(name, [asked]).does]
    return min(doing, key=lambda name: SERVOS[name].mass, default=None)


def _speed_share(servo: Servo, asked: Demand) -> float:
    left = servo.no_load * (1.0 - asked.torque / servo.stall)
    if (left <= 0.0).any():
        return float("inf")
    return float((asked.speed / left).max(initial=0.0))
