"""Quaternions that may have their real part last, judged by all goals of a file together."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation as Turn

from casadi_hands.task.problem import Problem, Question

# A quaternion whose real part is less than the first, of its length, is a turn of more than 174°; with a last number of
# more than the second, the other order makes it one of less than 90°.
_HALF_TURN, _SMALL_TURN = 0.05, 0.7072
_LIKELIER = 60.0  # degrees of turning, in all, that the other order saves where it is asked about


def wrong_order(data: Any) -> Iterator[Problem | Question]:
    """Quaternions of goals that would turn the object by much less, goal by goal, were their real part the last number.

    Args:
        data: a task file's.

    Yields:
        A problem for each that is half a turn as written and a small one in the other order, where that order makes
        the motion a smaller one; a question where it is less certain.
    """
    goals = data.get("motion") if isinstance(data, dict) else None
    if not isinstance(goals, list):
        return
    written, read = zip(*map(_rotations, goals), strict=True) if goals else ((), ())
    found = {number: value for number, value in enumerate(map(_quaternion, goals)) if value is not None}
    if not found:
        return
    saved = _turning(written) - _turning(read)
    still = all(turn.magnitude() < 1e-6 for turn in read)
    for number, (w, x, y, z) in found.items():
        size = float(np.linalg.norm((w, x, y, z)))
        half = abs(w) <= _HALF_TURN * size and abs(z) >= _SMALL_TURN * size
        if (not half and saved < _LIKELIER) or abs(z) <= abs(w) or saved <= 0:
            continue
        as_read, as_written = (np.degrees(turns[number].magnitude()) for turns in (read, written))
        path = ("motion", number, "rotation", "quaternion")
        asked = (
            f"[w, x, y, z]; is the order of this one x, y, z, w, a turn by {as_read:.4g}°? Then write "
            f"[{z:g}, {w:g}, {x:g}, {y:g}]. If {as_written:.4g}° are meant: "
            f"{{axis: [{x:g}, {y:g}, {z:g}], degrees: {as_written:.4g}}}"
        )
        # In the other order a single quaternion that turns nothing would be for nothing.
        if half and not (still and len(found) < len(goals)):
            yield Problem(path, str([w, x, y, z]), asked)
        else:
            yield Question(path, f"{[w, x, y, z]} is taken as {asked}")


def _quaternion(goal: Any) -> tuple[float, ...] | None:
    """A goal's quaternion as a file gives it, if it is one."""
    rotation = goal.get("rotation") if isinstance(goal, dict) else None
    value = _numbers(rotation.get("quaternion"), 4) if isinstance(rotation, dict) else None
    return value if value is not None and any(value) else None


def _rotations(goal: Any) -> tuple[Turn, Turn]:
    """A goal's orientation as it is written, and with the other order of a quaternion."""
    value = _quaternion(goal)
    if value is not None:
        return Turn.from_quat(value, scalar_first=True), Turn.from_quat(value)
    rotation = goal.get("rotation") if isinstance(goal, dict) else None
    turn = Turn.identity()
    if isinstance(rotation, dict):
        axis, degrees = _numbers(rotation.get("axis"), 3), _numbers([rotation.get("degrees")], 1)
        if axis is not None and any(axis) and degrees is not None:
            turn = Turn.from_rotvec(np.radians(degrees[0]) * np.array(axis) / np.linalg.norm(axis))
    return turn, turn


def _numbers(value: Any, count: int) -> tuple[float, ...] | None:
    """A list of so many finite numbers; None of anything else."""
    if not isinstance(value, list) or len(value) != count:
        return None
    return tuple(value) if all(type(x) in (int, float) and math.isfinite(x) for x in value) else None


def _turning(turns: Sequence[Turn]) -> float:
    """Degrees that a motion turns in all, from upright through the orientations at its goals."""
    before = [Turn.identity(), *turns]
    return float(sum(np.degrees((b * a.inv()).magnitude()) for a, b in zip(before, turns, strict=False)))
