"""Quaternions that may have their real part last, judged by all goals of a file together."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
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
        if not half and saved < _LIKELIER or abs(z) <= abs(w) or saved <= 0:
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


def _quaternion(goal: Any) -> tuple[float, float, float, float] | None:
    """A goal's quaternion as a file gives it, if it is one."""
    rotation = goal.get("rotation") if isinstance(goal, dict) else None
    value = rotation.get("quaternion") if isinstance(rotation, dict) else None
    if not _numbers(value, 4) or not np.any(value):
        return None
    w, x, y, z = value
    return w, x, y, z


def _rotations(goal: Any) -> tuple[Turn, Turn]:
    """A goal's orientation as it is written, and with the other order of a quaternion."""
    value = _quaternion(goal)
    if value is not None:
        return Turn.from_quat(value, scalar_first=True), Turn.from_quat(value)
    rotation = goal.get("rotation") if isinstance(goal, dict) else None
    axis, degrees = (rotation.get(name) for name in ("axis", "degrees")) if isinstance(rotation, dict) else (None, None)
    turn = Turn.identity()
    if _numbers(axis, 3) and np.any(axis) and isinstance(degrees, int | float) and np.isfinite(degrees):
        turn = Turn.from_rotvec(np.radians(degrees) * np.array(axis, float) / np.linalg.norm(axis))
    return turn, turn


def _numbers(value: Any, count: int) -> bool:
    check: Callable[[Any], bool] = lambda x: type(x) in (int, float) and bool(np.isfinite(x))  # noqa: E731
    return isinstance(value, list) and len(value) == count and all(map(check, value))


def _turning(turns: Sequence[Turn]) -> float:
    """Degrees that a motion turns in all, from upright through the orientations at its goals."""
    before = [Turn.identity(), *turns]
    return float(sum(np.degrees((b * a.inv()).magnitude()) for a, b in zip(before, turns, strict=False)))
