"""Are the joints' velocities, torques and commands those of the motion, and of the motors in ``scene.xml``?"""

from __future__ import annotations

import numpy as np

from casadi_hands.verify.figures.wrench import planned_torques
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.trajectory import joint_velocities

EXACT = 1e-6
"""Share of the largest by which a stated value may differ."""


def command_problems(folder: Folder) -> list[str]:
    """Return where velocities, torques or commands are not what the rest of the files says, a sentence each."""
    motion = folder.motion
    velocities, torques = joint_velocities(folder), planned_torques(folder)
    problems = [
        *_unlike(folder, "joint_velocities", velocities, "rad/s", "the motion turns it"),
        *_unlike(folder, "joint_torques", torques, "N·m", "the contact forces need"),
    ]
    if folder.drive is not None and motion.motor_positions is not None:
        due = folder.drive.offsets + motion.motor_positions @ folder.drive.ratios.T
        return [*problems, *_unlike(folder, "joint_commands", due, "rad", "the motors of result.json turn it")]
    if folder.scene is None:
        return problems
    servos = {servo.joint: servo for servo in folder.scene.servos}
    if any(name not in servos for name in motion.joint_names):
        return problems
    stiffness = np.array([servos[name].stiffness for name in motion.joint_names])
    damping = np.array([servos[name].damping for name in motion.joint_names])
    commands = motion.joint_angles + (torques + damping * velocities) / stiffness
    return [*problems, *_unlike(folder, "joint_commands", commands, "rad", "the motors of scene.xml need")]


def _unlike(folder: Folder, name: str, due: np.ndarray, unit: str, words: str) -> list[str]:
    motion = folder.motion
    stated = getattr(motion, name)
    if stated is None:
        return [] if folder.legacy else [f"motion.npz: no array {name}"]
    off = np.abs(stated - due)
    if not off.max() > EXACT * max(float(np.abs(due).max()), EXACT):
        return []
    k, j = np.unravel_index(np.argmax(off), off.shape)
    at = f"of joint {motion.joint_names[j]} at {motion.time[k]:.3g} s"
    digits = next((n for n in range(4, 17) if f"{stated[k, j]:.{n}g}" != f"{due[k, j]:.{n}g}"), 17)
    return [f"{name}: {stated[k, j]:.{digits}g} {unit} {at}, where {words} {due[k, j]:.{digits}g} {unit}"]
