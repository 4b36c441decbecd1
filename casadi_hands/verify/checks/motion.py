"""Is ``motion.npz`` a motion of this task: its times, orientations, contacts?"""

from __future__ import annotations

import numpy as np

from casadi_hands.verify.reading.folder import Folder

LONGEST_STEP = 0.1
"""s between samples."""
NEAR = 0.2
"""Of the object's longest half: how far from where the task says a finger may touch after a regrasp."""


def motion_problems(folder: Folder) -> list[str]:
    """Return what is wrong with times, orientations and contacts, a sentence each."""
    return [
        *_time_problems(folder),
        *_contact_problems(folder),
        *_idle_problems(folder),
        *regrasp_problems(folder),
    ]


def _time_problems(folder: Folder) -> list[str]:
    motion, problems = folder.motion, []
    step = float(np.max(np.diff(motion.time)))
    if step > LONGEST_STEP + 1e-9:
        problems.append(f"time: samples are up to {step:.3g} s apart; at most {LONGEST_STEP} s is allowed")
    if abs(motion.time[0]) > 1e-9 or abs(motion.time[-1] - folder.task.duration) > 1e-6:
        problems.append(
            f"time: the motion lasts from {motion.time[0]:.4g} s to {motion.time[-1]:.4g} s;"
            f" the task from 0 s to {folder.task.duration:.4g} s"
        )
    for who in ("object", "base"):
        off = np.abs(np.linalg.norm(getattr(motion, f"{who}_orientation"), axis=1) - 1.0)
        if off.max() > 1e-6:
            at = motion.time[int(np.argmax(off))]
            problems.append(f"{who}_orientation: the quaternion at {at:.3g} s is not unit: off by {off.max():.3g}")
    return problems


def _contact_problems(folder: Folder) -> list[str]:
    motion, problems = folder.motion, []
    for name, link in zip(motion.contact_names, motion.contact_link, strict=True):
        if link == "ground":
            if name in folder.task.fingers:
                problems.append(f"contact '{name}' is with the ground, not on its own finger")
        elif name not in folder.fingers:
            known = ", ".join(folder.task.fingers)
            problems.append(f"contact '{name}': the task has no finger of that name, only {known}")
        elif link.partition("_link")[0] != f"finger{folder.fingers.index(name)}":
            problems.append(f"contact '{name}' is on {folder.call(link)}, not on its own finger")
    if sum(link == "ground" for link in motion.contact_link) > 1:
        problems.append("contact_link: two contacts are with the ground; the task has one place that may rest on it")
    return problems


def _idle_problems(folder: Folder) -> list[str]:
    motion, problems = folder.motion, []
    for words, force, _ in folder.scenarios():
        idle = np.linalg.norm(force, axis=2) * ~motion.contact_active
        if idle.max(initial=0.0) > 1e-9 * folder.weight:
            k, c = np.unravel_index(np.argmax(idle), idle.shape)
            at = f"at {motion.time[k]:.3g} s{words}"
            problems.append(f"contact '{motion.contact_names[c]}' bears {idle[k, c]:.3g} N {at}, though not active")
    return problems


def regrasp_problems(folder: Folder) -> list[str]:
    """Return which fingers do not let go and touch again when and where the task says."""
    motion, problems = folder.motion, []
    room = NEAR * folder.task.object.characteristic_length
    for name, finger in folder.task.fingers.items():
        if not finger.regrasps:
            continue
        if name not in motion.contact_names:
            problems.append(f"contact '{name}': the task has it regrasp, and the hand has no such finger")
            continue
        c = motion.contact_names.index(name)
        free = np.zeros(len(motion.time), bool)
        for each in finger.regrasps:
            free |= (motion.time > each.start - 1e-6) & (motion.time < each.end - 1e-6)
            k = int(np.argmin(np.abs(motion.time - each.end)))
            off = float(np.linalg.norm(motion.contact_point_object[k, c] - np.array(each.touches)))
            if off > room:
                problems.append(
                    f"contact '{name}' touches {1e3 * off:.4g} mm from where the task has it regrasp at"
                    f" {each.end:g} s; {1e3 * room:.4g} mm are allowed"
                )
        # A contact acts from the sample at which it touches to that at which it lifts.
        wrong = motion.contact_active[:-1, c] == free[:-1]
        if wrong.any():
            k = int(np.argmax(wrong))
            has, due = ("touches", "has let go") if free[k] else ("does not touch", "touches")
            problems.append(f"contact '{name}' {has} at {motion.time[k]:.3g} s, where it {due} by the task's regrasps")
    return problems
