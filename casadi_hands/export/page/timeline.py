"""Where everything stands at each time that is drawn, in the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from casadi_hands.export.record import rotation_quaternion

if TYPE_CHECKING:
    from casadi_hands.export.page.robot import Robot
    from casadi_hands.problem.result import Result
    from casadi_hands.task import Task


@dataclass(frozen=True)
class Timeline:
    """Poses over time; a design without a motion has one time.

    Attributes:
        time: (S,) s.
        palm, object: (S, 4, 4) world <- body.
        links: link -> (S, 4, 4) palm <- link, for every link of the hand.
    """

    time: np.ndarray
    palm: np.ndarray
    object: np.ndarray
    links: dict[str, np.ndarray]


def design_timeline(design: Result, hand: Robot) -> Timeline:
    """Poses of a design along its motion, or as the task starts if there is none.

    Args:
        design: whole or partial.
        hand: its exported hand.
    """
    motion = design.motion
    if motion is None:
        start = np.eye(4)
        start[:3, :3], start[:3, 3] = design.task.palm.rotation, design.task.palm.position
        links = {name: value[None] for name, value in hand.link_poses({}).items()}
        return Timeline(np.zeros(1), start[None], goal_poses(design.task)[:1], links)
    frames = [hand.link_poses(dict(zip(motion.joint_names, row, strict=True))) for row in motion.joint_angles]
    return Timeline(
        time=motion.time,
        palm=poses(motion.base_position, motion.base_orientation),
        object=poses(motion.object_position, motion.object_orientation),
        links={name: np.array([frame[name] for frame in frames]) for name in frames[0]},
    )


def goal_poses(task: Task) -> np.ndarray:
    """Poses (G, 4, 4) of the object at the task's goals; where a goal is a point of the tool, upright with it there."""
    goals = task.goal_poses()
    return poses(
        np.array([position for _, position, _ in goals]), np.array([rotation_quaternion(turn) for *_, turn in goals])
    )


def poses(positions: np.ndarray, orientations: np.ndarray) -> np.ndarray:
    """Homogeneous poses (S, 4, 4) of positions (S, 3) and quaternions (S, 4), [w, x, y, z]."""
    result = np.tile(np.eye(4), (len(positions), 1, 1))
    result[:, :3, :3] = [pin.Quaternion(*orientation).matrix() for orientation in orientations]
    result[:, :3, 3] = positions
    return result
