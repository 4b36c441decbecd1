"""Sets of contacts that the program found beside the one that is drawn: small dots on the object."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from meshcat.geometry import MeshLambertMaterial, Sphere

from casadi_hands.export.page.names import node_name
from casadi_hands.export.page.shapes import Color, paint, shift
from casadi_hands.export.page.unsolved import Label, steps

_SIZE = 0.012  # of the page's scene
COLORS: tuple[Color, ...] = ((0.45, 0.45, 0.45), (0.55, 0.48, 0.35), (0.38, 0.48, 0.55))


def draw_candidates(node: Any, placement: Mapping[str, Any], radius: float) -> Iterator[Label]:
    """Draw the contacts of all sets but the chosen one, and name them by finger and set.

    Args:
        node: of the object's contacts.
        placement: as in ``placement.json``.
        radius: of the scene, m.
    """
    for number, points in _others(placement):
        color = COLORS[number % len(COLORS)]
        for name, point in points.items():
            dot = node[node_name(f"{name}, set {number}")]
            dot.set_object(Sphere(_SIZE * radius), MeshLambertMaterial(color=paint(color)))
            dot.set_transform(shift(point))
            yield Label(steps(dot), f"{name} ({number})", color)


def _others(placement: Mapping[str, Any]) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
    """The sets that were not chosen by their number, from 1, with their contacts (3,), as far as they are told."""
    sets = placement.get("sets")
    for k, each in enumerate(sets if isinstance(sets, list) else ()):
        points = each.get("points") if isinstance(each, Mapping) else None
        if k != placement.get("chosen", 0) and isinstance(points, Mapping):
            yield k + 1, {str(name): np.array(point, float) for name, point in points.items() if _is_point(point)}


def _is_point(value: Any) -> bool:
    return isinstance(value, list | tuple) and len(value) == 3 and all(isinstance(x, float | int) for x in value)
