"""Pictures of a design, and a GIF of its motion, drawn by its own page in a browser without a screen."""

from __future__ import annotations

import json
import re
from base64 import b64decode
from importlib import import_module
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from casadi_hands.errors import HandsError
from casadi_hands.export.browser import content
from casadi_hands.export.page.page import page_text

if TYPE_CHECKING:
    from casadi_hands.problem.result import Result

PICTURE_SIZE = (1280, 960)
"""Width and height, pixels."""
GIF_SIZE = (640, 480)
FRAME = 0.08
"""s between frames of a GIF, whose clock counts hundredths."""
_AT_ONCE = 40  # frames that the browser draws before it answers
_LAST = 1.0  # s that the last frame stays
_BEGINNINGS = {"png": b"\x89PNG", "webp": b"RIFF"}
# Draws each moment as the page's own fragment shows it, and leaves the pictures where they can be read.
_DRAW = """
<script>
viewer.renderer.setPixelRatio(1);
viewer.renderer.setSize(WIDTH, HEIGHT);
viewer.camera.aspect = WIDTH / HEIGHT;
viewer.camera.updateProjectionMatrix();
const stills = TIMES.map((time) => {
  location.hash = `still&t=${time}`;
  if (window.onhashchange) window.onhashchange();
  viewer.render();
  return viewer.renderer.domElement.toDataURL("image/FORM", 0.9);
});
document.body.replaceChildren(Object.assign(document.createElement("pre"), {textContent: JSON.stringify(stills)}));
</script>
</body>"""


def pictures(design: Result, times: list[float], size: tuple[int, int], form: str = "png") -> list[bytes]:
    """Draw a design at some times, all seen by one camera.

    Args:
        design: whole or partial; without a hand there is the bare palm, without a motion the start.
        times: s.
        size: width and height, pixels.
        form: png or webp.

    Returns:
        A file's bytes for each time.

    Raises:
        HandsError: there is no browser, or it cannot draw; the message says which.
    """
    given = {"TIMES": json.dumps(times), "WIDTH": str(size[0]), "HEIGHT": str(size[1]), "FORM": form}
    draw = re.sub("|".join(given), lambda slot: given[slot[0]], _DRAW)
    before, _, after = page_text(design, times[0]).rpartition("</body>")
    with TemporaryDirectory() as place:
        page = Path(place) / "stills.html"
        page.write_text(before + draw + after, encoding="utf-8")
        drawn = re.search(r"<pre>(.*?)</pre>", content(page), re.DOTALL)
    found = [b64decode(each.partition("base64,")[2]) for each in json.loads(drawn[1])] if drawn else []
    if len(found) != len(times) or not all(picture.startswith(_BEGINNINGS[form]) for picture in found):
        raise HandsError("the browser drew no pictures of the page; try one with WebGL, which chrome://gpu tells of")
    return found


def write_png(design: Result, file: Path, at: float | None = None) -> None:
    """Write a picture of a design.

    Args:
        design: whole or partial.
        file: to write.
        at: time of the motion, s; its start if not given.

    Raises:
        HandsError: there is no browser, it cannot draw, the motion is not at that time, or the file cannot be written.
    """
    begin, end = _span(design)
    time = begin if at is None else at
    if not begin <= time <= end:
        raise HandsError(f"no picture at {time:g} s; allowed: {begin:g} to {end:g} s, the motion's start and end")
    _write(file, pictures(design, [time], PICTURE_SIZE)[0])


def write_gif(design: Result, file: Path) -> None:
    """Write a design's motion as a GIF that repeats, a frame each 80 ms.

    Args:
        design: with a motion.
        file: to write.

    Raises:
        HandsError: there is no browser, it cannot draw, there is no motion, Pillow is not installed, or the file cannot
            be written.
    """
    if design.motion is None:
        raise HandsError("there is no motion to make a GIF of; --png draws the start")
    pillow, (begin, end) = _pillow(), _span(design)
    times = [*np.arange(begin, end - FRAME / 2, FRAME).tolist(), end]
    frames = [
        pillow.open(BytesIO(picture)).convert("RGB")
        for first in range(0, len(times), _AT_ONCE)
        for picture in pictures(design, times[first : first + _AT_ONCE], GIF_SIZE)
    ]
    shown = [round(1e3 * FRAME)] * (len(frames) - 1) + [round(1e3 * _LAST)]
    made = BytesIO()
    frames[0].save(made, "GIF", save_all=True, append_images=frames[1:], duration=shown, loop=0)
    _write(file, made.getvalue())


def _span(design: Result) -> tuple[float, float]:
    """Start and end of the motion, s; both 0 without one."""
    return (0.0, 0.0) if design.motion is None else (float(design.motion.time[0]), float(design.motion.time[-1]))


def _pillow() -> Any:
    try:
        return import_module("PIL.Image")
    except ImportError:
        raise HandsError("a GIF needs Pillow: pip install 'casadi-hands[video]'; --png works without") from None


def _write(file: Path, data: bytes) -> None:
    try:
        file.write_bytes(data)
    except OSError as error:
        raise HandsError(f"{file}: cannot be written: {error.strerror}; give a file in another folder") from None
