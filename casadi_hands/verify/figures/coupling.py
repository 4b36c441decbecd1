"""Do the motors that share joints turn them as the plan needs, and what is asked of a motor?"""

from __future__ import annotations

import numpy as np

from casadi_hands.verify.figures.wrench import planned_torques
from casadi_hands.verify.reading.drive import Drive
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.report import Figure, of_actuator


def coupling_figures(folder: Folder) -> list[Figure]:
    """Return the number of motors, where the task asks for one, and how far commands are off what motors turn."""
    asked, drive = folder.task.motors, folder.drive
    motors = len(folder.motion.joint_names) if drive is None else drive.ratios.shape[1]
    figures = []
    if isinstance(asked, int):
        words = f"the hand has {{value}} motors, the task asks for {asked} (motors)"
        figures.append(Figure("motors", float(motors), float(asked), "", words))
    return figures if drive is None else [*figures, _off_lines(folder, drive)]


def _off_lines(folder: Folder, drive: Drive) -> Figure:
    """Return the largest distance of q + τ / k, with which joints press as planned, from what motors turn them to."""
    motion = folder.motion
    needed = motion.joint_angles + planned_torques(folder) / folder.task.actuator.stiffness
    assert motion.motor_positions is not None
    off = np.abs(needed - drive.offsets - motion.motor_positions @ drive.ratios.T)
    k, j = np.unravel_index(np.argmax(off), off.shape)
    words = f"joint {motion.joint_names[j]} is {{value}} off what its motors turn it to at {motion.time[k]:.3g} s"
    return Figure("coupling", float(off[k, j]), folder.task.limits.coupling, "rad", words)


def motor_speeds(folder: Folder) -> np.ndarray:
    """Return the speeds (S - 1, N) of the motors that share joints, which go straight from sample to sample, rad/s."""
    assert folder.motion.motor_positions is not None
    return np.asarray(np.diff(folder.motion.motor_positions, axis=0) / np.diff(folder.motion.time)[:, None])


def motor_speed_figure(folder: Folder, drive: Drive) -> Figure:
    """Return the largest speed of a motor."""
    speeds = np.abs(motor_speeds(folder))
    k, m = np.unravel_index(np.argmax(speeds), speeds.shape)
    value, where = float(speeds[k, m]), f"{drive.names[m]} at {folder.motion.time[k]:.3g} s"
    return of_actuator("speed", value, where, folder.task.actuator.speed, folder.task.limits.speed, "rad/s")
