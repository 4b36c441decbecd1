"""What may be different from the plan when a hand does the task for real."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from casadi_hands.verify.reading.folder import Folder

DIRECTIONS = np.vstack([np.eye(3), -np.eye(3)])
"""(6, 3) directions of pushes, world."""

LARGEST_SHIFT = 2e-3
"""m by which an object starts off its place, at most."""

SHIFT = 0.05
"""Of half the object's extent: by how much a small object does, which would not bear `LARGEST_SHIFT`."""

DRAWS = 2
"""Draws of what has a direction or signs."""


@dataclass(frozen=True)
class Perturbation:
    """One way in which the world differs from the plan.

    Attributes:
        mass: factor of the object's mass and inertia.
        friction: factor of every friction coefficient, sliding and torsional.
        torsion: factor of torsional friction, on top of that.
        joint_bias: (J,) rad by which the joints' sensors are off, where joints share motors, their springs' places of
            rest; None for none.
        push: (3,) N at the object's centre of mass, world.
        push_start, push_end: s after the motion starts.
        start_shift: (3,) m by which the object starts off its place, world.
        start_turn: (3,) rad, rotation vector by which it starts turned, world.
        stiffness: factor of the motors' stiffness; they stay as damped, relative to critical, and press as planned.
            Where joints share motors, of their springs; the motors turn as planned, so springs press by that factor.
        effort: factor of the motors' torque limits.
        squeeze: factor of what the commands are ahead of the planned angles, and so of the grip; 1 where joints share
            motors, which are ahead of nothing.
        link_mass: factor of the links' masses and inertias; the hand carries what they weigh as planned.
        delay: s by which the motors get their set points late; palm, and what the task itself exerts, keep their time.
    """

    mass: float = 1.0
    friction: float = 1.0
    torsion: float = 1.0
    joint_bias: tuple[float, ...] | None = None
    push: tuple[float, float, float] = (0.0, 0.0, 0.0)
    push_start: float = 0.0
    push_end: float = 0.0
    start_shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    start_turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stiffness: float = 1.0
    effort: float = 1.0
    squeeze: float = 1.0
    link_mass: float = 1.0
    delay: float = 0.0

    @property
    def displaced(self) -> bool:
        """Whether the object starts off its place."""
        return any(self.start_shift) or any(self.start_turn)

    @property
    def changes(self) -> dict[str, Any]:
        """What differs from the plan: attribute -> value."""
        planned = vars(Perturbation())
        return {name: value for name, value in vars(self).items() if value != planned[name]}


def suite(folder: Folder, seed: int, together: int) -> dict[str, Perturbation]:
    """Return the perturbations that a design is tried on, by name: one thing at a time, then everything at once.

    Args:
        folder: gives the object's size and weight, joints, and how long the motion takes.
        seed: fixes what is drawn: signs, directions, times.
        together: how many have everything at once.
    """
    found = {
        "stiffness halved": Perturbation(stiffness=0.5),
        "stiffness doubled": Perturbation(stiffness=2.0),
        "mass +20 %": Perturbation(mass=1.2),
        "mass -20 %": Perturbation(mass=0.8),
        "friction +20 %": Perturbation(friction=1.2),
        "friction -20 %": Perturbation(friction=0.8),
        "link mass +20 %": Perturbation(link_mass=1.2),
        "link mass -20 %": Perturbation(link_mass=0.8),
        "commands 10 ms late": Perturbation(delay=0.01),
    }
    if _twists(folder):
        found["torsional friction of 0"] = Perturbation(torsion=0.0)
        found |= {f"torsional friction times {factor:g}": Perturbation(torsion=factor) for factor in (0.5, 2.0, 4.0)}
    found |= dict(_pushed(folder, seed))
    found |= dict(_drawn(folder, seed))
    return found | {
        f"everything at once, number {number}": draw_perturbation(folder, seed, number) for number in range(together)
    }


def draw_perturbation(folder: Folder, seed: int, number: int) -> Perturbation:
    """Draw everything at once: the ``number``-th of a series that the seed fixes.

    Mass and friction within 20 %, every joint's sensor off by 0.5 degrees to either side, a push of half the weight for
    0.1 to 0.2 s in one of six directions, and a start off by `start_offset` and 2 degrees in a random direction.
    """
    random = np.random.default_rng([seed, number])
    last = float(folder.motion.time[-1])
    length = random.uniform(0.1, 0.2)
    start = random.uniform(0.0, max(last - length, 0.0))
    push = 0.5 * folder.weight * DIRECTIONS[number % len(DIRECTIONS)]
    bias = _bias(folder, random, 0.5)
    return Perturbation(
        mass=random.uniform(0.8, 1.2),
        friction=random.uniform(0.8, 1.2),
        joint_bias=bias,
        push=_triple(push),
        push_start=start,
        push_end=start + length,
        start_shift=_triple(start_offset(folder) * _direction(random)),
        start_turn=_triple(np.deg2rad(2.0) * _direction(random)),
    )


def start_offset(folder: Folder) -> float:
    """Return by how much the object starts off its place, m: as much as its size bears."""
    return min(LARGEST_SHIFT, SHIFT * folder.length)


def _twists(folder: Folder) -> bool:
    """Return whether anything resists the object's turning about a contact's normal."""
    bodies = [] if folder.scene is None else folder.scene.bodies.values()
    return any(geom.friction[1] > 0 for body in bodies for geom in body.geoms)


def _pushed(folder: Folder, seed: int) -> Iterator[tuple[str, Perturbation]]:
    """Yield pushes of half the weight for 0.15 s."""
    for k, direction in enumerate(DIRECTIONS):
        start = _random(seed, 1, k).uniform(0.0, max(float(folder.motion.time[-1]) - 0.15, 0.0))
        push = _triple(0.5 * folder.weight * direction)
        name = f"pushed along {'+-'[k // 3]}{'xyz'[k % 3]}"
        yield name, Perturbation(push=push, push_start=start, push_end=start + 0.15)


def _drawn(folder: Folder, seed: int) -> Iterator[tuple[str, Perturbation]]:
    """Yield joints that are off, and starts that are."""
    for k in range(DRAWS):
        for stream, degrees, words in ((2, 0.5, "0.5 degrees"), (3, 1.0, "1 degree")):
            bias = _bias(folder, _random(seed, stream, k), degrees)
            yield f"joints off by {words}, number {k}", Perturbation(joint_bias=bias)
        shift = _triple(start_offset(folder) * _direction(_random(seed, 4, k)))
        yield f"start shifted, number {k}", Perturbation(start_shift=shift)
        turn = _triple(np.deg2rad(2.0) * _direction(_random(seed, 5, k)))
        yield f"start turned by 2 degrees, number {k}", Perturbation(start_turn=turn)


def _random(seed: int, stream: int, number: int) -> np.random.Generator:
    """Return a generator of its own for each kind of draw; ``stream`` 0 would be that of `draw_perturbation`."""
    return np.random.default_rng([seed, number, stream])


def _bias(folder: Folder, random: np.random.Generator, degrees: float) -> tuple[float, ...]:
    """Return every joint's sensor off by as much to either side, (J,) rad."""
    signs = random.choice([-1.0, 1.0], size=len(folder.motion.joint_names))
    return tuple((np.deg2rad(degrees) * signs).tolist())


def _direction(random: np.random.Generator) -> np.ndarray:
    vector = random.normal(size=3)
    unit: np.ndarray = vector / np.linalg.norm(vector)
    return unit


def _triple(vector: np.ndarray) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
