"""A motion of object and hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.motion.quaternion import quaternion
from casadi_hands.nlp import Solution
from casadi_hands.problem.coupling import Coupling

Array = NDArray[np.float64]


@dataclass(frozen=True)
class OnJoint:
    """How an attached object goes along its joint at the samples.

    Attributes:
        coordinate: (S,) rad, of a slider lengths.
        speed: (S,) of it, over s.
        friction: (S,) dry friction along it, m·g·length, of a slider m·g.
    """

    coordinate: Array
    speed: Array
    friction: Array


@dataclass(frozen=True)
class WholeHand:
    """A motion of object and hand at the samples; nondimensional, see ``Model``.

    Attributes:
        fingers: morphology, one for each contact in ``contacts``; their ``angles`` are at the keyframes.
        contacts: index of each finger's contact.
        angles: for each finger (S, n), rad.
        palm_position: (S, 3) world.
        palm_quaternion: (S, 4).
        position: (S, 3) of the object, world.
        vector: (S, 3) its rotation vector from the reference.
        point: (S, C, 3) contacts on the object, object frame.
        force: (S, C, 3) object frame.
        active: (S, C) bool.
        solution: of the solver.
        disturbed: (S, C, 3) forces that hold the object on the same path under the task's perturbations; None without.
        torsion: (S, C) moments on the object about its outward normals, over the radius of the torsional friction: m·g;
            None of hard points.
        coupling: how motors turn the joints; None where each joint has its own.
        on_joint: how an attached object goes along its joint; None of a free one, and before the refinement.
    """

    fingers: tuple[FingerSeed, ...]
    contacts: tuple[int, ...]
    angles: tuple[Array, ...]
    palm_position: Array
    palm_quaternion: Array
    position: Array
    vector: Array
    point: Array
    force: Array
    active: NDArray[np.bool_]
    solution: Solution
    disturbed: Array | None = None
    torsion: Array | None = None
    coupling: Coupling | None = None
    on_joint: OnJoint | None = None


def turned(start: Array, vector: Array) -> Array:
    """A quaternion turned further by a rotation vector in the world."""
    return quaternion(pin.exp3(vector) @ pin.Quaternion(*start).matrix())
