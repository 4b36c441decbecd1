"""Fingers that the task has let go and touch again: when they may, and what holds the object meanwhile."""

from __future__ import annotations

from collections.abc import Iterator

from casadi_hands.task.finger import Regrasp
from casadi_hands.task.problem import Problem
from casadi_hands.task.task import Task

_EXACT = 1e-9  # of a time


def regrasp_problems(task: Task) -> Iterator[Problem]:
    """What is wrong with the regrasps of a task whose goals are in order; one problem of each."""
    planned = [(name, n, each) for name, finger in task.fingers.items() for n, each in enumerate(finger.regrasps or ())]
    for name, number, each in planned:
        path = "fingers", name, "regrasps", number
        if not task.fingers[name].is_placed:
            allowed = "regrasps of a finger that touches a point; the program places only where fingers touch at first"
            yield Problem((*path, "touches"), f"after {task.fingers[name].touches}", allowed)
            continue
        others = [(who, other) for who, _, other in planned if other is not each]
        problem = _order(task, name, number, each) or _close(task, each, others) or _unheld(task, name, each, others)
        if problem is not None:
            field, given, allowed = problem
            yield Problem((*path, field), given, allowed)


def _order(task: Task, name: str, number: int, each: Regrasp) -> tuple[str, str, str] | None:
    """Where a finger lifts too soon, flies too short, or has no time left to hold: field, given, allowed."""
    shortest = (task.keyframes_between + 1) * task.time_step
    before = (task.fingers[name].regrasps or ())[number - 1].end if number else 0.0
    why = "(keyframes_between + 1) × time_step"
    if each.start - before < shortest * (1 - _EXACT):
        return "from", f"{each.start:g}", f"at least {before + shortest:g}: {why} after it touched at {before:g} s"
    if each.end - each.start < shortest * (1 - _EXACT):
        return "to", f"{each.end:g}", f"at least {each.start + shortest:g}: {why} after it lifts"
    if each.end > task.duration - shortest * (1 - _EXACT):
        return "to", f"{each.end:g}", f"at most {task.duration - shortest:g}: {why} before the motion ends"
    return None


def _close(task: Task, each: Regrasp, others: list[tuple[str, Regrasp]]) -> tuple[str, str, str] | None:
    """Where a time is nearly, and not quite, that of something else, between which there is no room for samples."""
    moments = [*(goal.at for goal in task.motion), *(time for _, other in others for time in other.times)]
    for field, time in zip(("from", "to"), each.times, strict=True):
        for moment in moments:
            if _EXACT < abs(time - moment) < task.time_step * (1 - _EXACT):
                allowed = f"{moment:g}, when something else happens, or a time step ({task.time_step:g} s) off it"
                return field, f"{time:g}", allowed
    return None


def _unheld(task: Task, name: str, each: Regrasp, others: list[tuple[str, Regrasp]]) -> tuple[str, str, str] | None:
    """Where too few contacts are left to hold the object."""
    contacts = len(task.fingers) + (task.ground is not None)
    away = {who: None for who, other in others if who != name and other.start < each.end and each.start < other.end}
    if contacts - 1 - len(away) >= min(2, contacts - 1):
        return None
    return "from", f"{each.start:g}", f"a time at which two contacts hold the object; {' and '.join(away)} let go, too"
