"""Is the certificate in ``result.json`` the one that the files earn?"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from casadi_hands.verify.reading.stored import as_array, entry, read_record
from casadi_hands.verify.report import Figure, show

CLOSE = 0.01
"""Share of a figure, or of its limit, by which machines may differ."""


def certificate_problems(directory: str | Path, figures: Mapping[str, Figure], limits: bool = True) -> list[str]:
    """Return where the stated certificate is not the recomputed one, a sentence each.

    Args:
        directory: the result folder.
        figures: as recomputed; those that are not stated are passed over, and so are those stated without a number.
        limits: whether the limits are those of the folder's own task.
    """
    stated = read_record(Path(directory) / "result.json").get("certificate")
    if stated is None:
        return []
    if not isinstance(stated, dict):
        return ["certificate: that of result.json is no object of figures"]
    problems = []
    for name, figure in figures.items():
        value, limit = as_array(entry(stated, name, "value"), ()), as_array(entry(stated, name, "limit"), ())
        if value is None or not math.isfinite(figure.value):
            continue
        near = CLOSE * max(abs(figure.value), figure.limit or 0.0) + 1e-6
        if abs(float(value) - figure.value) > near:
            said, found = show(float(value), figure.unit), show(figure.value, figure.unit)
            problems.append(f"certificate: result.json says {name} is {said}, the files give {found}")
        if limits and entry(stated, name, "holds") not in (None, figure.holds):
            problems.append(f"certificate: result.json says {name} {'holds' if not figure.holds else 'is missed'}")
        if limits and not _agree(limit, figure.limit):
            problems.append(f"certificate: the limit of {name} in result.json is not the task's")
    return problems


def _agree(stated: np.ndarray | None, due: float | None) -> bool:
    if stated is None or due is None:
        return stated is None and due is None
    return abs(float(stated) - due) <= 1e-9 * due
