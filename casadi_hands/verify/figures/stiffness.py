"""What the stability of a grasp comes to: the certificate's figures, in a buyer's units and in words."""

from __future__ import annotations

import numpy as np

from casadi_hands.verify.figures.stability import Stability
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.report import Figure


def stability_figures(folder: Folder) -> list[Figure]:
    """Return the least stiffness of joints and of fingertips with which the planned grasp holds itself."""
    stability = Stability(folder)
    modes = stability.modes()
    k = int(np.argmax([mode.stiffness for mode in modes]))
    worst, time = modes[k], folder.motion.time
    if worst.stiffness <= 0.0:
        words = "the grasp holds itself, however soft the joints are"
        tips = words
    else:
        fewest = f"the object {_in_words(stability, k, worst.twist)} at {time[k]:.3g} s"
        words = f"{fewest} unless joints have {{value}}"
        j = int(np.argmax([mode.tips for mode in modes]))
        tips = (
            f"the object {_in_words(stability, j, modes[j].twist)} at {time[j]:.3g} s unless fingertips have {{value}}"
        )
    value, tip = (max(max(getattr(mode, name) for mode in modes), 0.0) for name in ("stiffness", "tips"))
    limit = folder.task.limits.least_stiffness
    figures = [
        Figure("least_stiffness", value, limit, "N·m/rad", words),
        Figure("least_tip_stiffness", 1e-3 * tip / folder.weight, None, "weight/mm", tips),
    ]
    spun = int(np.argmax([mode.free for mode in modes]))
    if modes[spun].free > 0.0:
        words = f"at {time[spun]:.3g} s the object turns between its contacts, which no joint resists, with {{value}}"
        figures.append(Figure("free_spin", modes[spun].free, None, "N·m/rad", words))
    return figures


def _in_words(stability: Stability, k: int, twist: np.ndarray) -> str:
    """Return what the object does in a motion (6,), palm frame, at a sample."""
    folder = stability.folder
    shift, turn = twist[:3], twist[3:]
    if np.linalg.norm(shift) > folder.length * np.linalg.norm(turn):
        along = abs(float(shift[2])) / max(float(np.linalg.norm(shift)), 1e-300)
        return "slides towards or away from the palm" if along > 0.8 else "slides along the palm's face"
    axis = turn / max(float(np.linalg.norm(turn)), 1e-300)
    lines = {"the palm's axis": np.array([0.0, 0.0, 1.0]), "the vertical": stability.up[k]}
    active = np.flatnonzero(folder.motion.contact_active[k])
    for first in active:
        for second in active[active > first]:
            line = stability.first[second][0][k] - stability.first[first][0][k]
            names = (folder.motion.contact_names[c] for c in (first, second))
            lines["the line through '{}' and '{}'".format(*names)] = line / max(float(np.linalg.norm(line)), 1e-300)
    name, near = max(((name, abs(float(axis @ line))) for name, line in lines.items()), key=lambda item: item[1])
    if near > np.cos(np.deg2rad(25.0)):
        return f"turns about {name}"
    return f"turns about an axis {np.rad2deg(np.arccos(min(abs(float(axis[2])), 1.0))):.0f}° from the palm's"
