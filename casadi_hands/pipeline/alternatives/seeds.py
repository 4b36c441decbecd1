"""Solve one task from several seeds."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from casadi_hands.errors import DesignError, SolveError
from casadi_hands.execution.journal import Journal
from casadi_hands.export.design import Design
from casadi_hands.export.place import owned
from casadi_hands.pipeline import STAGES, Progress, Stage, solve
from casadi_hands.pipeline.alternatives.folder import remove_alternatives, remove_surplus, seed_folder, write_ranking
from casadi_hands.pipeline.alternatives.ranking import Alternative, rank
from casadi_hands.pipeline.keeper import Keeper
from casadi_hands.pipeline.solving import solving
from casadi_hands.pipeline.unfinished import Request, is_unfinished, request_hash
from casadi_hands.task import Task
from casadi_hands.terms.own import OwnTerm


def explore(
    task: Task,
    *,
    seeds: Sequence[int],
    jobs: int | None = None,
    until: Stage = "refine",
    out: Path | str | None = None,
    executor: Executor | None = None,
    progress: Callable[[Progress], None] | None = None,
    terms: Sequence[OwnTerm] = (),
    force: bool = False,
    resume: bool = False,
) -> list[Alternative]:
    """Design hands for a task from several seeds, one after the other, and rank them.

    Seeds often find the same hand, so near-duplicates are dropped: hands with the same joints in each finger of which
    no base, no link's length and no axis differs by much (see `likeness`). At most four distinct hands are kept.

    Args:
        task: as ``load_task`` gives it.
        seeds: of the search, in place of the task's.
        jobs: processes for the trials; all cores by default. The hands do not depend on it.
        until: the last stage to run.
        out: folder; each seed is solved into ``alternatives/seedK`` in it. After each seed the best design so far is
            in ``out`` itself, the ranking in ``alternatives/ranking.json`` and a menu of the distinct hands in their
            pages. At the end the folders of hands that are not kept are removed; ``solve`` with that seed gives them
            again.
        executor: where trials run, in place of processes on this machine, as for ``solve``.
        progress: told what is being done; its times count from the start of the first seed.
        terms: costs and constraints of your own, as for ``solve``.
        force: let what is found take the place of whatever result is in ``out``.
        resume: go on from what was finished of an exploration into ``out`` that was stopped, of the same seeds.

    Returns:
        What each seed gave, best first; a seed that failed has its reason in the design.

    Raises:
        SolveError: there are no seeds, ``until`` is not a stage, the task allows no hand, or there is nothing to
            resume.
        DesignError: the folder cannot be written, is written by another process, or holds a result that is not to be
            replaced.
    """
    seeds = list(dict.fromkeys(seeds))
    if not seeds:
        raise SolveError("no seeds are given; give at least one")
    if until not in STAGES:
        raise SolveError(f"until: given {until!r}; allowed: {', '.join(STAGES)}")
    if resume and (out is None or terms):
        raise SolveError(
            "only an exploration that writes a folder (out), without terms of its own, can be resumed; leave resume out"
        )
    out = None if out is None else Path(out)
    settings = {"jobs": jobs, "until": until, "executor": executor, "terms": terms}
    explored = partial(_explored, task, seeds, settings, progress or (lambda _: None))
    if out is None:
        return explored(None, Keeper(None), Journal())
    with owned(out) as place:
        request = Request(request_hash(task), until, tuple(seeds), None, force)
        with solving(out, place, task, request, resume, keeps=not terms) as (keeper, journal, _):
            if not resume:
                remove_alternatives(out)
            ranked = explored(out, keeper, journal)
            remove_surplus(ranked, out)
    return ranked


def _explored(
    task: Task,
    seeds: Sequence[int],
    settings: dict[str, Any],
    report: Callable[[Progress], None],
    out: Path | None,
    keeper: Keeper,
    journal: Journal,
) -> list[Alternative]:
    """What each seed gave, best first, with the folders of all that there is one of."""
    began = time.perf_counter()
    designs: dict[int, Design] = {}
    errors: list[SolveError] = []
    journal.once("begun", lambda: list(seeds))  # from now on there is what to go on with
    for seed in seeds:
        folder = None if out is None else seed_folder(out, seed)
        told = _within(report, seed, time.perf_counter() - began)
        unit = journal.section(f"seed {seed}")
        if folder is not None and unit.has(0):
            designs[seed] = replace(unit.get(0), task=Design.load(folder).task)  # whose contacts may have been placed
            continue
        goes_on = folder is not None and is_unfinished(folder)
        try:
            designs[seed] = solve(task, seed=seed, out=folder, progress=told, force=True, resume=goes_on, **settings)
        except SolveError as error:
            errors.append(error)
            if len(errors) == len(seeds):
                raise  # not the seeds' fault
            designs[seed] = _broken_off(task, seed, folder, error)
        unit.put(0, replace(designs[seed], task=None))  # type: ignore[arg-type]
        if out is not None and len(designs) < len(seeds):
            write_ranking(rank(designs), out, keeper, last=False)
    ranked = rank(designs)
    if out is not None:
        write_ranking(ranked, out, keeper, last=True)
    return ranked


def _within(report: Callable[[Progress], None], seed: int, before: float) -> Callable[[Progress], None]:
    """Progress of one seed as progress of the whole.

    Args:
        report: told of the whole.
        seed: named in the text.
        before: s that seeds before this one took.
    """

    def log(news: Progress) -> None:
        report(replace(news, text=f"seed {seed}: {news.text}", elapsed=before + news.elapsed))

    return log


def _with_seed(task: Task, seed: int) -> Task:
    return task.model_copy(update={"search": task.search.model_copy(update={"seed": seed})})


def _broken_off(task: Task, seed: int, folder: Path | None, error: Exception) -> Design:
    """A failed design with what the solve had written, and why it ended."""
    design = Design(task=_with_seed(task, seed), status="failed")
    if folder is not None:
        # It may have ended before anything was written.
        with suppress(DesignError):
            design = Design.load(folder)
    design = replace(design, status="failed", reason=f"the solve broke off: {str(error) or type(error).__name__}")
    if folder is not None:
        design.save(folder)
    return design
