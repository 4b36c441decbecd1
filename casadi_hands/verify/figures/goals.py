"""Does the object pass through the task's goals?"""

from __future__ import annotations

from functools import reduce

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from casadi_hands.verify.figures.dynamics import Shots, end_speeds, object_rotation, still
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.report import Figure, worse


def goal_figures(folder: Folder) -> list[Figure]:
    """Return the largest distance (m) and, for pose goals, angle (deg) of the object from a goal."""
    motion, task, limits = folder.motion, folder.task, folder.task.limits
    slerp = Slerp(motion.time, object_rotation(folder))
    distances, angles = [], []
    for number, goal in enumerate(task.motion, start=1):
        time = float(np.clip(goal.at, motion.time[0], motion.time[-1]))
        rotation = slerp(time)
        position = np.array([np.interp(time, motion.time, motion.object_position[:, i]) for i in range(3)])
        what, target = "object", goal.position
        if task.tool is not None:
            what, target = "tool", goal.tool_at
            position = position + rotation.apply(np.asarray(task.tool))
        if abs(time - goal.at) > 1e-6:
            distances.append((np.inf, f"the motion does not reach the time of goal {number}, {goal.at:.3g} s"))
        else:
            distance = float(np.linalg.norm(position - np.asarray(target)))
            distances.append((distance, f"the {what} is {{value}} from goal {number} at {goal.at:.3g} s"))
        if task.tool is None:
            angle = float(np.rad2deg((Rotation.from_rotvec(goal.rotation.vector).inv() * rotation).magnitude()))
            angles.append((angle, f"the object is turned {{value}} from goal {number} at {goal.at:.3g} s"))
    figures = [Figure("goal_position", *_split(reduce(worse, distances), limits.goal_position, "m"))]
    if angles:
        figures.append(Figure("goal_angle", *_split(reduce(worse, angles), limits.goal_angle, "deg")))
    return figures


def rest_figure(folder: Folder, shots: Shots) -> Figure:
    """Return the larger speed of the object's fastest point at the motion's start and end, m/s: it rests at both."""
    speeds, words = end_speeds(folder, shots), ("starts", "ends")
    k = int(np.argmax(speeds))
    finding = f"the object {words[k]} with {{value}}; a motion starts and ends at rest"
    return Figure("rest", float(speeds[k]), still(folder), "m/s", finding)


def _split(worst: tuple[float, str], limit: float, unit: str) -> tuple[float, float, str, str]:
    return worst[0], limit, unit, worst[1]
