"""The command `studio`."""

from __future__ import annotations

import sys
import webbrowser
from pathlib import Path
from threading import Event
from typing import Annotated

import typer

SOLVE = (sys.executable, "-c", "from casadi_hands.cli import main; main()", "solve", "--force")
"""The page asks for it: what is in its folder makes way, once there is another."""


def studio(
    task: Annotated[
        Path, typer.Argument(metavar="[TASK]", help="A task file; one that is not there begins as a new task.")
    ] = Path("task.yaml"),
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the hand; files of an earlier design in it are replaced.", show_default="results/TASK"
        ),
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port on this machine; 0 for any that is free.", show_default="any")
    ] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
) -> None:
    r"""Make a task, see it, solve it and see the hand, on a page of this machine; ends with Ctrl-C.

    Needs viser: pip install 'casadi-hands\[studio]'
    """
    from casadi_hands.studio.access import open_server
    from casadi_hands.studio.session import Session
    from casadi_hands.studio.studio import Studio

    session = Session(task)
    server, address = open_server(port, session.path.name)
    page = Studio(server, session, SOLVE, out or Path("results") / task.stem)
    print(
        f"{address}\nThe page is for whoever has this address, on this machine only. Ctrl-C ends the studio.",
        flush=True,
    )
    if browser:
        webbrowser.open(address)
    try:
        Event().wait()
    except KeyboardInterrupt:
        print("ending")
    finally:
        page.close()
        server.stop()
