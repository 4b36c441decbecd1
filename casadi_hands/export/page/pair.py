"""Two designs side by side on one page, with one clock, one camera and one scale."""

from __future__ import annotations

import json
from html import escape
from typing import TYPE_CHECKING

from casadi_hands.export.page.page import filled, head, packed, page_text, resource

if TYPE_CHECKING:
    from casadi_hands.problem.result import Result


def pair_text(one: Result, other: Result, names: tuple[str, str]) -> str:
    """The page of two designs, which opens without a server and without a network.

    Args:
        one: whole or partial.
        other: likewise.
        names: what tells them apart, of their folders, say.
    """
    titles = [
        name if name == design.task.name else f"{design.task.name} ({name})"
        for design, name in zip((one, other), names, strict=True)
    ]
    scenes = [packed(page_text(design, within=title)) for design, title in zip((one, other), titles, strict=True)]
    parts = {
        "head": head(" and ".join(titles)),
        "frames": "".join(f'<iframe title="{escape(title)}"></iframe>' for title in titles),
        "controls": resource("controls.html"),
        "scenes": json.dumps(scenes),
        "script": resource("controls.js"),
    }
    return filled("pair.html", parts)
