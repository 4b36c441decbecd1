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
            help="Write a page that shows the task: palm, object, contacts by name, goals as ghosts; as FILE.png, a "
            "picture of it.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Check a task file and print how it is understood; solves nothing. Exits 1 where no hand can do the task."""
    from casadi_hands.cli.task_summary import check_summary
    from casadi_hands.errors import HandsError
    from casadi_hands.placement.place import propose
    from casadi_hands.task.loader import load_questioned
    from casadi_hands.task.shown import escaped

    if show is not None and show.suffix.lower() not in (".html", ".htm", ".png"):
        raise HandsError(f"--show: given {escaped(str(show))}; allowed: a file that ends in .html or .png")
    loaded, questions = load_questioned(task)
    proposal = None if loaded.is_placed else propose(loaded)
    text, possible = check_summary(loaded, questions, proposal)
    Console().print(text)
    if show is not None:
        from casadi_hands.export.page.task_page import write_task_page

        sets = () if proposal is None else proposal.sets
        shown = sets[0].in_task(loaded) if sets else loaded
        words = "not solved" if possible else "not solved; check says why no hand can do this"
        others = f"; set 1 of {len(sets)} that contacts may be placed by has the large dots" if len(sets) > 1 else ""
        write_task_page(shown, show, words + others, [each.points for each in sets])
        print(show)
    raise typer.Exit(0 if possible else 1)
