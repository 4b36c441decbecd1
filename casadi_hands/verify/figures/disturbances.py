"""Are the task's perturbations in the motion, as it states them, and can the hand bear them?

A perturbation acts at every sample from its begin to its end; a shorter one than the sampling at the sample nearest to
its middle. A sample within `NEAR` of its time may have it too, because samples are halved where a motion asks for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, pairwise

import numpy as np

from casadi_hands.task.motion import Perturbation
from casadi_hands.verify.figures.attached import along_world
from casadi_hands.verify.figures.dynamics import object_rotation
from casadi_hands.verify.held import held
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.report import Figure

NEAR = 0.1
"""s around a perturbation in which samples may have it."""


def external_problems(folder: Folder) -> list[str]:
    """Return where the motion has not the task's forces and torques, or has others, a sentence each."""
    motion, pushes = folder.motion, folder.task.perturbations
    plain = (motion.external_force, motion.external_torque)
    due = exerted(folder)
    # What differs from the world's answer by rounding is that.
    plain = (_beside(folder, plain[0], due[0], 1.0), _beside(folder, plain[1], due[1], folder.length))
    helped = np.any(np.hstack(plain) != 0.0)
    disturbed = (motion.external_force_disturbed, motion.external_torque_disturbed)
    given = [part is not None for part in (motion.contact_force_disturbed, *disturbed)]
    if any(given) and not all(given):
        return [
            "motion.npz: has only a part of the arrays contact_force_disturbed, external_force_disturbed and"
            " external_torque_disturbed"
        ]
    problems = _different(folder, *plain, "external") if helped else []
    if all(given):
        assert disturbed[0] is not None
        assert disturbed[1] is not None
        force = _beside(folder, disturbed[0], due[0], 1.0)
        torque = _beside(folder, disturbed[1], due[1], folder.length)
        problems += _different(folder, force, torque, "external", "_disturbed")
        problems += _unexplained(folder, force, torque)
    elif pushes and not helped and not folder.legacy:
        problems.append(
            "contact_force_disturbed: missing, so nothing shows that the grasp stands the task's perturbations"
        )
    return problems


def exerted(folder: Folder) -> tuple[np.ndarray, np.ndarray]:
    """Return force and torque (S, 3), world, with which the world answers what the task has the object exert.

    It is all there from the goal before to the goal that states it, and grows and falls within the task's time step
    outside.
    """
    time, step = folder.motion.time, folder.task.time_step
    force, torque = np.zeros((len(time), 3)), np.zeros((len(time), 3))
    for before, goal in pairwise(folder.task.motion):
        if goal.exert is not None:
            share = np.interp(time, [before.at - step, before.at, goal.at, goal.at + step], [0.0, 1.0, 1.0, 0.0])
            force -= np.outer(share, goal.exert.force)
            torque -= np.outer(share, goal.exert.torque)
    return force, torque


def _beside(folder: Folder, values: np.ndarray, due: np.ndarray, lever: float) -> np.ndarray:
    """Return what a force or torque (S, 3) is beside what is due, which may differ by rounding."""
    rest = values - due
    return np.where(np.abs(rest) <= 1e-9 * (np.abs(due).max() + folder.weight * lever * due.any()), 0.0, rest)


def _different(folder: Folder, force: np.ndarray, torque: np.ndarray, name: str, suffix: str = "") -> list[str]:
    """Return, for force and torque, where the external one is not what the task states there."""
    pushes, time = folder.task.perturbations, folder.motion.time
    inside = _acting(pushes, time, np.any(np.hstack([force, torque]) != 0.0, axis=1))
    near = np.array([(time >= p.start - NEAR - 1e-9) & (time <= p.end + NEAR + 1e-9) for p in pushes], dtype=bool)
    near = near.reshape(len(pushes), len(time)) & ~inside
    problems = []
    for kind, values, unit in (("force", force, "N"), ("torque", torque, "N·m")):
        each = np.array([getattr(push, kind) for push in pushes], dtype=float).reshape(-1, 3)
        due, scale = inside.T @ each, max(float(np.abs(each).max(initial=0.0)), 1e-3 * folder.weight)
        off = np.array([_off(values[k], due[k], each[near[:, k]]) for k in range(len(time))])
        if off.max() <= 1e-9 * scale:
            continue
        acting = off * np.any(values != 0.0, axis=1)  # what helps is worse than what is missing
        k = int(np.argmax(acting if acting.max() > 1e-9 * scale else off))
        what = f"{name}_{kind}{suffix}: at {time[k]:.3g} s it is {_words(values[k])} {unit}"
        if np.any(due[k]):
            problems.append(f"{what}; the task's perturbations state {_words(due[k])} {unit}")
        else:
            problems.append(f"{what}; the object is helped by what the task does not state")
    return problems


def _acting(pushes: Sequence[Perturbation], time: np.ndarray, disturbed: np.ndarray) -> np.ndarray:
    """Return (P, S) whether each perturbation must act at each sample; of two as near, at one that is disturbed."""
    acting = np.zeros((len(pushes), len(time)), dtype=bool)
    for row, push in zip(acting, pushes, strict=True):
        row[:] = (time >= push.start - 1e-9) & (time <= push.end + 1e-9)
        if not row.any():
            off = np.abs(time - 0.5 * (push.start + push.end))
            nearest = np.flatnonzero(off <= off.min() + 1e-6)
            row[next((k for k in nearest if disturbed[k]), nearest[0])] = True
    return acting


def _off(value: np.ndarray, due: np.ndarray, optional: np.ndarray) -> float:
    """Return how far a value (3,) is from what is due, with any of the optional ones (N, 3) beside."""
    some = [chosen for n in range(min(len(optional), 8) + 1) for chosen in combinations(optional, n)]
    return min(float(np.abs(value - due - np.sum(chosen, axis=0)).max()) for chosen in some)


def _words(vector: np.ndarray) -> str:
    return "(" + ", ".join(f"{part:.3g}" for part in vector) + ")"


def _unexplained(folder: Folder, force: np.ndarray, torque: np.ndarray) -> list[str]:
    """Return where contact forces differ from the plan though nothing disturbs it."""
    motion, quiet = folder.motion, ~np.any(np.hstack([force, torque]) != 0.0, axis=1)
    assert motion.contact_force_disturbed is not None
    off = np.abs(motion.contact_force_disturbed - motion.contact_force).max(axis=(1, 2), initial=0.0) * quiet
    if off.max() <= 1e-9 * folder.weight:
        return []
    at = motion.time[int(np.argmax(off))]
    return [f"contact_force_disturbed: at {at:.3g} s it is not contact_force, though nothing disturbs the object there"]


def disturbed_figures(folder: Folder) -> list[Figure]:
    """Return what the contacts leave of the task's perturbations, over the weight (torque: times l).

    The motion is that of the plan, so what the contacts exert beyond the plan and what disturbs must cancel.
    """
    motion = folder.motion
    force, torque = motion.external_force_disturbed, motion.external_torque_disturbed
    if force is None or torque is None or motion.contact_force_disturbed is None:
        return []
    more = motion.contact_force_disturbed - motion.contact_force
    arms = np.einsum("sij,scj->sci", object_rotation(folder).as_matrix(), motion.contact_point_object)
    turning = np.cross(arms, more).sum(axis=1) + torque - motion.external_torque
    left = np.linalg.norm(more.sum(axis=1) + force - motion.external_force, axis=1) / folder.weight
    spin = np.linalg.norm(turning, axis=1) / (folder.weight * folder.length)
    joint = held(folder)
    if joint is not None:  # which bears all but what it lets go
        pulled = more.sum(axis=1) + force - motion.external_force
        along = np.abs(np.sum(np.hstack([pulled, turning]) * along_world(folder, joint), axis=1)) / joint.unit(folder)
        left, spin = (0.0 * along, along) if joint.turns else (along, 0.0 * along)
    kind, values = max((("force", left), ("torque", spin)), key=lambda item: float(item[1].max()))
    k = int(np.argmax(values))
    words = f"a {kind} of {{value}} of the task's perturbations is borne by nothing at {motion.time[k]:.3g} s"
    limit = folder.task.limits.residual
    return [Figure("residual_disturbed", float(values[k]), limit, "weight", words)]
