"""What a solve has computed so far, kept as it comes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

from casadi_hands.diagnosis.reason import Reason
from casadi_hands.execution.journal import Journal
from casadi_hands.export.design import Design
from casadi_hands.nlp import Solution, SolverError
from casadi_hands.pipeline.keeper import Keeper
from casadi_hands.pipeline.rank import rank_of
from casadi_hands.task import Task
from casadi_hands.terms.catalogue import single
from casadi_hands.terms.own import OwnTerm

Stage = Literal["floating", "synthesis", "whole_hand", "refine"]
STAGES: tuple[Stage, ...] = get_args(Stage)


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


class Record:
    """The design as it grows, with every solver run and all time spent, whichever design is returned in the end.

    Args:
        task: as solved.
        out: folder that is written on ``keep``, or what writes it; or None.
        report: told what is being done.
        own_terms: costs and constraints that a person adds to those of the stages.
        journal: where finished units of work are kept; by default none are.
        scratch: folder for temporary files; the system's by default.
    """

    def __init__(
        self,
        task: Task,
        out: Path | Keeper | None,
        report: Callable[[Progress], None],
        own_terms: tuple[OwnTerm, ...] = (),
        journal: Journal | None = None,
        scratch: Path | None = None,
    ) -> None:
        self.task, self.report, self.own_terms = task, report, own_terms
        self.keeper = out if isinstance(out, Keeper) else Keeper(out)
        self.journal, self.scratch = journal or Journal(), scratch
        self.started = time.perf_counter()
        self.design = Design(task=task, status="failed", reason="nothing has been computed yet")
        self._best: tuple[tuple[float, ...], Design] | None = None
        self._unmet: dict[str, tuple[Reason, ...]] = {}

    def placed(self, task: Task, placement: dict[str, Any], written: bool) -> Record:
        """A record of the same task with its contacts placed, which goes on with the time and the runs of this one.

        Args:
            task: with its contacts in place.
            placement: what is told of that.
            written: whether designs are written as they grow.
        """
        keeper = self.keeper if written else None
        record = Record(task, keeper, self.report, self.own_terms, self.journal, self.scratch)
        record.started = self.started
        record.update(task=task, placement=placement, stages=self.design.stages, seconds=self.design.seconds)
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

    def keep(self, design: Design, last: bool = False) -> Design:
        """Complete a design and write it, if there is a place for it and nothing better in it.

        Args:
            design: of this solve.
            last: whether no other follows.
        """
        design = self.complete(design)
        self.keeper.keep(design, last)
        return design
