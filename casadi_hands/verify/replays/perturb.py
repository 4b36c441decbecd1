"""What may be different from the plan when a hand does the task for real."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from casadi_hands.verify.reading.folder import Folder

DIRECTIONS = np.vstack([np.eye(3), -np.eye(3)])
"""(6, 3) directions of pushes, world."""


@dataclass(frozen=True)
class Perturbation:
    """One way in which the world differs from the plan.

    Attributes:
        mass: factor of the object's mass and inertia.
        friction: factor of every friction coefficient.
        joint_bias: (J,) rad by which the joints' sensors are off; None for none.
        push: (3,) N at the object's centre of mass, world.
        push_start, push_end: s after the motion starts.
        start_shift: (3,) m by which the object starts off its place, world.
        start_turn: (3,) rad, rotation vector by which it starts turned, world.
        stiffness: factor of the motors' stiffness; they stay as damped, relative to critical, and press as planned.
        effort: factor of the motors' torque limits.
        squeeze: factor of what the commands are ahead of the planned angles, and so of the grip.
    """

    mass: float = 1.0
    friction: float = 1.0
    joint_bias: tuple[float, ...] | None = None
    push: tuple[float, float, float] = (0.0, 0.0, 0.0)
    push_start: float = 0.0
    push_end: float = 0.0
    start_shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    start_turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stiffness: float = 1.0
    effort: float = 1.0
    squeeze: float = 1.0

    @property
    def displaced(self) -> bool:
        """Whether the object starts off its place."""
        return any(self.start_shift) or any(self.start_turn)


def draw_perturbation(folder: Folder, seed: int, number: int) -> Perturbation:
    """Draw everything at once: the ``number``-th of a series that the seed fixes.

    Mass and friction within 20 %, every joint's sensor off by 0.5 degrees to either side, a push of half the weight for
    0.1 to 0.2 s in one of six directions, and a start 2 mm and 2 degrees off in a random direction.
    """
    random = np.random.default_rng([seed, number])
    last = float(folder.motion.time[-1])
    length = random.uniform(0.1, 0.2)
    start = random.uniform(0.0, max(last - length, 0.0))
    push = 0.5 * folder.weight * DIRECTIONS[number % len(DIRECTIONS)]
    bias = np.deg2rad(0.5) * random.choice([-1.0, 1.0], size=len(folder.motion.joint_names))
    return Perturbation(
        mass=random.uniform(0.8, 1.2),
        friction=random.uniform(0.8, 1.2),
        joint_bias=tuple(bias.tolist()),
        push=_triple(push),
        push_start=start,
        push_end=start + length,
        start_shift=_triple(2e-3 * _direction(random)),
        start_turn=_triple(np.deg2rad(2.0) * _direction(random)),
    )


def _direction(random: np.random.Generator) -> np.ndarray:
    vector = random.normal(size=3)
    unit: np.ndarray = vector / np.linalg.norm(vector)
    return unit


def _triple(vector: np.ndarray) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
