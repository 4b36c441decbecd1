"""A folder while it is solved into: a result stays until there is a better one, finished work is kept beside it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from casadi_hands.execution.journal import Journal
from casadi_hands.pipeline.keeper import Keeper, rival_in
from casadi_hands.pipeline.unfinished import Request, Unfinished
from casadi_hands.task import Task


@contextmanager
def solving(
    out: Path, place: Path, task: Task, request: Request, resume: bool, keeps: bool = True
) -> Iterator[tuple[Keeper, Journal, Path]]:
    """Where a solve's designs, its finished units and its temporary files go.

    What was finished stays where it ends with an error, or with a design that is worse than the one that stands there:
    ``resume`` goes on from it.

    Args:
        out: the folder, which is owned.
        place: beside it.
        task: as solved.
        request: what is asked for.
        resume: whether to go on from what was finished of the same request.
        keeps: whether finished units are kept.

    Raises:
        DesignError: the result that stands there is not to be replaced.
        SolveError: there is nothing to resume, or what is kept cannot be written.
    """
    unfinished = Unfinished(place)
    if resume:
        journal = unfinished.go_on(request)
        own = unfinished.has_written
        keeper = Keeper(out, rival_in(out, task, request.force or own), request.force or own, unfinished.wrote)
    else:
        rival = rival_in(out, task, request.force)
        journal = unfinished.begin(task, request)
        keeper = Keeper(out, rival, request.force, unfinished.wrote)
    try:
        yield keeper, journal if keeps else Journal(), unfinished.scratch
        if not keeper.outdone:
            unfinished.end()
    finally:
        unfinished.leave()
