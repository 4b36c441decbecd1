"""The command `check`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from casadi_hands.cli.options import TaskFile


def check(
    task: TaskFile,
    show: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.html",
            help="Write a page that shows the task: palm, object, contacts by name, goals as ghosts.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Check a task file and print how it is understood; solves nothing. Exits 1 where no hand can do the task."""
    from casadi_hands.cli.task_summary import check_summary
    from casadi_hands.task.loader import load_questioned

    loaded, questions = load_questioned(task)
    text, possible = check_summary(loaded, questions)
    Console().print(text)
    if show is not None:
        from casadi_hands.export.page.task_page import write_task_page

        write_task_page(loaded, show, "not solved" if possible else "not solved; check says why no hand can do this")
        print(show)
    raise typer.Exit(0 if possible else 1)
