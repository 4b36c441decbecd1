"""Long stretches in which nothing happens: left out where a motion is looked for, and filled in where it is written.

An object that shall stay where it is for a minute is solved for as one that shall stay for some seconds. At a keyframe
in between everything rests exactly; there the motion is held for the rest of the minute.
"""

from __future__ import annotations

from dataclasses import fields, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from casadi_hands.motion import Schedule
from casadi_hands.problem.motion import Motion
from casadi_hands.task import Task

LONG = 5.0  # s, of a stretch that is shortened
KEPT = 3.0  # s of it that are solved for: what goes on before and after comes to rest in them

Holds = tuple[tuple[int, float], ...]


def shortened_task(task: Task) -> tuple[Task, Holds]:
    """The task without what is left out of long still stretches, and where that is held.

    A stretch is still where the object stays at one pose, the palm stands, no finger is to regrasp, and nothing pushes
    the object.

    Args:
        task: as loaded.

    Returns:
        The task with earlier times, and for each stretch the index of its keyframe and how long that is held, s. Its
        goals and what they ask for stay the same.
    """
    moves = task.palm.may_move or task.palm.motion or any(finger.regrasps for finger in task.fingers.values())
    if task.draws or task.object.attached is not None or moves:
        return task, ()
    turns, left_out, holds = task.goal_turns(), 0.0, []
    times = [task.motion[0].at]
    for i, (before, goal) in enumerate(pairwise(task.motion)):
        length = goal.at - before.at
        same = before.position == goal.position and np.array_equal(turns[i], turns[i + 1])
        pushed = any(each.start < goal.at and each.end > before.at for each in task.perturbations)
        exerting = any(each.exert is not None for each in task.motion[i : i + 3])
        if same and length > LONG and not pushed and not exerting:
            holds.append((i * (task.keyframes_between + 1) + 1, length - KEPT))
            left_out += length - KEPT
        times.append(goal.at - left_out)
    if not holds:
        return task, ()

    def earlier(time: float) -> float:
        passed = [i for i, goal in enumerate(task.motion) if goal.at <= time + 1e-9]
        return time - (task.motion[passed[-1]].at - times[passed[-1]])

    motion = tuple(goal.model_copy(update={"at": time}) for goal, time in zip(task.motion, times, strict=True))
    pushes = tuple(
        each.model_copy(update={"start": earlier(each.start), "end": earlier(each.end)}) for each in task.perturbations
    )
    update: dict[str, Any] = {"motion": motion, "perturbations": pushes, "duration": earlier(task.duration)}
    return task.model_copy(update=update), tuple(holds)


def with_holds(schedule: Schedule, motion: Motion) -> Motion:
    """A motion at a schedule's samples as it is written: at real times, and constant where it is held."""
    if not schedule.holds:
        return motion
    times, index = schedule.filled()
    arrays: dict[str, Any] = {
        field.name: value[index]
        for field in fields(motion)
        if field.name != "time" and isinstance(value := getattr(motion, field.name), np.ndarray)
    }
    return replace(motion, time=times, **arrays)


def without_holds(schedule: Schedule, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """What an audit found in each interval between written samples (..., R - 1), of those between samples (..., S - 1).

    What is found in the intervals of a hold is that of the intervals beside it.

    Args:
        schedule: with its holds.
        values: not negative.
    """
    index = schedule.filled()[1]
    found = np.zeros((*values.shape[:-1], len(schedule.samples) - 1))
    for r, (a, b) in enumerate(pairwise(index.tolist())):
        for k in [a] if a != b else [max(a - 1, 0), min(a, found.shape[-1] - 1)]:
            found[..., k] = np.maximum(found[..., k], values[..., r])
    return found
