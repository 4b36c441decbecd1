"""What replays say of a design: one as planned and several perturbed ones, their figures and their record."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from casadi_hands.problem.result import first_few
from casadi_hands.task import Task
from casadi_hands.verify.replays.perturb import Perturbation, suite
from casadi_hands.verify.replays.replay import Player, Replay, can_play, replay_each
from casadi_hands.verify.replays.simulation import RELEASE, SQUEEZE
from casadi_hands.verify.report import Figure

TOGETHER = 4
"""Replays of a design with everything perturbed at once, beside those with one thing at a time."""

ENOUGH_STEPS = 100_000
"""Steps of a simulation that are worth starting processes for."""

_NAMES = {"mujoco": "MuJoCo", "drake": "Drake"}


@dataclass(frozen=True)
class Replays:
    """Replays of one design.

    Attributes:
        engine: that played them.
        task: of the folder.
        step: of the simulation, s.
        seed: of the perturbations.
        nominal: with nothing perturbed.
        perturbed: by the names that `suite` gives them.
    """

    engine: str
    task: Task
    step: float
    seed: int
    nominal: Replay
    perturbed: Mapping[str, Replay]

    @property
    def drops(self) -> int:
        """How many of the perturbed replays drop the object; all of them where even the nominal one does."""
        return len(self.perturbed) if self.nominal.dropped else len(self.dropping)

    @property
    def dropping(self) -> tuple[str, ...]:
        """Names of the perturbed replays that drop the object."""
        return tuple(name for name, each in self.perturbed.items() if each.dropped)

    def figures(self, task: Task | None = None) -> list[Figure]:
        """The certificate's figures: error at the goals as planned, and the share of perturbed replays that drop.

        Args:
            task: gives the limits and the goals' times; the folder's own by default.
        """
        task = task or self.task
        limits, engine = task.limits, _NAMES[self.engine]
        who = "object" if task.tool is None else "tool"
        times = [goal.at for goal in task.motion]

        def at(k: int) -> str:
            return f"from goal {k + 1} at {times[k]:.3g} s"

        distances = [goal.position for goal in self.nominal.goals]
        k = int(np.argmax(distances))
        found = f"in {engine} the {who} is {{value}} {at(k)}"
        figures = [Figure("replay_position", distances[k], limits.replay_position, "m", found)]
        angles = [goal.angle for goal in self.nominal.goals if goal.angle is not None]
        if angles:
            k = int(np.argmax(angles))
            found = f"in {engine} the object is turned {{value}} {at(k)}"
            figures.append(Figure("replay_angle", angles[k], limits.replay_angle, "deg", found))
        if self.nominal.dropped or self.perturbed:
            figures.append(self._dropped(engine, limits.replay_dropped))
        return figures

    def _dropped(self, engine: str, limit: float) -> Figure:
        if self.nominal.dropped:
            return Figure("replay_dropped", 1.0, limit, "share", f"in {engine} the object is dropped as planned")
        which = first_few(self.dropping)
        found = f"in {engine} {self.drops} of {len(self.perturbed)} perturbed replays drop the object{which}, {{value}}"
        return Figure("replay_dropped", self.drops / len(self.perturbed), limit, "share", found)

    def dropped_before(self, task: Task | None = None) -> str | None:
        """Say before which goal the object is lost with nothing perturbed; None where it is not.

        Args:
            task: as for `figures`.
        """
        if not self.nominal.dropped:
            return None
        task = task or self.task
        limits = task.limits
        for number, (goal, error) in enumerate(zip(task.motion, self.nominal.goals, strict=True), start=1):
            if error.position > limits.replay_position or (error.angle or 0.0) > limits.replay_angle:
                return f"in {_NAMES[self.engine]} the object is dropped before goal {number} at {goal.at:.3g} s"
        return f"in {_NAMES[self.engine]} the object is dropped on the way"

    def record(self) -> dict[str, Any]:
        """The entry of ``replays`` of result.json; lengths in mm, angles in degrees."""
        return {
            "engine": self.engine,
            "settings": {
                "version": version(self.engine),
                "timestep": self.step,
                "settle": SQUEEZE + RELEASE,
                "seed": self.seed,
                "suite": {name: each.perturbation.changes for name, each in self.perturbed.items()},
            },
            "goals": [{"mm": 1e3 * goal.position, "degrees": goal.angle} for goal in self.nominal.goals],
            "mean": _pair(self.nominal.position_mean, self.nominal.angle_mean),
            "largest": _pair(self.nominal.position_max, self.nominal.angle_max),
            "dropped_as_planned": self.nominal.dropped,
            "dropped": len(self.dropping),
            "of": len(self.perturbed),
            "perturbed": {
                name: {
                    "mean": _pair(each.position_mean, each.angle_mean),
                    "largest": _pair(each.position_max, each.angle_max),
                    "dropped": each.dropped,
                }
                for name, each in self.perturbed.items()
            },
        }


def _pair(position: float, angle: float) -> dict[str, float]:
    return {"mm": 1e3 * position, "degrees": angle}


def run_replays(
    directory: str | Path, count: int = TOGETHER, seed: int = 0, jobs: int = 1, engine: str = "mujoco"
) -> Replays:
    """Play a result folder as planned and perturbed.

    Args:
        directory: the result folder.
        count: replays with everything perturbed at once, beside those with one thing at a time; 0 for neither.
        seed: of the perturbations.
        jobs: processes to use at most; the outcome does not depend on it.
        engine: one of ``replay.ENGINES``.

    Raises:
        DesignError: the folder is incomplete, or ``scene.xml`` is not of this hand.
        HandsError: the engine is unknown, not installed or cannot be loaded.
    """
    player = Player(directory, engine)
    nominal = player.play(Perturbation())
    assert player.plan is not None
    tried = suite(player.folder, seed, count) if count else {}
    tried = {name: each for name, each in tried.items() if can_play(engine, each)}
    if jobs > 1 and len(tried) * len(player.plan) > ENOUGH_STEPS:
        played = replay_each(directory, list(tried.values()), jobs, engine)
    else:
        played = [player.play(each) for each in tried.values()]
    perturbed = dict(zip(tried, played, strict=True))
    return Replays(engine, player.folder.task, float(player.plan.time[1]), seed, nominal, perturbed)


def stronger_motors(directory: str | Path) -> Iterator[tuple[Perturbation, Replays]]:
    """Replay as planned with motors that press harder, and have the torque for that, then with stiffer ones.

    Where joints share motors, none are played: springs press, not motors.

    Args:
        directory: the result folder.

    Yields:
        what was changed, and how it went.
    """
    player = Player(directory)
    if player.folder.drive is not None:
        return

    def played_with(change: Perturbation) -> tuple[Perturbation, Replays]:
        seen = player.play(change)
        assert player.plan is not None
        return change, Replays("mujoco", player.folder.task, float(player.plan.time[1]), 0, seen, {})

    for factor in (1.5, 2.0, 3.0, 4.0, 6.0, 8.0):
        yield played_with(Perturbation(effort=factor, squeeze=factor))
    for factor in (2.0, 4.0, 8.0):
        yield played_with(Perturbation(effort=factor, stiffness=factor))
