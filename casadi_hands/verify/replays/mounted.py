"""An object on its joint in the simulation: where a perturbation puts it, and the support that holds it there."""

from __future__ import annotations

from typing import Any

import numpy as np

from casadi_hands.verify.held import Held, course
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.replays.perturb import Perturbation


class Mounted:
    """The joint of an attached object in MuJoCo's model.

    Args:
        folder: the design.
        joint: its object's.
        model: MuJoCo's.
        body: index of the object.
    """

    def __init__(self, folder: Folder, joint: Held, model: Any, body: int) -> None:
        self._joint, self._scale = joint, float(folder.length)
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        # A thread's advance is the first of its two joints, its turn the last.
        self._positions = [int(model.jnt_qposadr[first + i]) for i in range(count)]
        self._speed = int(model.jnt_dofadr[first + count - 1])
        self._start = float(course(folder, joint).position[0])
        self._home = self._start

    def place(self, data: Any, perturbation: Perturbation) -> tuple[np.ndarray, np.ndarray]:
        """Put the object at its start, off it as far as the joint lets a perturbation put it.

        Returns:
            Its position (3,) and the inverse of its orientation (4,), [w, x, y, z], world.
        """
        joint = self._joint
        if joint.turns:
            off = float(joint.axis @ np.asarray(perturbation.start_turn))
        else:
            off = float(joint.axis @ np.asarray(perturbation.start_shift))
        self._home = self._start + off
        for address in self._positions[:-1]:
            data.qpos[address] = joint.advance * self._home
        data.qpos[self._positions[-1]] = self._home
        position, turn = joint.place(np.array([self._home]))
        return position[0], turn[0].inv().as_quat(scalar_first=True)

    def support(self, data: Any, mass: float, frequency: float) -> tuple[np.ndarray, np.ndarray]:
        """Return force and torque (3,), world, of a critically damped spring that holds the object at its start.

        Args:
            data: MuJoCo's.
            mass: factor of the joint's inertia.
            frequency: rad/s.
        """
        off = float(data.qpos[self._positions[-1]]) - self._home
        pull = -mass * self._joint.mass * (frequency**2 * off + 2 * frequency * float(data.qvel[self._speed]))
        if self._joint.turns:
            return np.zeros(3), pull * self._joint.axis
        return pull * self._joint.axis, np.zeros(3)


def turned_far(folder: Folder, joint: Held | None, degrees: np.ndarray) -> float:
    """Return how far (m) a turn off the plan takes an attached object's surface at most; 0 of a free object."""
    return 0.0 if joint is None else float(np.deg2rad(degrees).max()) * folder.length
