"""How stiff must the joints be for the planned grasp to hold itself?

Motors are springs. Where contacts roll, the object's twist and the joints' steps z = (v, ω, q') are bound by A z = 0,
A = [Gᵀ, -J], Z its null space. Along it the springs K pull back, and the contact forces f do what they do when points
roll and levers turn: the grasp holds itself where the symmetric part of

    Zᵀ_q K Z_q + Zᵀ_t K_t Z_t - d/ds (Zᵀ A(x(s))ᵀ f)

is positive definite (the grasp stiffness of Cutkosky and Kao, 1989, with its geometric part). K_t is the torsional
friction of soft fingertips: what is left of it, over the twist that uses it up. A at x(s) is measured, object and
joints moved along Z (`casadi_hands.verify.figures.grasp`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from casadi_hands.verify.figures.grasp import Grasp

STEP = 2e-3
"""rad, and of the object's half extent: by which the grasp is moved to see what its forces do."""
STILL = 1e-16
"""rad², of a way to go of size one: joints that move less stay."""
RANK = 1e-6
"""Of the largest singular value: below it a motion is free."""


@dataclass(frozen=True)
class Mode:
    """What the grasp needs at one sample.

    Attributes:
        stiffness: least stiffness of every joint with which it holds itself, N·m/rad; not above 0 where it needs none.
        tips: the same where every joint is as stiff as is good for one stiffness of the fingertips, N/m.
        twist: (6,) of the object in the motion that needs it: m and rad, palm frame.
        free: torque over angle (N·m/rad) with which the object moves on between fingers that stay; 0 where it cannot.
    """

    stiffness: float
    tips: float
    twist: np.ndarray
    free: float


class Stability(Grasp):
    """What the grasp of a folder needs to hold itself."""

    def modes(self) -> list[Mode]:
        """Return what the grasp needs at every sample, whether the object sticks to the ground or not.

        Small errors use up the friction of what the ground bears only in part, and lift the object off one of its ends.
        """
        modes = self._modes(sticks=True)
        if "ground" not in self.folder.motion.contact_link:
            return modes
        found = []
        for stuck, loose in zip(modes, self._modes(sticks=False), strict=True):
            worse = max(stuck, loose, key=lambda mode: mode.stiffness)
            found.append(replace(worse, free=stuck.free))
        return found

    def _modes(self, sticks: bool) -> list[Mode]:
        """Return what the grasp needs at every sample; ``sticks`` as for `rows`."""
        motion, length = self.folder.motion, self.folder.length
        count, joints = motion.joint_angles.shape
        scale = np.concatenate([np.full(3, length), np.ones(3 + joints)])
        still = Mode(0.0, 0.0, np.zeros(6), 0.0)
        spaces, rows = [], []
        for k in range(count):
            if not motion.contact_active[k].any():
                spaces.append(np.zeros((6 + joints, 0)))
                rows.append((np.zeros((0, 6 + joints)), np.zeros(0)))
                continue
            grasp, spins, stiff = self.rows(k, sticks)
            _, sizes, right = np.linalg.svd(grasp * scale / length)
            spaces.append(scale[:, None] * right[int(np.sum(sizes > RANK * sizes[0])) :].T)
            rows.append((spins, stiff))
        sample = np.repeat(np.arange(count), [space.shape[1] for space in spaces])
        if not len(sample):
            return [still] * count
        ways = STEP * np.hstack(spaces).T
        arms = self.position[sample] - self._centre(sample, self.position[sample])
        shifts = ways[:, :3] + np.cross(ways[:, 3:6], arms) if self.mount is not None else ways[:, :3]
        there, back = (
            self.exerted(self.placed(sample, sign * shifts, sign * ways[:, 3:6], sign * ways[:, 6:]))
            for sign in (1.0, -1.0)
        )
        change = (there - back) / (2 * STEP)
        found = []
        for k, (space, (spins, stiff)) in enumerate(zip(spaces, rows, strict=True)):
            if not space.shape[1]:
                found.append(still)
                continue
            destabilising = space.T @ change[sample == k].T
            twisted = spins @ space
            needed = 0.5 * (destabilising + destabilising.T) - twisted.T @ (stiff[:, None] * twisted)
            if self.mount is not None:
                needed -= self.mount.sprung(k, space[:6])
            found.append(self._mode(k, space, needed))
        return found

    def _mode(self, k: int, space: np.ndarray, needed: np.ndarray) -> Mode:
        """Return what springs must make up for (d, d) along a null space (6 + J, d) at a sample."""
        moved = space[6:]
        free, springy = _split(moved.T @ moved)
        alone = 0.0
        if free.shape[1]:
            turned = space[3:6] @ free
            sizes = turned.T @ turned + RANK * np.eye(free.shape[1])  # of what only shifts the object nothing is asked
            alone = float(eigh(free.T @ needed @ free, sizes, eigvals_only=True)[-1])
        stiffness, way = _least(moved, needed, springy)
        levers = self._levers(k)
        tips, _ = _least(np.sqrt(levers)[:, None] * moved, needed, springy)
        return Mode(stiffness, tips, (space @ way)[:6], alone)

    def _levers(self, k: int) -> np.ndarray:
        """Return the square (J,), m², of each joint's lever at its finger's contact; of others' that of the longest."""
        levers = np.zeros(self.planned.jacobian.shape[2])
        for c in np.flatnonzero(self.folder.motion.contact_active[k]):
            levers = np.maximum(levers, np.sum(self._moved(k, int(c)) ** 2, axis=0))
        return np.where(levers > 0.0, levers, max(float(levers.max(initial=0.0)), 1e-12))


def _split(springs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return bases (d, a) and (d, b) of what moves no spring of (d, d), and of the rest."""
    values, vectors = np.linalg.eigh(springs)
    free = values < max(1e-8 * float(values[-1]), STILL)
    return vectors[:, free], vectors[:, ~free]


def _least(moved: np.ndarray, needed: np.ndarray, springy: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the least k with which k ``moved``ᵀ ``moved`` outweighs what is ``needed`` (d, d), and the motion (d,).

    That which asks for most, of those in ``springy`` (d, b).
    """
    if not springy.shape[1]:
        return 0.0, np.zeros(len(needed))
    values, vectors = np.linalg.eigh(springy.T @ moved.T @ moved @ springy)
    unit = springy @ (vectors / np.sqrt(np.maximum(values, 1e-300)))
    asked, ways = np.linalg.eigh(unit.T @ needed @ unit)
    return float(asked[-1]), unit @ ways[:, -1]
