"""``casadi-hands view``: a design's page, two designs side by side, a picture or a GIF."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from casadi_hands.cli.options import Folder


def view(
    folder: Folder,
    other: Annotated[
        Path | None,
        typer.Argument(metavar="[OTHER]", help="Another result folder, to be seen beside it.", show_default=False),
    ] = None,
    png: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Write a picture instead.", show_default=False)
    ] = None,
    at: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="Time of the picture.", show_default="the start")
    ] = None,
    gif: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.gif",
            help="Write the motion as a GIF instead. Needs Pillow: pip install 'casadi-hands\\[video]'",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE.html", help="Where to write the page of two.", show_default="DIR/viewer-pair.html"),
    ] = None,
) -> None:
    """Open a design's page in the browser, made anew where it is not what the folder's other files give.

    With OTHER it is a page of both, side by side with one clock, camera and scale. Pictures and GIFs are drawn by
    Chromium without a screen.
    """
    from casadi_hands.errors import HandsError

    if png is not None or gif is not None:
        if other is not None:
            raise HandsError("--png and --gif draw one design, and two folders are given; give one, then the other")
        _draw(folder, png, at, gif)
        return
    if at is not None:
        raise HandsError("--at is for --png; open a page at a time by its address: viewer.html#t=1.5")
    if out is not None and other is None:
        raise HandsError("--out is for the page of two folders; leave it out for that of one, viewer.html in it")
    from casadi_hands.export.page.own_page import open_page, open_pair

    print(open_page(folder) if other is None else open_pair(folder, other, out))


def _draw(folder: Path, png: Path | None, at: float | None, gif: Path | None) -> None:
    from casadi_hands.export.design import Design
    from casadi_hands.export.page.film import write_gif, write_png

    design = Design.load(folder)
    if png is not None:
        write_png(design, png, at)
        print(png)
    if gif is not None:
        write_gif(design, gif)
        print(gif)
