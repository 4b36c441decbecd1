"""What a solve has computed so far, kept as it comes."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from casadi_hands.diagnosis.reason import Reason
from casadi_hands.export.design import Design
from casadi_hands.nlp import Solution, SolverError
from casadi_hands.task import Task
from casadi_hands.terms.catalogue import single
from casadi_hands.terms.own import OwnTerm

STAGES = ("floating", "synthesis", "whole_hand", "refine")


@dataclass(frozen=True)
class Progress:
    """What a solve is doing.

    Attributes:
        stage: ``check`` for what the task alone shows, ``placement``, or one of ``STAGES``.
        text: what is tried, and the best so far.
        elapsed: s since the solve began.
    """

    stage: str
    text: str
    elapsed: float


STOPPED = "it was stopped before fewer motors were looked for"
AIM = 3.0  # deg from any goal in the replay as planned, beyond which more is tried


def rank_of(design: Design) -> tuple[float, ...]:
    """How far a judged design is from what is aimed at, best first.

    By limits that the files miss, limits that replays miss, motors where joints share them, drops, turns from goals
    beyond `AIM`, and the stiffness that the grasp asks for.
    """
    in_replays = design.missed_in_replays
    missed = len(design.missed) - len(in_replays)
    played = (math.inf, math.inf, math.inf, math.inf)
    if design.drops is not None:
        played = len(in_replays), _motors(design), design.drops, max(design.replay_angle, AIM)
    stiffness = design.certificate.get("least_stiffness", {}).get("value")
    return missed, *played, math.inf if stiffness is None else stiffness


def _motors(design: Design) -> float:
    """How many motors share the joints: fewer than these is what was asked for."""
    return math.inf if design.hand is None or design.hand.drive is None else design.hand.motors


class Record:
    """The design as it grows, with every solver run and all time spent, whichever design is returned in the end.

    Args:
        task: as solved.
        out: folder that is written on ``keep``, or None.
        report: told what is being done.
        own_terms: costs and constraints that a person adds to those of the stages.
    """

    def __init__(
        self,
        task: Task,
        out: Path | None,
        report: Callable[[Progress], None],
        own_terms: tuple[OwnTerm, ...] = (),
    ) -> None:
        self.task, self.out, self.report, self.own_terms = task, out, report, own_terms
        self.started = time.perf_counter()
        self.design = Design(task=task, status="failed", reason="nothing has been computed yet")
        self._best: tuple[tuple[float, ...], Design] | None = None
        self._unmet: dict[str, tuple[Reason, ...]] = {}

    def placed(self, task: Task, placement: dict[str, Any], written: bool) -> Record:
        """A record of the same task with its contacts placed, whose time has begun with this one.

        Args:
            task: with its contacts in place.
            placement: what is told of that.
            written: whether designs are written as they grow.
        """
        record = Record(task, self.out if written else None, self.report, self.own_terms)
        record.started = self.started
        record.update(task=task, placement=placement, seconds=dict(self.design.seconds))
        return record

    def log(self, stage: str, text: str) -> None:
        """Report progress."""
        self.report(Progress(stage, text, time.perf_counter() - self.started))

    @contextmanager
    def stage(self, name: str, text: str) -> Iterator[None]:
        """Announce a stage and add its time to the design's."""
        self.log(name, text)
        began = time.perf_counter()
        yield
        seconds = dict(self.design.seconds)
        seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - began
        self.update(seconds=seconds)

    def update(self, **changes: Any) -> None:
        """Change fields of the design."""
        self.design = replace(self.design, **changes)

    def add_runs(self, runs: Sequence[dict[str, Any]]) -> None:
        """Add entries of ``stages`` of result.json."""
        self.update(stages=[*self.design.stages, *runs])

    def set_costs(self, stage: str, solution: Solution, weights: Mapping[str, Any]) -> None:
        """Keep the weights and weighted values of a stage's terms; of annealed weights the last."""
        costs = {}
        for name, value in solution.terms.items():
            term = solution.declared[name]
            costs[name] = {"weight": float(single(weights[term.weighs_as or term.name])), "value": value}
        self.update(costs={**self.design.costs, stage: costs})

    def set_unmet(self, stage: str, reasons: tuple[Reason, ...]) -> None:
        """Keep which bounds of a person's own a stage's last solution misses."""
        self._unmet[stage] = reasons

    def held_to_bounds(self, design: Design) -> Design:
        """The design, told which bounds of a person's own were missed on the way to it; certified it is not then."""
        reasons = [reason.text for missed in self._unmet.values() for reason in missed]
        untold = [text for text in reasons if text not in design.reason]
        if not untold:
            return design
        status = "feasible" if design.status == "certified" else design.status
        return replace(design, status=status, reason=". ".join([*untold, *([design.reason] if design.reason else [])]))

    def complete(self, design: Design) -> Design:
        """An earlier design with all runs and all time spent until now."""
        seconds = {**self.design.seconds, "total": time.perf_counter() - self.started}
        return replace(design, stages=self.design.stages, seconds=seconds)

    def update_best(self, design: Design) -> Design:
        """Take a judged design for the best if it misses less than the best so far, and write it.

        Args:
            design: with its certificate; what misses fewer limits of the audit is better, of equals what misses fewer
                in replays (all, where they were not run), then what has fewer motors where joints share them, then
                what is dropped less. With more motors than asked for it is kept as feasible: fewer are looked for.

        Returns:
            the best design so far.
        """
        rank = rank_of(design)
        if design.status == "certified" and not design.replays:
            design = replace(design, status="feasible", reason="its files hold; it was stopped before it was replayed")
        asked, hand = self.task.motors, design.hand
        if design.status == "certified" and isinstance(asked, int) and hand is not None and hand.motors > asked:
            design = replace(design, status="feasible", reason=STOPPED)
        if self._best is None or rank < self._best[0]:
            self._best = rank, design
            self.keep(design)
        return self._best[1]

    def keep_unfinished(self, reason: str) -> None:
        """Write the design as it stands, not judged yet, unless there is a judged one, which it shall not replace."""
        if self._best is None:
            self.keep(replace(self.design, reason=reason))

    def broken_off(self, error: SolverError) -> Design:
        """The best design so far or, where none was judged, the failed one that there is."""
        if self._best is not None:
            return self._best[1]
        why = f"the solve broke off: {error}; another seed may not"
        return replace(self.design, status="failed", reason=why)

    def keep(self, design: Design) -> Design:
        """Complete a design and write it, if there is a place for it."""
        design = self.complete(design)
        if self.out is not None:
            design.save(self.out)
        return design
