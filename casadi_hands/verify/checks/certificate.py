"""Is the certificate in ``result.json`` the one that the files earn?"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from casadi_hands.verify.reading.stored import as_array, brief, entry, read_record
from casadi_hands.verify.replays.series import Replays
from casadi_hands.verify.report import Figure, show

CLOSE = 0.01
"""Share of a figure, or of its limit, by which machines may differ."""
PLAYED = 0.1
"""Likewise of what replays show, in which small differences grow."""


def certificate_problems(
    directory: str | Path, figures: Mapping[str, Figure], limits: bool = True, close: float = CLOSE
) -> list[str]:
    """Return where the stated certificate is not the recomputed one, a sentence each.

    Args:
        directory: the result folder.
        figures: as recomputed; those that are not stated are passed over, as earlier versions had fewer.
        limits: whether the limits are those of the folder's own task.
        close: share of a figure, or of its limit, by which they may differ.
    """
    stated = read_record(Path(directory) / "result.json").get("certificate")
    if stated is None:
        return []
    if not isinstance(stated, dict):
        return ["certificate: that of result.json is no object of figures"]
    problems = []
    for name, figure in figures.items():
        if name not in stated or not math.isfinite(figure.value):
            continue
        value, limit = as_array(entry(stated, name, "value"), ()), as_array(entry(stated, name, "limit"), ())
        near = close * max(abs(figure.value), figure.limit or 0.0) + 1e-6
        if value is None:
            problems.append(f"certificate: result.json states no number for {name}")
        elif abs(float(value) - figure.value) > near:
            said, found = show(float(value), figure.unit), show(figure.value, figure.unit)
            problems.append(f"certificate: result.json says {name} is {said}, the files give {found}")
        if limits and entry(stated, name, "holds") not in (None, figure.holds):
            problems.append(f"certificate: result.json says {name} {'holds' if not figure.holds else 'is missed'}")
        if limits and not _agree(limit, figure.limit):
            problems.append(f"certificate: the limit of {name} in result.json is not the task's")
        if entry(stated, name, "unit") not in (None, figure.unit):
            problems.append(f"certificate: result.json has {name} in other units than the task")
    return problems


def replay_problems(directory: str | Path, played: Replays) -> list[str]:
    """Return where the replays that ``result.json`` states are not those that were played, a sentence each.

    Args:
        directory: the result folder.
        played: by the folder's own task.
    """
    stated = read_record(Path(directory) / "result.json").get("replays")
    entries = [each for each in stated if entry(each, "engine") == played.engine] if isinstance(stated, list) else []
    if not entries:
        return []
    first, due, problems = entries[0], played.record(), []
    if len(entries) > 1:
        problems.append(f"replays: result.json has {len(entries)} of {played.engine}")
    if entry(first, "dropped_as_planned") is not due["dropped_as_planned"]:
        how = "drops" if due["dropped_as_planned"] else "holds"
        problems.append(f"replays: result.json says otherwise, but the hand {how} the object as planned")
    if entry(first, "of") == due["of"]:
        dropped = as_array(entry(first, "dropped"), ())
        if dropped is None or abs(float(dropped) - due["dropped"]) > PLAYED * due["of"]:
            few = brief(entry(first, "dropped"))
            problems.append(f"replays: result.json says {few} of {due['of']} drop the object, {due['dropped']} do")
    limits = played.task.limits
    most = {"mm": 1e3 * limits.replay_position, "degrees": limits.replay_angle}
    for number, goal in enumerate(due["goals"]):
        for unit, value in goal.items():
            said = as_array(entry(first, "goals", number, unit), ())
            if value is not None and (said is None or abs(float(said) - value) > PLAYED * max(value, most[unit])):
                off = "nothing" if said is None else f"{float(said):.3g} {unit}"
                problems.append(f"replays: result.json says {off} off goal {number + 1}, it is {value:.3g} {unit}")
    return problems


def _agree(stated: np.ndarray | None, due: float | None) -> bool:
    if stated is None or due is None:
        return stated is None and due is None
    return abs(float(stated) - due) <= 1e-9 * due
