"""The command ``solve``: its options made sense of, progress, the signals that stop it, and what it says in the end."""

from __future__ import annotations

from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import typer
from rich.console import Console

from casadi_hands.cli.events import Events
from casadi_hands.cli.history import Clock, kind_of, remember, remembered
from casadi_hands.cli.interrupt import leave_on_interrupt
from casadi_hands.cli.progress import Reporter
from casadi_hands.cli.summary import alternatives_summary, design_summary, headline
from casadi_hands.errors import HandsError, words_of
from casadi_hands.task import Task
from casadi_hands.task.loader import load_questioned

if TYPE_CHECKING:
    from casadi_hands.export.design import Design
    from casadi_hands.pipeline.alternatives import Alternative

LAST_STAGE = "refine"


@dataclass(frozen=True)
class Asked:
    """The options of the command, as it names them."""

    task: Path | None
    out: Path | None
    seed: int | None
    seeds: int
    start: Path | None
    jobs: int | None
    executor: str | None
    until: str
    force: bool
    resume: Path | None
    quiet: bool = False
    as_json: bool = False


def solve_and_tell(asked: Asked) -> int:
    """Solve a task, print the result, and give the exit status.

    Raises:
        typer.BadParameter: options that do not go together.
        HandsError: what the user can put right.
    """
    try:
        return _solve_and_tell(asked)
    except HandsError as error:
        if asked.as_json:
            Events().write("error", text=words_of(error))
        raise


def _solve_and_tell(asked: Asked) -> int:
    if asked.quiet and asked.as_json:
        raise typer.BadParameter("either --quiet or --json", param_hint="--quiet")
    if asked.start is not None and (asked.seeds > 1 or asked.until != LAST_STAGE):
        raise typer.BadParameter(
            "one hand is refined, to the end: give neither --seeds nor --until", param_hint="--from"
        )
    if asked.resume is None:
        if asked.task is None:
            raise typer.BadParameter("give a task file, or --resume DIR", param_hint="TASK")
        problem, questions = load_questioned(asked.task)
        folder = asked.out or Path("results") / asked.task.stem
        first = problem.search.seed if asked.seed is None else asked.seed
        seeds = tuple(range(first, first + asked.seeds)) if asked.seeds > 1 else None
    else:
        problem, folder, seeds, asked = _as_stopped(asked, asked.resume)
        questions = []
    clock = _clock(problem, asked, seeds)
    console = Console(stderr=True, quiet=asked.quiet)
    reporter = Events(questions, clock) if asked.as_json else Reporter(console, questions, clock)
    with leave_on_interrupt(lambda: _stopped(reporter, folder, seeds is not None)), reporter:
        # Within the reporter, because CasADi and Pinocchio take seconds to load.
        design, ranked = _solved(problem, folder, seeds, asked, reporter)
        from casadi_hands.pipeline.unfinished import is_unfinished

        outdone = is_unfinished(folder)
    if clock is not None:
        remember(clock.ended())
    status = 1 if design.status == "failed" else 0
    outdone_by = (
        f"the result in {folder} is better than this one, and stays; casadi-hands solve --resume {folder} --force"
    )
    outdone_by += " puts this one there"
    if isinstance(reporter, Events):
        if outdone:
            reporter.note(outdone_by)
        reporter.result(design, folder, status)
        return status
    console = Console()
    if asked.quiet:
        console.print(headline(design, folder), soft_wrap=True)
        return status
    console.print(design_summary(design, folder))
    if ranked:
        console.print(alternatives_summary(ranked, folder))
    if outdone:
        console.print(outdone_by, soft_wrap=True, markup=False)
    return status


def _clock(problem: Task, asked: Asked, seeds: tuple[int, ...] | None) -> Clock | None:
    """What tells the time left; a solve that goes on, or runs elsewhere, is like none."""
    if asked.resume is not None or asked.executor is not None:
        return None
    many, warm = len(seeds or (0,)), asked.start is not None
    kind = kind_of(problem, version=version("casadi-hands"), until=asked.until, seeds=many, jobs=asked.jobs, warm=warm)
    return Clock(kind, remembered())


def _solved(
    problem: Task, folder: Path, seeds: tuple[int, ...] | None, asked: Asked, reporter: Reporter | Events
) -> tuple[Design, list[Alternative]]:
    """The design and, of several seeds, what each gave."""
    import casadi_hands.pipeline as pipeline
    from casadi_hands.execution.cluster import cluster
    from casadi_hands.pipeline import alternatives
    from casadi_hands.pipeline.unfinished import is_unfinished

    settings: dict[str, Any] = {"jobs": asked.jobs, "until": asked.until, "out": folder, "force": asked.force}
    settings |= {"resume": asked.resume is not None, "progress": reporter.progress}
    with ExitStack() as stack:
        settings["executor"] = stack.enter_context(cluster(asked.executor)) if asked.executor else None
        if seeds is not None:
            ranked = alternatives.explore(problem, seeds=seeds, **settings)
            return ranked[0].design, ranked
        design = pipeline.solve(problem, seed=asked.seed, start=asked.start, **settings)
        if not is_unfinished(folder):
            alternatives.remove_alternatives(folder)  # of an earlier solve; one of them may have been the start
        return design, []


def _as_stopped(asked: Asked, folder: Path) -> tuple[Task, Path, tuple[int, ...] | None, Asked]:
    """Task, folder, seeds and options of the solve that was stopped."""
    given = {"TASK": asked.task, "--out": asked.out, "--seed": asked.seed, "--from": asked.start}
    extra = [name for name, value in given.items() if value is not None]
    extra += ["--seeds"] * (asked.seeds > 1) + ["--until"] * (asked.until != LAST_STAGE)
    if extra:
        raise typer.BadParameter(
            f"the solve goes on as it was begun: leave out {', '.join(extra)}", param_hint="--resume"
        )
    from casadi_hands.pipeline.unfinished import stopped_solve

    problem, request = stopped_solve(folder)
    start = None if request.start is None else Path(request.start)
    force = asked.force or request.force
    return problem, folder, request.seeds, replace(asked, until=request.until, start=start, force=force)


def _so_far(folder: Path) -> str:
    """How good the result is that a folder has, where that can be told."""
    with suppress(Exception):  # last words are said whatever is there
        from casadi_hands.export.folder import read_design

        return f", which is {read_design(folder)['status']}"
    return ""


def _stopped(reporter: Reporter | Events, folder: Path, explores: bool) -> None:
    """Last words before the program ends at once."""
    reporter.stop()
    # Written last, so a folder that has it is complete; what an exploration finds there of its seeds is its own.
    complete, own, goes_on = (folder / "result.json").exists(), False, False
    with suppress(Exception):  # it may have been loading
        from casadi_hands.pipeline.unfinished import has_written, is_unfinished, leave_unfinished

        own = has_written(folder) or (explores and any(folder.glob("alternatives/*/result.json")))
        leave_unfinished()
        goes_on = is_unfinished(folder)
    if own:
        words = f"what was computed is in {folder}{_so_far(folder)}"
    else:
        words = f"the result in {folder} is an earlier one" if complete else "no stage was complete"
    reporter.note(
        f"stopped; {words}{f'; go on with: casadi-hands solve --resume {quote(str(folder))}' if goes_on else ''}"
    )
