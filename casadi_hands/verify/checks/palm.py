"""Does the palm stand where the task says, and does it move as the task allows?"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.verify.reading.folder import Folder

AT_ONCE = 0.1
"""Share of its largest speed with which a palm may seem to start: what three samples tell of a smooth start is off."""


def palm_problems(folder: Folder) -> list[str]:
    """Return where the palm is not as the task has it, a sentence each."""
    return [*_place_problems(folder), *_rest_problems(folder)]


def _place_problems(folder: Folder) -> list[str]:
    """A palm that may not move stands where the task says, or rests at the waypoints that the task gives it."""
    palm, motion = folder.task.palm, folder.motion
    if palm.may_move:
        return []
    times, places, turns = zip(*palm.waypoints, strict=True)
    turned = Rotation.from_quat(motion.base_orientation, scalar_first=True)
    problems = []
    held = np.ones(len(motion.time), dtype=bool) if len(times) == 1 else motion.time <= 1e-9
    moved = _away(folder, motion.base_position, turned, places[0], turns[0]) * held
    if moved.max() > 1e-6:
        k = int(np.argmax(moved))
        problems.append(f"base_position: the palm is not where the task puts it at {motion.time[k]:.3g} s")
    for time, place, turn in zip(times[1:], places[1:], turns[1:], strict=True):
        k = int(np.argmin(np.abs(motion.time - time)))
        after = motion.time >= time - 1e-9 if time == times[-1] else np.zeros(len(motion.time), dtype=bool)
        after[k] |= abs(motion.time[k] - time) < 1e-9
        if after.any():
            off = float((_away(folder, motion.base_position, turned, place, turn) * after).max())
        else:
            at = np.array([np.interp(time, motion.time, motion.base_position[:, i]) for i in range(3)])
            off = float(np.linalg.norm(at - place))
        if off > 1e-4:
            problems.append(f"base_position: the palm is {1e3 * off:.3g} mm from its waypoint at {time:.3g} s")
    return problems


def _away(folder: Folder, position: np.ndarray, turned: Rotation, place: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Return how far (S,) the palm is from a pose, m; an angle counts as the way of a point half the object away."""
    angle = (Rotation.from_matrix(turn).inv() * turned).magnitude()
    distance: np.ndarray = np.linalg.norm(position - place, axis=1) + folder.length * angle
    return distance


def _rest_problems(folder: Folder) -> list[str]:
    """The palm starts and ends still.

    Speeds at the ends are read off the first and the last three samples: a parabola through them.
    """
    motion = folder.motion
    turned = Rotation.from_quat(motion.base_orientation, scalar_first=True)
    turns = (turned[:-1].inv() * turned[1:]).as_rotvec()
    moves = np.hstack([np.diff(motion.base_position, axis=0), folder.length * turns])
    steps = np.diff(motion.time)
    speeds = moves / steps[:, None]
    fastest, problems = float(np.linalg.norm(speeds, axis=1).max()), []
    for first, second, words in ((0, 1, "start"), (-1, -2, "end")):
        one, two = steps[first], steps[second]
        # The parabola's slope at its end; a smooth start makes it small, or points it backwards.
        speed = speeds[first] + (speeds[first] - speeds[second]) * one / (one + two)
        along = float(speed @ speeds[first]) / max(float(np.linalg.norm(speeds[first])), 1e-300)
        if along > AT_ONCE * fastest and along > 1e-3 * folder.speed_unit:
            problems.append(f"base_position: the palm does not {words} at rest, but at {1e3 * along:.3g} mm/s")
    return problems
