"""What the hand's controller knows of the plan: the motion at every step of a simulation."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation, Slerp

from casadi_hands.errors import DesignError
from casadi_hands.verify.figures.attached import object_shots
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.replays.perturb import Perturbation
from casadi_hands.verify.trajectory import build_trajectory, joint_velocities


class Plan:
    """The motion at every step of the simulation, ``T`` of them from the first sample to the last.

    What the hand is told is linear between samples, as anyone plays it who reads ``motion.npz``.

    Attributes:
        time: (T,) s.
        angles, commands: (T, J) rad, planned and told to the motors.
        damped: (T, J) rad, what of the commands answers the joints' own dampers.
        motors: (T, N) rad, positions of the motors that share joints; None where every joint has its own.
        palm_position, palm_quaternion: (T, 3) m and (T, 4) [w, x, y, z], world.
        external_force, external_torque: (T, 3) what the task itself applies to the object, N and N·m, world.
    """

    def __init__(self, folder: Folder, step: float) -> None:
        """Rebuild the motion ``step`` seconds apart.

        Raises:
            DesignError: the motion has no commands.
        """
        motion = folder.motion
        if motion.joint_commands is None:
            raise DesignError(
                f"{folder.path / 'motion.npz'}: no joint_commands, since an earlier version wrote it; "
                f"`casadi-hands solve {folder.path / 'task.yaml'} --from {folder.path}` makes it anew",
                "",
            )
        path = build_trajectory(folder, object_shots(folder))
        steps = np.arange(round((motion.time[-1] - motion.time[0]) / step) + 1)
        self.time = time = np.minimum(motion.time[0] + step * steps, motion.time[-1])

        def dense(values: np.ndarray) -> np.ndarray:
            return np.asarray(make_interp_spline(path.time, values, k=1)(time))

        def coarse(values: np.ndarray) -> np.ndarray:
            return np.asarray(make_interp_spline(motion.time, values, k=1)(time))

        self.angles, self.commands = coarse(motion.joint_angles), coarse(motion.joint_commands)
        # By this angle of its spring a joint's damper holds back; where motors are shared, no command answers that.
        servos = () if folder.scene is None else folder.scene.servos
        share = {servo.joint: servo.damping / servo.stiffness for servo in servos}
        self.damped = coarse(joint_velocities(folder) * [share.get(name, 0.0) for name in motion.joint_names])
        self.motors = None if motion.motor_positions is None else coarse(motion.motor_positions)
        self.external_force, self.external_torque = coarse(motion.external_force), coarse(motion.external_torque)
        self.palm_position, self._object_position = coarse(motion.base_position), dense(path.placed["object"][1])
        turns = coarse(continuous(motion.base_orientation))
        self.palm_quaternion = turns / np.linalg.norm(turns, axis=1, keepdims=True)
        item = Slerp(path.time, Rotation.from_matrix(path.placed["object"][0]))(time)
        self._object_quaternion = item.as_quat(scalar_first=True)

    def __len__(self) -> int:
        """Return the number of steps."""
        return len(self.angles)

    def ahead(self, told: np.ndarray | int, perturbation: Perturbation) -> np.ndarray:
        """Return by how much set points are ahead of the planned angles (…, J), rad, at steps.

        Motors of a stiffness and a damping of their own need other set points to press as planned: the torque's share
        goes with one over the stiffness, the damper's with one over its root.
        """
        softer = 1.0 / perturbation.stiffness
        pressing = softer * (self.commands[told] - self.angles[told])
        ahead: np.ndarray = perturbation.squeeze * (pressing + (softer**0.5 - softer) * self.damped[told])
        return ahead

    def distance(self, i: int, position: np.ndarray) -> float:
        """Return how far (m) a position (3,), world, is from the object's plan at a step."""
        away = position - self._object_position[i]
        return float(np.sqrt(away @ away))

    def errors(self, positions: np.ndarray, quaternions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return distance (m) and angle (deg) of the object's poses, (T, 3) and (T, 4), from its plan.

        Args:
            positions: m, world.
            quaternions: [w, x, y, z], world.
        """
        away = np.linalg.norm(positions - self._object_position, axis=1)
        cosine = np.minimum(np.abs(np.sum(quaternions * self._object_quaternion, axis=1)), 1.0)
        return away, np.rad2deg(2 * np.arccos(cosine))


def continuous(quaternions: np.ndarray) -> np.ndarray:
    """Return the same orientations (S, 4) with signs such that neighbours lie close to each other."""
    flips = np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0
    signs = np.cumprod(np.concatenate([[1.0], np.where(flips, -1.0, 1.0)]))
    signed: np.ndarray = quaternions * signs[:, None]
    return signed
