"""What things are called in the page's tree of parts."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from casadi_hands.export.page.robot import Shape

_LINK = re.compile(r"finger(\d+)_link(\d+)")


def node_name(words: str) -> str:
    """Words as a name in meshcat's tree, where a slash would begin another level."""
    return words.replace("/", "\u2215")


def link_name(link: str, fingers: Sequence[str]) -> str:
    """What a link of the exported hand is called, ``index link 1`` say.

    Args:
        link: its name in the URDF.
        fingers: names of the fingers in order.
    """
    found = _LINK.fullmatch(link)
    return f"{node_name(fingers[int(found[1])])} link {int(found[2]) + 1}" if found else link


def named(shapes: Iterable[Shape]) -> Iterator[tuple[str, Shape]]:
    """Shapes with their kinds and numbers, counted on each link: ``box 1``, ``box 2``, ``sphere 1``."""
    count: Counter[tuple[str, str]] = Counter()
    for shape in shapes:
        count[shape.link, shape.kind] += 1
        yield f"{shape.kind} {count[shape.link, shape.kind]}", shape
