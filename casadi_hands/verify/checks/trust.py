"""The task by which a folder is judged: what the folder's own says otherwise, and which limits it widened."""

from __future__ import annotations

from typing import Any

from casadi_hands.task import Task
from casadi_hands.task.shown import escaped
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.report import UNIT_OF, show

_INTENT = ("about", "name", "search", "weights", "limits", "time_step", "keyframes_between")
"""Sections that say how to look for a design, or what to ask of it, and not what it is."""
_READ = ("task.yaml", "hand.urdf", "object.urdf", "scene.xml", "motion.npz", "motion.csv", "result.json", "meshes")
"""What the audit reads of a folder."""
_NAMED = 5
"""Differences, and files, that are named one by one."""


def task_problems(folder: Folder) -> list[str]:
    """Return what ``task.yaml`` and ``result.json``, or the file that the user trusts, say differently."""
    problems = []
    stated = folder.result.get("task_hash")
    if not folder.legacy and stated != folder.task_hash:
        problems.append("task_hash: task.yaml is not the task that was solved; result.json has the hash of another")
    if folder.trusted is not None:
        found = list(_differences(_facts(folder.written), _facts(folder.task), ""))
        if found:
            more = f" and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
            problems.append(f"task.yaml is not {folder.trusted}: {'; '.join(found[:_NAMED])}{more}")
    return problems


def limit_notes(folder: Folder) -> tuple[str, ...]:
    """Return where limits of the folder's own task are looser than the defaults, and other than the trusted file's."""
    rest = folder.written.model_dump(by_alias=True, exclude_none=True, exclude={"limits"})
    limits = folder.written.limits, Task.model_validate(rest).limits, folder.task.limits
    written, default, judged = (each.model_dump() for each in limits)
    notes = []
    for name, value in written.items():
        at_least = name == "disturbance_radius"
        looser = value < default[name] if at_least else value > default[name]
        shown = f"limits.{name}: {_shown(name, value)} in the folder's task"
        if looser:
            notes.append(f"{shown}, {_shown(name, default[name])} by default (looser)")
        if folder.trusted is not None and value != judged[name]:
            notes.append(f"{shown}, {_shown(name, judged[name])} in {folder.trusted}, which is what counts")
    return tuple(notes)


def unread_notes(folder: Folder) -> tuple[str, ...]:
    """Return which files of the folder no audit reads: pages and logs, whoever wrote them."""
    names = sorted(each.name for each in folder.path.iterdir() if each.name not in _READ)
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    shown = ", ".join(escaped(name, 60) for name in names[:_NAMED])
    return (f"not looked at: {shown}{more}",) if names else ()


def _shown(name: str, value: float) -> str:
    return show(value, UNIT_OF.get(name, ""))


def _facts(task: Task) -> dict[str, Any]:
    facts = task.model_dump(mode="json", by_alias=True, exclude=set(_INTENT))
    return {**facts, "search": {"max_joints": task.search.max_joints}}


def _differences(one: Any, other: Any, name: str) -> list[str]:
    """Return where two plain values differ, as ``friction (0.9, there 0.5)``."""
    if isinstance(one, dict) and isinstance(other, dict):
        dotted = {key: f"{name}.{key}" if name else key for key in [*one, *(key for key in other if key not in one)]}
        return [d for key, full in dotted.items() for d in _differences(one.get(key), other.get(key), full)]
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        if not all(isinstance(part, int | float) for part in [*one, *other]):
            return [
                d for i, pair in enumerate(zip(one, other, strict=True)) for d in _differences(*pair, f"{name}[{i}]")
            ]
        if all(_near(a, b) for a, b in zip(one, other, strict=True)):
            return []
    elif _near(one, other):
        return []
    return [f"{name} ({_plain(one)}, there {_plain(other)})"]


def _near(one: Any, other: Any) -> bool:
    if isinstance(one, float | int) and isinstance(other, float | int):
        return abs(one - other) <= 1e-12 + 1e-9 * max(abs(one), abs(other))
    return bool(one == other)


def _plain(value: Any) -> str:
    text = "none" if value is None else str(value)
    return text if len(text) <= 60 else f"{text[:57]}…"
