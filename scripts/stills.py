"""Pictures of a design at several moments of its motion, by its own page in a browser."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from casadi_hands.export.design import Design
from casadi_hands.export.page.film import pictures

MOMENTS = 5
"""Pictures of a motion, evenly in time, start and end among them."""
SIZE = (528, 396)
"""Width and height, pixels."""


def kept_stills(design: Design, folder: Path) -> list[tuple[float, bytes]]:
    """The pictures of a design, read from its folder if they are not older than its result.

    Args:
        design: whole or partial.
        folder: its folder; pictures are kept there as ``still0.webp`` and so on.

    Returns:
        Time (s) and WebP of every moment.

    Raises:
        HandsError: as `stills`.
    """
    times = moments(design)
    files = [folder / f"still{k}.webp" for k in range(len(times))]
    made = (folder / "result.json").stat().st_mtime
    if not all(file.is_file() and file.stat().st_mtime >= made for file in files):
        for file, picture in zip(files, stills(design, times), strict=True):
            file.write_bytes(picture)
    return [(time, file.read_bytes()) for time, file in zip(times, files, strict=True)]


def moments(design: Design) -> list[float]:
    """Times that are drawn, s; the start alone where there is no motion."""
    if design.motion is None:
        return [0.0]
    times: list[float] = np.linspace(design.motion.time[0], design.motion.time[-1], MOMENTS).tolist()
    return times


def stills(design: Design, times: list[float]) -> list[bytes]:
    """Draw a design at some times, all seen by one camera.

    Args:
        design: whole or partial; without a hand there is the bare palm, without a motion the start.
        times: s.

    Returns:
        A WebP for each time.

    Raises:
        HandsError: there is no browser, or it cannot draw; the message says which.
    """
    return pictures(design, times, SIZE, "webp")
