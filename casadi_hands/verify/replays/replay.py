"""Play a design in a physics engine that took no part in it: does the hand really do the task?

The simulated hand knows its plan and nothing of the object. Each joint is a position-controlled motor that follows the
``joint_commands`` of ``motion.npz``: the planned angle, offset by ``(planned torque + damping * planned speed) /
stiffness``. The planned torque is what presses the contacts with their planned forces, the rest keeps damping from
dragging behind the plan. Torque is limited to the hand's effort. Everything starts at rest at the first sample, whose
commands hold for half a second; then the motion begins. The object is free all the while, but where a perturbation puts
it off its place: there a soft support holds it while the hand takes it, and then lets go.

Why this is fair to a real hand, as ``scene.xml`` has it:

- *Motors* are springs about their set points, as stiff as the task says, and critically damped. The hand carries its
  own weight, as a controller that knows its hand does.
- *Contacts* are soft (a fingertip gives like rubber), with the task's Coulomb and torsional friction. The plan counts
  on the torsion as the audit says, and not on the softness.
- *Nothing is fed back* from the object, so an error made is never corrected: a real controller can only do better.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.errors import HandsError
from casadi_hands.lifetime import follow_parent
from casadi_hands.verify.held import held
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.replays.mounted import turned_far
from casadi_hands.verify.replays.perturb import Perturbation, draw_perturbation
from casadi_hands.verify.replays.plan import Plan
from casadi_hands.verify.replays.simulation import Observer, Simulation

DROP = 0.5
"""Share of half the object's extent by which it may be off its plan before it counts as dropped."""

GONE = 4.0
"""Of half the extent: an object that is so far off is not followed any farther."""


@dataclass(frozen=True)
class GoalError:
    """How far the object (of a drawing: its tool) was from a goal of the task.

    Attributes:
        position: m.
        angle: deg; None of a drawing, which asks for none.
    """

    position: float
    angle: float | None


@dataclass(frozen=True)
class Replay:
    """How far the object was from its plan.

    Attributes:
        goals: at each goal of the task.
        position_mean, position_max, position_final: m, over the motion and at its end.
        angle_mean, angle_max, angle_final: deg.
        dropped: the object was once farther from its plan than `DROP` says, or ended with no planned contact left.
            Of an object on a joint, which does not fall, what its turn off the plan moves its surface by counts, too.
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
    goals: tuple[GoalError, ...] = ()


def replay(
    directory: str | Path,
    perturbation: Perturbation | None = None,
    observer: Observer | None = None,
    engine: str = "mujoco",
) -> Replay:
    """Play the motion of a result folder once.

    Args:
        directory: the result folder.
        perturbation: what is different from the plan; nothing when None.
        observer: looks on, for a video say; MuJoCo's only.
        engine: one of ``ENGINES``.

    Raises:
        DesignError: the folder is incomplete, or ``scene.xml`` is not of this hand.
        HandsError: the engine is unknown, not installed or cannot be loaded.
    """
    return Player(directory, engine).play(perturbation or Perturbation(), observer)


def replay_many(directory: str | Path, n: int, seed: int = 0, jobs: int = 1, engine: str = "mujoco") -> list[Replay]:
    """Play the motion ``n`` times, everything perturbed at once; the seed and the number fix how.

    Args:
        directory: the result folder.
        n: number of replays.
        seed: of the perturbations.
        jobs: processes; the outcome does not depend on it.
        engine: one of ``ENGINES``.

    Raises:
        DesignError, HandsError: as `replay`.
    """
    folder = read_folder(directory)
    return replay_each(directory, [draw_perturbation(folder, seed, number) for number in range(n)], jobs, engine)


def replay_each(
    directory: str | Path, perturbations: Sequence[Perturbation], jobs: int = 1, engine: str = "mujoco"
) -> list[Replay]:
    """Play the motion once for each perturbation.

    Args:
        directory: the result folder.
        perturbations: what is different from the plan in each replay.
        jobs: processes; the outcome does not depend on it.
        engine: one of ``ENGINES``.

    Raises:
        DesignError, HandsError: as `replay`; and processes died again and again.
    """
    if jobs == 1:
        return _replay_all(directory, engine, perturbations)
    shares = [perturbations[k::jobs] for k in range(min(jobs, len(perturbations)))]
    # Forking a process that runs threads (a progress display, a solver) can hang it.
    context = multiprocessing.get_context("spawn")
    for _ in range(ATTEMPTS):
        try:
            with ProcessPoolExecutor(jobs, mp_context=context, initializer=follow_parent) as pool:
                played = list(pool.map(partial(_replay_all, directory, engine), shares))
        except BrokenProcessPool as error:
            lost = error
        else:
            return [played[k % jobs][k // jobs] for k in range(len(perturbations))]
    raise HandsError(f"{directory}: processes that replay this died each of {ATTEMPTS} times; give --jobs 1") from lost


def _replay_all(directory: str | Path, engine: str, perturbations: Sequence[Perturbation]) -> list[Replay]:
    """Play the motion of a result folder once for each perturbation."""
    player = Player(directory, engine)
    return [player.play(each) for each in perturbations]


class World(Protocol):
    """A physics engine with hand and object in it.

    Attributes:
        step: s.
    """

    step: float

    def settle(self, plan: Plan, observer: Observer | None) -> None:
        """Hold the first commands for half a second."""

    def play(self, plan: Plan, i: int, push: np.ndarray, observer: Observer | None) -> None:
        """Drive the hand as planned for a step; ``push`` (3,) is a force on the object, N, world."""

    def object_pose(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the object's position (3,) and quaternion (4,) [w, x, y, z], world."""

    def touches(self, link: str) -> bool:
        """Whether the object touches any link of the contact's finger (or the ground)."""


def _drake(folder: Folder, perturbation: Perturbation) -> World:
    if folder.task.object.attached is not None:
        raise HandsError(
            "replay with Drake is for free objects; this one is attached to the world: try --engine mujoco"
        )
    # It takes a second to load, and most replays do without.
    from casadi_hands.verify.replays.drake import DrakeSimulation

    return DrakeSimulation(folder, perturbation)


ATTEMPTS = 3
"""Times that processes may die with replays before these are given up."""

ENGINES: dict[str, Callable[[Folder, Perturbation], World]] = {"mujoco": Simulation, "drake": _drake}
"""Physics engines by name."""


def can_play(engine: str, perturbation: Perturbation) -> bool:
    """Return whether an engine can be told of all that is different from the plan."""
    return engine != "drake" or perturbation.torsion == 1.0


class Player:
    """A result folder and, once it has been played, its plan, which no perturbation changes.

    Args:
        directory: the result folder.
        engine: one of ``ENGINES``.

    Raises:
        DesignError: the folder is incomplete.
        HandsError: there is no such engine.
    """

    def __init__(self, directory: str | Path, engine: str = "mujoco") -> None:
        if engine not in ENGINES:
            raise HandsError(f"engine: given {engine!r}; allowed: {', '.join(ENGINES)}")
        self.folder, self._enter = read_folder(directory), ENGINES[engine]
        self.plan: Plan | None = None

    def play(self, perturbation: Perturbation, observer: Observer | None = None) -> Replay:
        """Play the motion from its start to its end.

        Raises:
            DesignError: ``scene.xml`` is missing, or not of this hand.
            HandsError: the engine cannot be loaded, or cannot be told of the perturbation; joints that share motors
                shall press harder, which no position of these does.
        """
        if self.folder.drive is not None and perturbation.squeeze != 1.0:
            raise HandsError(
                f"squeeze: given {perturbation.squeeze:g}; allowed: 1, since motors that share joints press by how "
                "stiff springs are: change stiffness"
            )
        folder, scene = self.folder, self._enter(self.folder, perturbation)
        self.plan = plan = self.plan or Plan(folder, scene.step)
        scene.settle(plan, observer)
        positions, quaternions = np.empty((len(plan), 3)), np.empty((len(plan), 4))
        positions[0], quaternions[0] = scene.object_pose()
        push, nothing = np.asarray(perturbation.push), np.zeros(3)
        for i in range(len(plan) - 1):
            pushed = perturbation.push_start <= i * scene.step < perturbation.push_end
            scene.play(plan, i, push if pushed else nothing, observer)
            positions[i + 1], quaternions[i + 1] = scene.object_pose()
            if plan.distance(i + 1, positions[i + 1]) > GONE * folder.length:
                positions[i + 2 :], quaternions[i + 2 :] = positions[i + 1], quaternions[i + 1]
                break
        errors = np.stack(plan.errors(positions, quaternions), axis=1)
        due = [c for c in range(len(folder.motion.contact_names)) if folder.motion.contact_active[-1, c]]
        lost = [c for c in due if not scene.touches(folder.motion.contact_link[c])]
        gone = (
            not errors[:, 0].max() + turned_far(folder, held(folder), errors[:, 1]) <= DROP * folder.length
        )  # so that no number at all is gone, too
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
            goals=tuple(self._goal_errors(plan, positions, quaternions)),
        )

    def _goal_errors(self, plan: Plan, positions: np.ndarray, quaternions: np.ndarray) -> Iterator[GoalError]:
        """Yield how far the object was from each goal, at its time."""
        task = self.folder.task
        for goal in task.motion:
            i = int(np.argmin(np.abs(plan.time - goal.at)))
            turn = Rotation.from_quat(quaternions[i], scalar_first=True)
            if task.tool is not None:
                drawn = positions[i] + turn.apply(np.asarray(task.tool))
                yield GoalError(float(np.linalg.norm(drawn - np.asarray(goal.tool_at))), None)
                continue
            off = (Rotation.from_rotvec(goal.rotation.vector).inv() * turn).magnitude()
            yield GoalError(float(np.linalg.norm(positions[i] - np.asarray(goal.position))), float(np.rad2deg(off)))
