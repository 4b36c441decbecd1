"""Is ``motion.csv`` the motion of ``motion.npz``, number by number?"""

from __future__ import annotations

import csv
import io
import os

import numpy as np

from casadi_hands.errors import DesignError
from casadi_hands.problem.stored import read_text
from casadi_hands.verify.reading.folder import Folder

_UNITS = {
    **dict.fromkeys(("object_position", "base_position", "contact_point_object", "contact_point_link"), "m"),
    **dict.fromkeys(("contact_force", "contact_force_disturbed", "external_force", "external_force_disturbed"), "N"),
    "contact_moment": "N m",
    **dict.fromkeys(("joint_torques", "external_torque", "external_torque_disturbed"), "N m"),
    **dict.fromkeys(("joint_angles", "joint_commands", "motor_positions"), "rad"),
    **{"time": "s", "joint_velocities": "rad/s"},
    **dict.fromkeys(("object_orientation", "base_orientation", "contact_active"), ""),
    **dict.fromkeys(("attachment_position", "attachment_velocity", "attachment_friction"), ""),
}


def table_problems(folder: Folder) -> list[str]:
    """Return where the table, if there is one, is not the motion, a sentence each.

    Raises:
        DesignError: it is no table of numbers.
    """
    path = folder.path / "motion.csv"
    if not os.path.lexists(path):
        return []
    text = read_text(path)
    if not text.strip():
        raise DesignError(f"{path}: not a table of numbers: empty")
    try:
        names, *rows = csv.reader(io.StringIO(text, newline=""))
        values = np.array([[float(word) for word in row] for row in rows])
    except (ValueError, csv.Error):
        raise DesignError(f"{path}: not a table of numbers") from None
    due = _columns(folder)
    if values.shape != (len(folder.motion.time), len(names)) or not np.all(np.isfinite(values)):
        return ["motion.csv: has not a row of finite numbers for each sample of motion.npz"]
    problems = [f"motion.csv: column '{name}' is not of motion.npz" for name in names if name not in due]
    problems += [f"motion.csv: has {names.count(name)} columns '{name}'" for name in due if names.count(name) != 1]
    for name, column in zip(names, values.T, strict=True):
        off = np.abs(column - due.get(name, column))
        if off.max() > 1e-9 * max(1.0, float(np.abs(column).max())):
            at = folder.motion.time[int(np.argmax(off))]
            problems.append(f"motion.csv: '{name}' at {at:.3g} s is not that of motion.npz")
    return problems


def _columns(folder: Folder) -> dict[str, np.ndarray]:
    """Return name -> values (S,) of every column that the motion gives."""
    motion, columns = folder.motion, {}
    for name, unit in _UNITS.items():
        array = getattr(motion, name)
        if array is None:
            continue
        if name.startswith("joint_"):
            parts = list(zip(motion.joint_names, array.T, strict=True))
        elif name == "motor_positions":
            parts = [(f"motor{m}", column) for m, column in enumerate(array.T)]
        elif name.startswith("contact_"):
            parts = list(zip(motion.contact_names, np.moveaxis(array, 1, 0), strict=True))
        else:
            parts = [("", array)]
        suffix = f" [{unit}]" if unit else ""
        for part, values in parts:
            title = "/".join(filter(None, (name, part)))
            if values.ndim == 1:
                columns[title + suffix] = values.astype(float)
                continue
            for component, column in zip("wxyz" if values.shape[1] == 4 else "xyz", values.T, strict=True):
                columns[f"{title}/{component}{suffix}"] = column
    return columns
