"""How stiff fingertips must be so that a grasp does not turn over: contacts roll, and forces then point elsewhere.

Fingertips are balls that keep their attitude, held by springs of one stiffness, and roll on the object; forces stay as
they are, in the world. A small turn ω of the object moves a contact at p over it by s = −(S + 1/ρ)⁻¹ (ω × n), S the
surface's shape operator, n its outward normal, ρ the fingertip's radius. So forces f turn on the object with
Σ (ω × p + s) × f, and springs turn it back.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg import eigh

from casadi_hands.geometry.bodies import Body
from casadi_hands.placement.loads import Contacts
from casadi_hands.placement.surface import Spots

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def shape_operators(bodies: Sequence[Body], on: Spots, frames: Array, step: float) -> Array:
    """(N, 2, 2) how outward normals turn along the frames' directions across, by differences over a step."""
    found = np.zeros((len(on), 2, 2))
    for k, (point, body, frame) in enumerate(zip(on.points, on.bodies, frames, strict=True)):
        across = frame[1:]
        for i, way in enumerate(across):
            ends = [bodies[body].on_surface(point + sign * step * way) for sign in (1, -1)]
            turn = bodies[body].outward(ends[0]) - bodies[body].outward(ends[1])
            found[k, :, i] = across @ turn / max(float((ends[0] - ends[1]) @ way), 1e-12)
        found[k] = (found[k] + found[k].T) / 2
    return found


def needed_stiffness(
    points: Array, contacts: Contacts, chosen: Index, shapes: Array, radius: float, forces: Array
) -> float:
    """The least stiffness of fingertips, m·g/length, with which a set holds still under forces; 0 where any will do.

    Args:
        points: (N, 3) of all contacts.
        contacts: likewise.
        chosen: (K,) those that touch.
        shapes: (N, 2, 2) as ``shape_operators`` gives them.
        radius: of fingertips.
        forces: (K, 3) on the object, object frame.
    """
    turning = np.zeros((3, 3))
    for k, force in zip(chosen, forces, strict=True):
        across = contacts.frames[k, 1:]
        # Where the object is hollow a ball rolls as on a plane.
        bent, ways = np.linalg.eigh(shapes[k])
        rolled = across.T @ ways @ np.diag(1 / (np.maximum(bent, 0) + 1 / radius)) @ ways.T @ across
        moved = -pin.skew(points[k]) - rolled @ pin.skew(contacts.frames[k, 0])  # of the outward normal, which is less
        turning -= pin.skew(force) @ moved
    maps = contacts.maps[chosen][:, :3]
    springs = np.einsum("kia,kib->ab", maps, maps)
    # Against turns, the object going where the springs let it.
    against = springs[3:, 3:] - springs[3:, :3] @ np.linalg.solve(springs[:3, :3], springs[:3, 3:])
    against += 1e-6 * np.eye(3)
    return max(float(eigh((turning + turning.T) / 2, against, eigvals_only=True)[-1]), 0.0)
