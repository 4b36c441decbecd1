"""What moves the hand in MuJoCo: a motor at every joint, or motors that share joints through springs."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from casadi_hands.errors import DesignError
from casadi_hands.verify.reading.drive import Drive
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.replays.perturb import Perturbation
from casadi_hands.verify.replays.plan import Plan


class Actuation(Protocol):
    """What moves the hand.

    Attributes:
        indices: (N,) of its actuators in the model.
        ramps: whether it can be told to press less, and so to squeeze by and by.
    """

    indices: np.ndarray
    ramps: bool

    def perturb(self, model: Any, perturbation: Perturbation) -> None:
        """Change the model as the perturbation says."""

    def set_points(self, plan: Plan, told: np.ndarray, perturbation: Perturbation) -> tuple[np.ndarray, np.ndarray]:
        """Return set points (T, N), rad, and by how much those are ahead of what presses nothing, at steps (T,)."""


class OwnMotors:
    """A position-controlled motor at every joint."""

    ramps = True

    def __init__(self, mujoco: Any, model: Any, folder: Folder, file: Path) -> None:
        """Look up the joints' actuators.

        Raises:
            DesignError: one is missing.
        """
        joints = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in folder.motion.joint_names]
        driven = model.actuator_trnid[:, 0].tolist()
        if any(joint not in driven for joint in joints):
            raise DesignError(f"{file}: it lacks an actuator of this hand")
        self.indices = np.array([driven.index(joint) for joint in joints], dtype=int)

    def perturb(self, model: Any, perturbation: Perturbation) -> None:
        """Change gains and torque limits."""
        model.actuator_gainprm[self.indices, 0] *= perturbation.stiffness
        model.actuator_biasprm[self.indices, 1] *= perturbation.stiffness
        model.actuator_biasprm[self.indices, 2] *= np.sqrt(perturbation.stiffness)
        model.actuator_forcerange[self.indices] *= perturbation.effort

    def set_points(self, plan: Plan, told: np.ndarray, perturbation: Perturbation) -> tuple[np.ndarray, np.ndarray]:
        """Commands as told: joints press as planned, whatever their stiffness, and are off as their sensors are."""
        ahead = plan.ahead(told, perturbation)
        return plan.angles[told] + bias(perturbation, plan.angles.shape[1]) + ahead, ahead


class SharedMotors:
    """Motors that share joints: they alone are told anything, and what the springs do follows."""

    ramps = False

    def __init__(self, mujoco: Any, model: Any, folder: Folder, drive: Drive, file: Path) -> None:
        """Look up motors and springs.

        Raises:
            DesignError: one is missing.
        """
        find, kinds = partial(mujoco.mj_name2id, model), mujoco.mjtObj
        self.indices = np.array([find(kinds.mjOBJ_ACTUATOR, name) for name in drive.names], dtype=int)
        self._springs = np.array([find(kinds.mjOBJ_TENDON, name) for name in folder.motion.joint_names], dtype=int)
        if -1 in self.indices or -1 in self._springs or model.nu != len(self.indices):
            raise DesignError(f"{file}: its motors and springs are not those of this hand")

    def perturb(self, model: Any, perturbation: Perturbation) -> None:
        """Change springs and torque limits; where joints are off, their springs rest there."""
        model.tendon_stiffness[self._springs] *= perturbation.stiffness
        model.tendon_damping[self._springs] *= np.sqrt(perturbation.stiffness)
        model.tendon_lengthspring[self._springs] += bias(perturbation, len(self._springs))[:, None]
        model.actuator_forcerange[self.indices] *= perturbation.effort

    def set_points(self, plan: Plan, told: np.ndarray, perturbation: Perturbation) -> tuple[np.ndarray, np.ndarray]:
        """Positions of the motors; no motor can press alone, so none is ahead of anything."""
        assert plan.motors is not None
        return plan.motors[told], np.zeros_like(plan.motors[told])


def bias(perturbation: Perturbation, joints: int) -> np.ndarray:
    """Return by how much joints are off (J,), rad."""
    return np.asarray(perturbation.joint_bias or np.zeros(joints))
