"""Where a contact slides, is friction on its cone against the slip?

Coulomb's friction leaves no choice there: what slides drags the other body along with all of the friction. A force
that is less, or another way, is one that no real contact has.
"""

from __future__ import annotations

import numpy as np

from casadi_hands.verify.figures.contact import Placements, active_runs, slides, surface_normals
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.report import Figure, worse
from casadi_hands.verify.trajectory import Trajectory

SLIDING = 1e-3
"""m/s: a contact that slips quicker slides."""
CREEP = 2e-4
"""m of slip from touch to lift, up to which nothing is asked of the force: the usual limit of slip."""
LEAST = 0.05
"""Of the weight: a normal force below which nothing is asked of the tangential one."""


def sliding_figure(folder: Folder, placed: Placements, path: Trajectory) -> Figure:
    """Return how far a contact's tangential force is from μ f_n against its slip, over μ f_n, where it slides.

    Force and slip are means over the interval between two samples.
    """
    motion = folder.motion
    worst = (0.0, "no contact slides")
    for c, name in enumerate(motion.contact_names):
        intervals = len(motion.time) - 1
        moved, slipped = np.zeros((intervals, 3)), np.zeros(intervals)
        for k, step in slides(folder, path, c):
            moved[k] += step
            slipped[k] += float(np.linalg.norm(step))
        speed = np.linalg.norm(moved, axis=1) / np.diff(motion.time)
        for first, last in active_runs(folder, path, c):
            if slipped[first:last].sum() <= CREEP:
                continue
            for k in range(first, last):
                pressing, across = _mean_force(folder, placed, k, c)
                if speed[k] <= SLIDING or pressing <= LEAST * folder.weight:
                    continue
                # The object slides along ``moved``: friction pulls it back.
                off = across / (folder.friction(c) * pressing) + moved[k] / np.linalg.norm(moved[k])
                words = f"contact '{name}' slides at {motion.time[k]:.3g} s with friction {{value}} off its cone"
                worst = worse(worst, (float(np.linalg.norm(off)), f"{words} against the slip"))
    return Figure("slide_shortfall", worst[0], folder.task.limits.slide_shortfall, "share", worst[1])


def _mean_force(folder: Folder, placed: Placements, k: int, contact: int) -> tuple[float, np.ndarray]:
    """Return a contact's normal force and its tangential one (3,), world, in the middle of an interval, N."""
    pressing, across = 0.0, np.zeros(3)
    for sample in (k, k + 1):
        force, outward = (
            folder.motion.contact_force[sample, contact],
            surface_normals(folder, placed, sample, contact)[0],
        )
        pressing -= float(force @ outward) / 2
        across += (force - (force @ outward) * outward) / 2
    return pressing, across
