"""The page in windows of all sizes: which panels are open, and from where the scene is seen."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

PHONE = 576
"""px; windows up to here have no panels at their sides, but a sheet over the lower half; so has `words.STYLE`."""
NARROW = 1200
"""px; in windows narrower than this the file's panel is folded up, to leave room for the scene."""
_SHEET = 0.5
_SETTLES = 5.0  # s in which panels find their places


@dataclass(frozen=True)
class View:
    """What the camera shall see.

    Attributes:
        middle: (3,) in the world, m.
        towards: (3,) unit vector from there to the camera, in the world.
        reach: from the middle to what is farthest of it, m.
    """

    middle: np.ndarray
    towards: np.ndarray
    reach: float


def placed(view: View, fov: float, size: tuple[int, int], sheet: bool) -> tuple[np.ndarray, np.ndarray]:
    """Where the camera is and looks, (3,) each, m, so that a ball of the reach is in the part that no sheet covers.

    Args:
        view: what is seen.
        fov: vertical field of view, rad.
        size: width and height of the scene, px.
        sheet: whether a sheet covers its lower half.
    """
    slope, free = math.tan(fov / 2), 1 - _SHEET if sheet else 1.0
    distance = max(2.0, 1.15 / slope / min(free, size[0] / size[1])) * view.reach
    right = np.cross([0.0, 0.0, 1.0], view.towards)
    up = np.cross(view.towards, right / np.linalg.norm(right))
    middle = view.middle - (1 - free) * distance * slope * up
    return middle + distance * view.towards, middle


def fit(client: Any, panel: Any, view: View | None) -> None:
    """Arrange a page that was just opened for the size of its window.

    Args:
        client: viser's, of the page; its scene is as large as the window, until its panels have their places.
        panel: viser's, that is folded up where there is little room.
        view: what the camera shall see; None leaves it.
    """
    width, size = client.camera.image_width, (0, 0)
    if PHONE < width < NARROW:
        _fold(client, panel)
    end = time.monotonic() + _SETTLES
    while view is not None and time.monotonic() < end:
        now = (client.camera.image_width, client.camera.image_height)
        if now != size and min(now) > 0:
            size = now
            position, middle = placed(view, client.camera.fov, size, width <= PHONE)
            with client.atomic():
                client.camera.position = position  # takes along where it looks
                client.camera.look_at = middle
        time.sleep(0.1)


def _fold(client: Any, panel: Any) -> None:
    """Fold up a panel of all pages on this one; viser lets a page place none but the main panel."""
    handle = client.gui.main_panel
    handle._placement_uuid = panel._placement_uuid
    handle.minimize()
