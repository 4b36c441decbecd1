"""The order of the stages."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path

from casadi_hands.design import Design
from casadi_hands.errors import SolveError
from casadi_hands.pipeline.certify import Certifier
from casadi_hands.pipeline.judge import Judge
from casadi_hands.pipeline.record import STAGES, Progress, Record
from casadi_hands.pipeline.steps import prepare_search, run_floating, run_search, run_whole_hand
from casadi_hands.search.work import processes
from casadi_hands.stages.model import build_model
from casadi_hands.task import Task


def solve(
    task: Task,
    *,
    seed: int | None = None,
    jobs: int | None = None,
    until: str = "refine",
    out: Path | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Design:
    """Design a hand for a task.

    Args:
        task: as ``load_task`` gives it.
        seed: of the search, in place of the task's.
        jobs: processes for the trials; all cores by default. The design does not depend on it.
        until: the last stage to run.
        out: folder that is written after every stage, so that nothing computed is lost.
        progress: told what is being done.

    Returns:
        The design; its status is earned by the audit of what is written.

    Raises:
        SolveError: ``until`` is not a stage.
    """
    if until not in STAGES:
        raise SolveError(f"until: given {until!r}; allowed: {', '.join(STAGES)}")
    if seed is not None:
        task = task.model_copy(update={"search": task.search.model_copy(update={"seed": seed})})
    jobs = jobs or os.cpu_count() or 1
    record = Record(task, out, progress or (lambda _: None))
    with processes(jobs) as executor:
        return record.keep(_run(record, until, executor, jobs))


def _run(record: Record, until: str, executor: Executor | None, jobs: int) -> Design:
    """All stages, to the last one asked for."""
    model = build_model(record.task)
    floating = run_floating(record, model)
    model = floating.model
    if until == "floating":
        return _stopped(record.design, until)
    search = prepare_search(record, model, floating, executor)
    found = run_search(record, model, search)
    if until == "synthesis":
        return _stopped(record.design, until)
    judge = Judge(model, floating)
    if until == "whole_hand":
        run_whole_hand(record, model, floating, found.candidates[0])
        return judge.judge(record.design, found.short)
    return Certifier(record, model, floating, search, judge, jobs).run(found)


def _stopped(design: Design, stage: str) -> Design:
    return replace(design, status="feasible", reason=f"stopped after the stage {stage}, as asked")
