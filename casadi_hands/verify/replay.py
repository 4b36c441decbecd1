"""Play a design in MuJoCo, which took no part in it: does the hand really do the task?

The simulated hand knows its plan and nothing of the object. Each joint is a position-controlled motor that follows the
planned angle, its target offset by ``(planned torque + damping * planned speed) / stiffness``: the planned torque is
what presses the contacts with their planned forces, the rest keeps damping from dragging behind the plan. Torque is
limited to the hand's effort. The object is free; only before the motion starts does a soft support hold it at its
start, while the squeeze builds up, and then lets go.

Why this is fair to a real hand, as ``scene.xml`` has it:

- *Motors* deflect by 50 mrad under the load that the finger may have to hold, and are critically damped: hobby
  servos and tendon drives are about that stiff. The hand carries its own weight, as a controller that knows its
  hand does.
- *Contacts* are soft (a fingertip gives by a share of the object's size), with Coulomb friction of the task's
  coefficient and the small torsional friction of a patch of 0.3 of the fingertip's radius. The plan counts on neither
  softness nor torsion: rubber gives both for nothing, and without them a point contact spins freely.
- *Nothing is fed back* from the object, so an error made is never corrected: a real controller can only do better.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from casadi_hands.verify.folder import read_folder
from casadi_hands.verify.perturb import Perturbation, draw_perturbation
from casadi_hands.verify.simulation import Observer, Plan, Simulation

DROP = 0.5
"""Share of half the object's extent by which it may be off its plan before it counts as dropped."""


@dataclass(frozen=True)
class Replay:
    """How far the object was from its plan.

    Attributes:
        position_mean, position_max, position_final: m, over the motion and at its end.
        angle_mean, angle_max, angle_final: deg.
        dropped: the object was once farther from its plan than `DROP` says, or ended with no planned contact left.
        lost_contacts: contacts that should touch at the end and do not.
        perturbation: what was different from the plan.
    """

    position_mean: float
    position_max: float
    position_final: float
    angle_mean: float
    angle_max: float
    angle_final: float
    dropped: bool
    lost_contacts: tuple[str, ...]
    perturbation: Perturbation


def replay(directory: str | Path, perturbation: Perturbation | None = None, observer: Observer | None = None) -> Replay:
    """Play the motion of a result folder once.

    Args:
        directory: the result folder.
        perturbation: what is different from the plan; nothing when None.
        observer: looks on, for a video say.

    Raises:
        DesignError: the folder is incomplete, or ``scene.xml`` is not of this hand.
        HandsError: MuJoCo is not installed or cannot be loaded.
    """
    return _Player(directory).play(perturbation or Perturbation(), observer)


def replay_many(directory: str | Path, n: int, seed: int = 0, jobs: int = 1) -> list[Replay]:
    """Play the motion ``n`` times, each perturbed in its own way; the seed and the number fix how.

    Args:
        directory: the result folder.
        n: number of replays.
        seed: of the perturbations.
        jobs: processes; the outcome does not depend on it.

    Raises:
        DesignError, HandsError: as `replay`.
    """
    folder = read_folder(directory)
    drawn = [draw_perturbation(folder, seed, number) for number in range(n)]
    if jobs == 1:
        return _replay_all(directory, drawn)
    shares = [drawn[k::jobs] for k in range(min(jobs, n))]
    # Forking a process that runs threads (a progress display, a solver) can hang it.
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        played = list(pool.map(partial(_replay_all, directory), shares))
    return [played[k % jobs][k // jobs] for k in range(n)]


def _replay_all(directory: str | Path, perturbations: Sequence[Perturbation]) -> list[Replay]:
    """Play the motion of a result folder once for each perturbation."""
    player = _Player(directory)
    return [player.play(each) for each in perturbations]


class _Player:
    """A result folder and, once it has been played, its plan, which no perturbation changes."""

    def __init__(self, directory: str | Path) -> None:
        self.folder = read_folder(directory)
        self.plan: Plan | None = None

    def play(self, perturbation: Perturbation, observer: Observer | None = None) -> Replay:
        """Play the motion from its start to its end."""
        folder, scene = self.folder, Simulation(self.folder, perturbation)
        self.plan = plan = self.plan or Plan(folder, scene.step)
        scene.settle(plan, observer)
        positions, quaternions = np.empty((len(plan) - 1, 3)), np.empty((len(plan) - 1, 4))
        for i in range(len(plan) - 1):
            pushed = perturbation.push_start <= i * scene.step < perturbation.push_end
            scene.play(plan, i, np.asarray(perturbation.push) if pushed else np.zeros(3), observer)
            positions[i], quaternions[i] = scene.object_pose()
        errors = np.stack(plan.errors(1, positions, quaternions), axis=1)
        due = [c for c in range(len(folder.motion.contact_names)) if folder.motion.contact_active[-1, c]]
        lost = [c for c in due if not scene.touches(folder.motion.contact_link[c])]
        gone = errors[:, 0].max() > DROP * folder.length
        mean, largest, final = (values.tolist() for values in (errors.mean(axis=0), errors.max(axis=0), errors[-1]))
        return Replay(
            position_mean=mean[0],
            position_max=largest[0],
            position_final=final[0],
            angle_mean=mean[1],
            angle_max=largest[1],
            angle_final=final[1],
            dropped=bool(gone or (due and len(lost) == len(due))),
            lost_contacts=tuple(folder.motion.contact_names[c] for c in lost),
            perturbation=perturbation,
        )
