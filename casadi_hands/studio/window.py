"""The page in windows of all sizes: which panels are open, and from where the scene is seen."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

PHONE = 576
"""px; windows up to here have no panels at their sides, but a sheet over the lower half; so has `words.STYLE`."""
NARROW = 1200
"""px; in windows narrower than this the file's panel is folded up, to leave room for the scene."""
_SHEET = 0.5
_TRIES = 100  # to place one page's camera


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


def arrange(client: Any, panel: Any, view: View | None) -> None:
    """Arrange a page that was just opened for the size of its window.

    Args:
        client: viser's, of the page; no panel has its place yet, so that its scene is as wide as the window. A page
            that comes back after it lost its connection still has its panels, and is arranged by what these leave.
        panel: viser's, of the task's file, which is folded up where there is little room.
        view: what the camera shall see; None leaves it.
    """
    width = client.camera.image_width
    if view is not None:
        follow = _Follow(client, view, width <= PHONE)
        follow.place(client.camera)
        client.camera.on_update(follow.heed)
    main, file = client.gui.main_panel, client.gui.main_panel
    file._placement_uuid = panel._placement_uuid  # viser lets a page place none but its main panel
    main.dock_right()
    main.set_width(360)
    file.dock_left()
    file.set_width(430)
    if PHONE < width < NARROW:
        file.minimize()


class _Follow:
    """Places a page's camera anew where its scene has another size, until someone moves the camera."""

    def __init__(self, client: Any, view: View, sheet: bool) -> None:
        self._client, self._view, self._sheet = client, view, sheet
        self._known = [np.array(client.camera.position)]
        """Where the camera has been by itself, (3,) each."""
        self._left, self._moved = _TRIES, False

    async def heed(self, camera: Any) -> None:
        """Place the camera by what the page has just said; viser hears no more of it before this returns."""
        self.place(camera)

    def place(self, camera: Any) -> None:
        """Place the camera, unless it is there, or was moved."""
        size, near = (camera.image_width, camera.image_height), 1e-3 * self._view.reach
        self._moved |= all(np.linalg.norm(camera.position - each) > near for each in self._known)
        if self._moved or min(size) <= 0 or not self._left:
            return
        position, middle = placed(self._view, camera.fov, size, self._sheet)
        if max(np.linalg.norm(camera.position - position), np.linalg.norm(camera.look_at - middle)) <= near:
            return
        self._known.append(position)
        self._left -= 1
        with self._client.atomic():
            camera.position = position  # takes along where it looks
            camera.look_at = middle
