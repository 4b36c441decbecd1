"""The order of the stages."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import replace
from functools import cache
from numbers import Integral
from pathlib import Path

from casadi_hands.diagnosis.impossible import findings
from casadi_hands.diagnosis.reason import format_reasons
from casadi_hands.diagnosis.shortcoming import shortcoming_reason
from casadi_hands.errors import SolveError
from casadi_hands.execution.processes import processes, start_up
from casadi_hands.export.design import Design
from casadi_hands.export.place import owned
from casadi_hands.export.record import STATUSES
from casadi_hands.nlp import SolverError
from casadi_hands.pipeline.certify import Certifier, rolls_far
from casadi_hands.pipeline.couplings import Coupler
from casadi_hands.pipeline.judge import Judge, counted
from casadi_hands.pipeline.placing import ATTEMPTS, place, placed_like, stood_like, tell_palm, unplaceable
from casadi_hands.pipeline.pruning import Pruner
from casadi_hands.pipeline.rank import rank_of
from casadi_hands.pipeline.record import STAGES, Progress, Record, Stage
from casadi_hands.pipeline.refiner import Refiner
from casadi_hands.pipeline.solving import solving
from casadi_hands.pipeline.steps import adopt, prepare_search, run_floating, run_search, run_whole_hand
from casadi_hands.pipeline.unfinished import Request, request_hash
from casadi_hands.pipeline.warm_start import as_floating, kept_margin, warm_start
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.si import build_model
from casadi_hands.stages.own_terms import try_out
from casadi_hands.stages.refine.values import Margin
from casadi_hands.stages.synthesis.algorithm import Candidate, Found
from casadi_hands.task import Task
from casadi_hands.terms.own import OwnTerm, checked
from casadi_hands.verify.replays.engine import load_mujoco

_LOG = logging.getLogger(__name__)


def solve(
    task: Task,
    *,
    seed: int | None = None,
    jobs: int | None = None,
    until: Stage = "refine",
    out: str | Path | None = None,
    start: str | Path | None = None,
    executor: Executor | None = None,
    progress: Callable[[Progress], None] | None = None,
    terms: Sequence[OwnTerm] = (),
    force: bool = False,
    resume: bool = False,
) -> Design:
    """Design a hand for a task.

    Args:
        task: as ``load_task`` gives it.
        seed: of the search, in place of the task's.
        jobs: processes for the trials; all cores by default. The design does not depend on it.
        until: the last stage to run.
        out: folder that is written after every stage, so that nothing computed is lost. A result in it makes way for a
            better one of the same task only.
        start: folder of an earlier result of nearly the same task. Its hand and motion are refined for the task as it
            is now; only where that gives no certified hand are all stages run, and the better of both is kept.
        executor: where trials run, in place of processes on this machine; the design does not depend on it. One thread
            of a process runs a trial at a time, so threads gain nothing. ``jobs`` is then for the replays only.
        progress: told what is being done.
        terms: costs and constraints of your own, ``casadi_hands.Cost`` and ``casadi_hands.Bound``. What their residuals
            raise is raised. Of such a solve nothing is kept to go on from.
        force: let the design take the place of whatever result is in ``out``, once it is there.
        resume: go on from what was finished of a solve into ``out`` that was stopped, asked for the same. The design
            is that of a solve that was not stopped.

    Returns:
        The design; its status is earned by the audit of what is written. Where a solver breaks off on the way, it is
        the best one so far, or what there is of it as failed. Where the task alone shows that no hand can do it, it is
        failed at once.

    Raises:
        SolveError: ``until`` is not a stage, or not the last where there is a start; or ``seed`` or ``jobs`` is no such
            number; or the start is of a task of another structure; or one of ``terms`` cannot be used; or there is
            nothing to resume; or processes that ran a trial were lost with it.
        DesignError: there is no result in ``start``; or ``out`` cannot be written, is written by another process, or
            holds a result that is certified, or of another task, and is not to be replaced.
        HandsError: MuJoCo, which designs are replayed in, cannot be loaded.
    """
    out, start = None if out is None else Path(out), None if start is None else Path(start)
    if until not in STAGES:
        raise SolveError(f"until: given {until!r}; allowed: {', '.join(STAGES)}")
    if start is not None and until != STAGES[-1]:
        raise SolveError(f"until: given {until!r}; allowed with an earlier result: {STAGES[-1]}, all that is run")
    if resume and (out is None or terms):
        raise SolveError(
            "only a solve that writes a folder (out), without terms of its own, can be resumed; leave resume out"
        )
    for name, value, least in (("seed", seed, 0), ("jobs", jobs, 1)):
        if value is not None and not (isinstance(value, Integral) and value >= least):
            raise SolveError(f"{name}: given {value!r}; allowed: an integer of at least {least}")
    if seed is not None:
        task = task.model_copy(update={"search": task.search.model_copy(update={"seed": int(seed)})})
    own_terms = checked(terms)
    if start is not None and task.palm.placed:
        task = stood_like(task, Design.load(start).task)
    if start is not None and not task.is_placed:
        task = placed_like(task, Design.load(start).task)
        if not task.is_placed:
            raise SolveError(
                f"{start}: the earlier result has no contacts that were placed for what this task asks of its fingers; "
                "solving without --from works"
            )
    jobs, report = jobs or os.cpu_count() or 1, progress or (lambda _: None)
    with nullcontext() if out is None else owned(out) as place:
        if out is None or place is None:
            return _solve(Record(task, None, report, own_terms), until, start, executor, jobs)
        request = Request(request_hash(task), until, None, None if start is None else str(start), force)
        with solving(out, place, task, request, resume, keeps=not own_terms) as (keeper, journal, scratch):
            record = Record(task, keeper, report, own_terms, journal, scratch)
            return _solve(record, until, start, executor, jobs)


def _solve(record: Record, until: str, start: Path | None, executor: Executor | None, jobs: int) -> Design:
    """The design, written if there is a place for it."""
    if until in STAGES[2:]:
        load_mujoco()  # before hours of work, not after them
    with processes(jobs) if executor is None else nullcontext(executor) as workers:
        tell_palm(record)
        if not record.task.is_placed:
            return _design_placed(record, until, workers, jobs)
        return record.keep(_design(record, until, workers, jobs, start), last=True)


def _design(record: Record, until: str, workers: Executor | None, jobs: int, start: Path | None = None) -> Design:
    """The design of a task whose contacts have their places."""
    model = _model(record)
    try_out(model, record.task.search.max_joints)
    impossible, doubts = _checked(record, model)
    if impossible is not None:
        return impossible
    try:
        design = None if start is None else _refine_again(record, model, start)
        design = counted(design or _run(record, until, workers, jobs))
    except SolverError as error:
        _LOG.debug("the solve broke off", exc_info=True)
        design = counted(record.broken_off(error))
    if not doubts or until != STAGES[-1] or design.status == "certified":
        return design
    return replace(design, reason=f"{design.reason}. The task alone says that {doubts}")


def _checked(record: Record, model: Model) -> tuple[Design | None, str]:
    """What the task alone shows: the failed design where no hand can do it, and what else speaks against it."""
    seen = findings(record.task, model)
    if never := [each.reason for each in seen if each.certain]:
        return replace(record.design, reason=format_reasons(never)), ""
    doubts = format_reasons(each.reason for each in seen)
    if doubts:
        record.log("check", doubts)
    return None, doubts


def _design_placed(record: Record, until: str, workers: Executor | None, jobs: int) -> Design:
    """Place contacts, then design; where that gives no certified hand, with the next best contacts, too."""
    impossible, _ = _checked(record, _model(record))
    if impossible is not None:
        return record.keep(impossible, last=True)
    if workers is not None:
        start_up(workers, jobs)
    tasks, told = place(record.task, record, workers)
    if not tasks:
        return record.keep(unplaceable(record, told), last=True)
    own, best = record, None
    for number, task in enumerate(tasks[: ATTEMPTS if until == STAGES[-1] else 1]):
        # The first is written as it grows; what a second leaves half done shall not replace it.
        own = own.placed(task, {**record.design.placement, **told, "chosen": number}, written=number == 0)
        design = _design(own, until, workers, jobs)
        best = design if best is None else min(best, design, key=_rank)
        if best.status == "certified":
            break
    assert best is not None
    best = own.complete(best)
    record.keeper.keep(best, last=True)
    return best


def _rank(design: Design) -> tuple[float, ...]:
    """Best first."""
    return STATUSES.index(design.status), *rank_of(design)


def _refine_again(record: Record, model: Model, start: Path) -> Design | None:
    """The hand and the motion of an earlier result, refined for the task as it is now; None if another is needed.

    Motors that share joints are looked for anew, from a motor for every joint.
    """

    def begin() -> tuple[WholeHand, Margin | None]:
        earlier = Design.load(start)
        return warm_start(earlier, record.task, model), kept_margin(earlier)

    whole, margin = record.journal.once("start", begin)
    adopt(record, model, whole)
    judge = Judge(model, as_floating(model, whole), record.scratch)
    try:
        # Replays of one hand take about as long as other processes take to start.
        design, _ = Refiner(record, model, judge, jobs=1).certify(whole, (), margin, near=True)
        record.update(stages=[{**run, "started_from": str(start)} for run in record.design.stages])
        record.update_best(design)
        if design.status == "certified":
            design = Coupler(record, model, judge, 1).run(design)
    except SolverError as error:
        design = record.broken_off(error)
    if design.status == "certified":
        return design
    record.log("refine", f"from the earlier result no hand is certified: {design.reason}; now all stages")
    record.update(hand=None, motion=None, costs={})
    return None


def _model(record: Record) -> Model:
    """The task in the stages' numbers, with the person's own terms."""
    # A person's own terms may ask for the time.
    return replace(build_model(record.task, whole=bool(record.own_terms)), own_terms=record.own_terms)


def _run(record: Record, until: str, executor: Executor | None, jobs: int) -> Design:
    """All stages, to the last one asked for."""
    if executor is not None and until != "floating":
        start_up(executor, jobs)
    model = _model(record)
    floating = run_floating(record, model)
    model = floating.model
    if until == "floating":
        return _stopped(record, until)
    # Over a long way bends lead astray: straight links are tried first there, which have fewer ways to fold.
    first, *others = (replace(model, bend=0.0), model) if model.bend and rolls_far(model) else (model,)
    search = prepare_search(record, first, floating, executor)
    found = run_search(record, first, search)
    if until == "synthesis":
        return _stopped(record, until)
    judge = Judge(model, floating, record.scratch)
    if until == "whole_hand":
        run_whole_hand(record, first, floating, found.candidates[0])
        design = judge.judge(record.design, [shortcoming_reason(model, short) for short in found.short])
        judged = record.held_to_bounds(design)
        return judge.replayed(judged, jobs) if judged.status == "certified" else judged
    certifier = Certifier(record, first, floating, search, judge, jobs)
    design = _certified(certifier, found)
    for links in others:
        if design.status != "certified":
            search = prepare_search(record, links, floating, executor)
            found = run_search(record, links, search)
            certifier = Certifier(record, links, floating, search, judge, jobs)
            design = _certified(certifier, found)
    return Coupler(record, model, judge, jobs, certifier).run(judge.concluded(design, jobs))


def _certified(certifier: Certifier, found: Found) -> Design:
    """The best design of the hands of a search, with as few joints as move and, each with a motor, as are needed.

    Where motors are shared, it is these that are to be few; where contacts must go far with the object, fingers need
    their joints.
    """
    design = certifier.run(found)
    spare = certifier.record.task.motors == "independent" and not rolls_far(certifier.model)
    margin = cache(lambda: kept_margin(design))  # only where another hand is tried

    def certify(candidate: Candidate) -> Design:
        return certifier.certify(candidate, margin=margin(), thorough=False)[0]

    return Pruner(certifier.record, certifier.search, certify, spare, certifier.failed).run(design)


def _stopped(record: Record, stage: str) -> Design:
    """What there is after a stage; failed where that misses bounds of a person's own."""
    stopped = replace(record.design, status="feasible", reason=f"stopped after the stage {stage}, as asked")
    held = record.held_to_bounds(stopped)
    return held if held is stopped else replace(held, status="failed")
