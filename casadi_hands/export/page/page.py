"""``viewer.html``: one page with the moving design in it, which opens without a server and without a network."""

from __future__ import annotations

import gzip
import json
import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from casadi_hands.export.page.notice import notice
from casadi_hands.export.page.scene import Scene, draw_scene

if TYPE_CHECKING:
    from casadi_hands.problem.result import Result


_START = """
// The tree of all that is drawn, for who looks for one part.
document.getElementById("parts").append(viewer.gui.domElement);
viewer.gui.open();
controls([stage]);
"""


@dataclass(frozen=True)
class MenuEntry:
    """One line of a page's menu.

    Attributes:
        text: what it says.
        address: the page it leads to, relative to the one it is on; None for that page itself.
    """

    text: str
    address: str | None


def write_page(design: Result, path: Path, time: float | None = None, menu: Sequence[MenuEntry] = ()) -> None:
    """Write the page of a design.

    It plays when opened; ``viewer.html#t=1.5`` opens it at 1.5 s, at rest, and ``viewer.html#still&t=1.5`` without its
    controls.

    Args:
        design: whole or partial; what does not exist is not shown.
        path: the file to write.
        time: where the page rests when opened without a fragment, s; None to play.
        menu: pages of other designs to switch to; without any there is no menu.
    """
    path.write_text(page_text(design, time, menu), encoding="utf-8")


def page_text(
    design: Result, time: float | None = None, menu: Sequence[MenuEntry] = (), within: str | None = None
) -> str:
    """The page of a design, the same for the same design.

    Args:
        design: as of `write_page`.
        time: likewise.
        menu: likewise.
        within: for a page that stands in another one, which has the controls, its heading.
    """
    scene = draw_scene(design)
    parts = {
        "head": head(design.task.name),
        "heading": escape(within or design.task.name),
        "kind": "" if within is None else ' class="bare"',
        "summary": escape(_summary(design, scene)),
        "legend": "".join(
            f'<li style="--color: rgb({", ".join(str(round(255 * part)) for part in color)})">{escape(name)}</li>'
            for name, color in scene.legend
        ),
        "menu": _menu(menu),
        "design": _data(scene, time),
        "notice": notice(),
        "meshcat": files("meshcat").joinpath("viewer/dist/main.min.js").read_text(encoding="utf-8"),
        "controls": "" if within else resource("controls.html"),
        "stage": resource("stage.js"),
        "script": "" if within else f"<script>{resource('controls.js')}{_START}</script>\n",
    }
    return filled("page.html", parts)


def head(title: str, style: str = "page.css") -> str:
    """The head of a page: nothing is fetched, whoever wrote what is in it."""
    return filled("head.html", {"title": escape(title), "style": resource(style)})


def resource(name: str) -> str:
    """A file of this package, as text."""
    return files("casadi_hands.export.page").joinpath(name).read_text(encoding="utf-8")


def filled(name: str, parts: Mapping[str, str]) -> str:
    """A file of this package with ``{{part}}`` replaced by the part."""
    return re.sub(r"\{\{(\w+)\}\}", lambda slot: parts[slot[1]], resource(name))


def _summary(design: Result, scene: Scene) -> str:
    """One line: how it ended, how many joints and shared motors, what an arrow's length means, what replays said."""
    parts = [design.status]
    if design.hand is not None:
        joints, motors = design.hand.degrees_of_freedom, design.hand.motors
        shared = "" if design.hand.drive is None else f" on {motors} motor{'' if motors == 1 else 's'}"
        parts.append(f"{len(design.hand.fingers)} fingers, {joints} joints{shared}")
    if scene.longest_force > 0:
        parts.append(f"longest force arrow {scene.longest_force:.3g} N")
    if design.replays:
        parts.append(design.replay_words)
    if "why" in design.placement and design.hand is not None:
        parts.append(f"contacts placed: {design.placement['why']}")
    return " · ".join(parts)


def packed(page: str) -> str:
    """A page as another holds it: gzip in base64, the same bytes for the same page."""
    return b64encode(gzip.compress(page.encode("utf-8"), mtime=0)).decode("ascii")


def _menu(entries: Sequence[MenuEntry]) -> str:
    """Links, which need no script; the page's own entry is marked."""
    links = []
    for entry in entries:
        where = 'aria-current="page"' if entry.address is None else f'href="{escape(entry.address)}"'
        links.append(f"<a {where}>{escape(entry.text)}</a>")
    return f'<nav id="menu" aria-label="designs for this task">{"".join(links)}</nav>' if links else ""


def _data(scene: Scene, time: float | None) -> str:
    """What the page's script reads, as JSON that cannot end its script element."""
    data = {
        "commands": [b64encode(command).decode("ascii") for command in scene.commands],
        "views": [{"name": name, "eye": eye.tolist()} for name, eye in scene.views.items()],
        "radius": scene.radius,
        "hand": scene.hand,
        "ground": scene.ground,
        "layers": [layer.as_data() for layer in scene.layers],
        "span": [float(scene.time[0]), float(scene.time[-1])],
        "samples": scene.time.tolist(),
        "start": time,
        "labels": [label.as_data() for label in scene.labels],
    }
    return json.dumps(data).replace("<", "\\u003c")
