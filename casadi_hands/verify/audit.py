"""The audit: every figure of the certificate, recomputed from the files of a result folder.

Nothing of the optimiser takes part: kinematics by numeric Pinocchio on ``hand.urdf``, distances by coal, the object's
physics integrated anew (see ``dynamics``), the motion between samples rebuilt from the samples (see ``trajectory``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from casadi_hands.task import load_task
from casadi_hands.verify.checks.certificate import PLAYED, certificate_problems, replay_problems
from casadi_hands.verify.checks.structure import structure_problems
from casadi_hands.verify.checks.trust import limit_notes, unread_notes
from casadi_hands.verify.figures.attached import attachment_figures, joint_residual, object_shots
from casadi_hands.verify.figures.clearance import joint_figure, penetration_figure, speed_figure
from casadi_hands.verify.figures.contact import (
    friction_figures,
    gap_at_samples,
    gap_between_samples,
    slip_figure,
    spin_figure,
)
from casadi_hands.verify.figures.coupling import coupling_figures, motor_speed_figure
from casadi_hands.verify.figures.disturbances import disturbed_figures
from casadi_hands.verify.figures.dynamics import Shots, between_residual, sample_residual
from casadi_hands.verify.figures.goals import goal_figures, rest_figure
from casadi_hands.verify.figures.raw_mesh import raw_mesh_figures
from casadi_hands.verify.figures.sliding import sliding_figure
from casadi_hands.verify.figures.stiffness import stability_figures
from casadi_hands.verify.figures.structure import structure_figures
from casadi_hands.verify.figures.torsion import torsion_figures
from casadi_hands.verify.figures.wrench import disturbance_figure, torque_figure, unsupplied_figure
from casadi_hands.verify.held import held
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.replays.series import TOGETHER, run_replays
from casadi_hands.verify.report import Audit, Figure
from casadi_hands.verify.trajectory import build_trajectory, sample_placements


def audit(directory: str | Path, *, task: str | Path | None = None, replays: int = TOGETHER, jobs: int = 1) -> Audit:
    """Recompute every figure of a result folder and hold it against the task's limits.

    Args:
        directory: the result folder.
        task: file of a task that is trusted, to judge by in place of the folder's.
        replays: those with everything perturbed at once, beside those with one thing at a time and one as planned,
            where all else holds; 0 for no replays at all.
        jobs: processes for them; the outcome does not depend on it.

    Raises:
        DesignError: a file is missing or cannot be read as the format says.
        TaskError: ``task.yaml`` is not a task.
        HandsError: MuJoCo cannot be loaded.
    """
    own, found = task is None, audit_files(directory, task)
    figures = {name: figure for name, figure in found.figures.items() if name != "structure"}
    found = _with_problems(found, certificate_problems(directory, figures, own))
    if not replays or not found.certified:
        return found
    played = run_replays(directory, replays, jobs=jobs)
    figures = {figure.name: figure for figure in played.figures(None if task is None else load_task(task))}
    # How many drop the object depends on how many are played.
    stated = {name: figure for name, figure in figures.items() if name != "replay_dropped" or replays == TOGETHER}
    wrong = [*certificate_problems(directory, stated, own, PLAYED), *replay_problems(directory, played)]
    return _with_problems(replace(found, figures={**found.figures, **figures}), wrong)


def _with_problems(found: Audit, wrong: Sequence[str]) -> Audit:
    """Return the audit with what else is wrong with the files."""
    if not wrong:
        return found
    problems = (*found.problems, *wrong)
    structure = replace(found.figures["structure"], value=float(len(problems)))
    return replace(found, figures={**found.figures, "structure": structure}, problems=problems)


def audit_files(directory: str | Path, task: str | Path | None = None) -> Audit:
    """Recompute the figures that need no physics engine.

    Args:
        directory: the result folder.
        task: file of a task that is trusted, to judge by in place of the folder's.

    Raises:
        DesignError: a file is missing or cannot be read as the format says.
        TaskError: ``task.yaml`` is not a task.
    """
    folder = read_folder(directory, task)
    shots, placed = object_shots(folder), sample_placements(folder)
    joint = held(folder)
    path = build_trajectory(folder, shots)
    problems = structure_problems(folder, path)
    figures = [
        Figure("structure", float(len(problems)), 0.0, "", "{value} disagreements within the files"),
        *goal_figures(folder),
        rest_figure(folder, shots),
        *residual_figures(folder, shots),
        *disturbed_figures(folder),
        *(() if joint is None else attachment_figures(folder, joint)),
        *friction_figures(folder, placed),
        *torsion_figures(folder, placed, path),
        sliding_figure(folder, placed, path),
        gap_at_samples(folder, placed),
        gap_between_samples(folder, path),
        slip_figure(folder, path),
        spin_figure(folder, path),
        penetration_figure(folder, path),
        *raw_mesh_figures(folder, placed),
        joint_figure(folder, path),
        speed_figure(folder, path) if folder.drive is None else motor_speed_figure(folder, folder.drive),
        torque_figure(folder),
        *coupling_figures(folder),
        unsupplied_figure(folder),
        disturbance_figure(folder, placed),
        *stability_figures(folder),
        *structure_figures(folder, placed),
    ]
    notes = (*limit_notes(folder), *unread_notes(folder))
    return Audit(folder.task.name, {figure.name: figure for figure in figures}, tuple(problems), notes)


def residual_figures(folder: Folder, shots: Shots) -> list[Figure]:
    """Return the Newton-Euler residual at the samples and between them, over the weight (torque: times l)."""
    limits, time = folder.task.limits, folder.motion.time
    joint = held(folder)
    force, torque = sample_residual(folder, shots) if joint is None else joint_residual(folder, joint)
    kind, values = max((("force", force), ("torque", torque)), key=lambda item: float(np.max(item[1])))
    k = int(np.argmax(values))
    words = f"a {kind} of {{value}} that nothing exerts moves the object at {time[k + 1]:.3g} s"
    around = np.maximum(np.append(values, 0.0), np.append(0.0, values))  # in both intervals that meet at a sample
    at = Figure("residual", float(values[k]), limits.residual, "weight", words, by_interval=around)
    between = between_residual(folder)
    k = int(np.argmax(between))
    words = (
        f"between {time[k]:.3g} s and {time[k + 1]:.3g} s the contacts' surfaces turn the object by {{value}} unstated"
    )
    inside = float(between[k])
    if at.value > inside:
        inside, words = at.value, at.finding
    return [at, Figure("residual_between", inside, limits.residual_between, "weight", words, by_interval=between)]
