"""A motion of hand and object in SI, as it is written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class Motion:
    """The arrays of ``motion.npz``: same names, shapes, units and frames (see ``docs/result-folder.md``).

    Moments of contacts are None of hard fingertips. Commands are None until there is a hand, and in files of versions
    that did not write them; positions of motors are None where every joint has its own; what is disturbed is None where
    the task names no disturbance; what is of the attachment is None of an object that is free.
    """

    time: np.ndarray
    object_position: np.ndarray
    object_orientation: np.ndarray
    base_position: np.ndarray
    base_orientation: np.ndarray
    joint_angles: np.ndarray
    joint_names: tuple[str, ...]
    contact_names: tuple[str, ...]
    contact_link: tuple[str, ...]
    contact_active: np.ndarray
    contact_force: np.ndarray
    contact_point_object: np.ndarray
    contact_point_link: np.ndarray
    external_force: np.ndarray
    external_torque: np.ndarray
    joint_velocities: np.ndarray | None = None
    joint_torques: np.ndarray | None = None
    joint_commands: np.ndarray | None = None
    motor_positions: np.ndarray | None = None
    contact_moment: np.ndarray | None = None
    contact_force_disturbed: np.ndarray | None = None
    external_force_disturbed: np.ndarray | None = None
    external_torque_disturbed: np.ndarray | None = None
    attachment_position: np.ndarray | None = None
    attachment_velocity: np.ndarray | None = None
    attachment_friction: np.ndarray | None = None
