"""The nonlinear program that a stage poses for a task, to look at and to take away."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from casadi import Function

from casadi_hands.errors import SolveError
from casadi_hands.execution.processes import processes, start_up
from casadi_hands.nlp.failure import SolverError
from casadi_hands.nlp.program import Program
from casadi_hands.nlp.program_folder import save_program
from casadi_hands.nlp.solver import Solve, keep_solves
from casadi_hands.pipeline.certify import refinable
from casadi_hands.pipeline.margins import margins_for
from casadi_hands.pipeline.placing import place
from casadi_hands.pipeline.record import STAGES, Progress, Record, Stage
from casadi_hands.pipeline.steps import prepare_search, run_floating, run_search, run_whole_hand
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.si import build_model
from casadi_hands.stages.quantities import quantities
from casadi_hands.stages.refine.continuation import Continuation
from casadi_hands.stages.synthesis.algorithm import Search
from casadi_hands.stages.synthesis.trials import combine_fingers
from casadi_hands.task import Task

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Formulation:
    """A program of one stage, as the stage handed it to IPOPT.

    Attributes:
        task: the task's name.
        stage: one of ``STAGES``.
        seed: of the search.
        step: which of the stage's solves it is.
        model: what its units and contacts are.
        solve: the program, IPOPT's options, and what the stage got with them.
    """

    task: str
    stage: str
    seed: int
    step: str
    model: Model
    solve: Solve

    @property
    def program(self) -> Program:
        """The functions, the arrays, and the problem that has their names."""
        return self.solve.program

    @property
    def functions(self) -> dict[str, Function]:
        """CasADi's functions by name, without machine code; see ``Program.functions``."""
        return self.program.functions

    def save(self, folder: Path | str) -> Path:
        """Write a folder that CasADi and NumPy can read without this package.

        Args:
            folder: made if it does not exist; files of an earlier program in it are replaced.

        Returns:
            The page in it.

        Raises:
            SolveError: the folder cannot be written.
        """
        problem, folder = self.program.problem, Path(folder)
        names = [*problem.variables.names(), *problem.parameters.names()]
        title = f"{self.task}: {self.stage.replace('_', ' ')}, {self.step}"
        known = quantities(names, self.model.contact_names)
        try:
            save_program(self.program, folder, title, self._facts(), known)
        except OSError as error:
            raise SolveError(f"{folder}: cannot write the program here: {error}; give another --out") from error
        return folder / "index.html"

    def _facts(self) -> dict[str, Any]:
        units, solution = self.model.units, self.solve.solution
        found = {"objective": solution.objective, "violation": solution.violation}
        return {
            "task": self.task,
            "stage": self.stage,
            "step": self.step,
            "seed": self.seed,
            "units_in_si": {"length": units.length, "force": units.force, "torque": units.torque, "time": 1.0},
            "ipopt": self.solve.options.ipopt(),
            "found_by_the_stage": {
                **{name: value if np.isfinite(value) else None for name, value in found.items()},
                "status": solution.status,
                "iterations": solution.iterations,
            },
        }


def formulate(
    task: Task,
    stage: Stage = "refine",
    seed: int | None = None,
    *,
    jobs: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Formulation:
    """The program that a stage poses for a task, with the start and all numbers of one of its solves.

    The stages before are run as ``solve`` runs them; then the stage itself, as far as to this solve, so that what it
    got is known, too. The solve is

    - of ``floating`` the first one, with free contact invariants;
    - of ``synthesis`` that of the best fingers together, in its last annealing step;
    - of ``whole_hand`` the first one, of the best hand;
    - of ``refine`` the last step of the first refinement of the best hand, on the fewest knots that motions are
      refined on first (0.4 s apart at most, or the task's own samples): the one with hard constraints, or where
      penalties show that contacts must slip, and the stage goes no further, the last of these. What moves contacts
      too far for fingers to follow is refined at a smaller homotopy parameter first, and then that is the program.

    Args:
        task: as ``load_task`` gives it.
        stage: one of ``floating``, ``synthesis``, ``whole_hand``, ``refine``.
        seed: of the search, in place of the task's.
        jobs: processes for the trials; all cores by default. The program does not depend on it.
        executor: where trials run, in place of processes on this machine.
        progress: told what is being done.

    Raises:
        SolveError: there is no such stage, or a solver broke off before its solve.
    """
    if stage not in STAGES:
        raise SolveError(f"stage: given {stage!r}; allowed: {', '.join(STAGES)}")
    if seed is not None:
        task = task.model_copy(update={"search": task.search.model_copy(update={"seed": seed})})
    jobs = 1 if stage == STAGES[0] else jobs or os.cpu_count() or 1
    record = Record(task, None, progress or (lambda _: None))
    with processes(jobs) if executor is None else nullcontext(executor) as workers:
        if workers is not None and stage != STAGES[0]:
            start_up(workers, jobs)
        if not task.is_placed:
            tasks, told = place(task, record, workers)
            if not tasks:
                raise SolveError(told["why"])
            task = tasks[0]
            record = record.placed(task, told, written=False)
        try:
            model, step, solve = _posed(record, stage, workers)
        except SolverError as error:
            _LOG.debug("the stages broke off", exc_info=True)
            raise SolveError(
                f"a solver broke off before the stage {stage} posed its program: {error}; try another seed"
            ) from error
    return Formulation(task.name, stage, task.search.seed, step, model, solve)


def _posed(record: Record, stage: str, executor: Executor | None) -> tuple[Model, str, Solve]:
    """The model of a stage's program, which of its solves it is of, and that solve."""
    with keep_solves() as solves:
        floating = run_floating(record, build_model(record.task))
    model, homotopy = floating.model, 1.0
    if stage == "floating":
        return model, floating.runs[0][0], solves[0]
    search = prepare_search(record, model, floating, executor)
    found = run_search(record, model, search)
    if stage == "synthesis":
        return model, *_together(search)
    begun = model
    if stage == "refine":
        begun, floating, homotopy = refinable(record, model, floating)
    with keep_solves() as solves:
        whole = run_whole_hand(record, begun, floating, found.candidates[0])
    if stage == "whole_hand":
        return model, "hand", solves[0]
    return _refined(record, model, whole, homotopy)


def _refined(record: Record, model: Model, whole: WholeHand, homotopy: float) -> tuple[Model, str, Solve]:
    """The first refinement of a hand: its last step."""
    continuation = Continuation(model, whole.contacts, tuple(f.joints for f in whole.fingers), whole.active)
    with record.stage("refine", "the first refinement"), keep_solves() as solves:
        runs = continuation.begin(whole, margins_for(model, whole).ample, homotopy).runs
    # Hard constraints, which are the last step, may be followed by solves that look for the nearest exact motion.
    knots = len(continuation.sparse.model.schedule.samples)
    step = f"{runs[-1].what} on {knots} knots" + (f" at homotopy {homotopy:.2g}" if homotopy < 1 else "")
    return continuation.sparse.model, step, solves[len(runs) - 1]


def _together(search: Search) -> tuple[str, Solve]:
    """The best fingers that were found alone, annealed together: the last step."""
    fingers = tuple(search.pools[c][0][1] for c in search.contacts)
    with keep_solves() as solves:
        hand = combine_fingers(search.target, search.contacts, fingers, search.weights)
    return hand.runs[-1][0], solves[-1]
