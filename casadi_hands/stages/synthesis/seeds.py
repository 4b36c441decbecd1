"""Random starts of fingers (section 2.2.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from casadi_hands.kinematics import STAND
from casadi_hands.kinematics.morphology import FingerSeed, frame_about
from casadi_hands.stages.synthesis.target import Target

Array = NDArray[np.float64]


def random_finger(target: Target, contact: int, joints: int, rng: np.random.Generator) -> FingerSeed:
    """Draw base, lengths, axes, angles and tip points of a finger; one pose serves for all keyframes.

    Lengths are drawn about what it takes to span from the base to the contact.
    """
    low, high = target.joint_limits
    shortest, longest = target.link_length
    direction, distance = rng.uniform(0, 2 * np.pi), np.sqrt(rng.uniform())
    base = (target.palm_radius - target.link_radius) * distance * np.array([np.cos(direction), np.sin(direction)])
    span = np.linalg.norm(target.points[:, contact].mean(axis=0) - np.append(base, STAND * target.link_radius))
    lengths = np.clip(rng.uniform(0.8, 1.6, joints) * span / joints, shortest, longest)
    angles = rng.uniform(0.6 * low, 0.6 * high, joints)
    tip = target.tip_arc * rng.uniform(-0.7, 0.7, (target.strings(contact), 2))
    return FingerSeed(
        base=base,
        lengths=lengths,
        frames=np.array([frame_about(_random_axis(rng)) for _ in range(joints)]),
        axes=np.zeros((joints, 2)),
        angles=np.tile(angles, (len(target.times), 1)),
        tips=tip,
    )


def _random_axis(rng: np.random.Generator) -> Array:
    """A unit vector, uniform over the sphere."""
    vector = rng.normal(size=3)
    return np.asarray(vector / np.linalg.norm(vector))
