"""Pictures of a design at several moments of its motion, by its own page in a browser."""

from __future__ import annotations

import json
import re
from base64 import b64decode
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from browser import content

from casadi_hands.errors import HandsError
from casadi_hands.export.design import Design
from casadi_hands.export.page.page import page_text

MOMENTS = 5
"""Pictures of a motion, evenly in time, start and end among them."""
SIZE = (528, 396)
"""Width and height, pixels."""
_START = b"RIFF"
# Draws each moment as the page's own fragment shows it, and leaves the pictures where they can be read.
_DRAW = """
<script>
viewer.renderer.setPixelRatio(1);
viewer.renderer.setSize(WIDTH, HEIGHT);
viewer.camera.aspect = WIDTH / HEIGHT;
viewer.camera.updateProjectionMatrix();
const stills = TIMES.map((time) => {
  location.hash = `t=${time}`;
  if (window.onhashchange) window.onhashchange();
  viewer.render();
  return viewer.renderer.domElement.toDataURL("image/webp", 0.9);
});
document.body.replaceChildren(Object.assign(document.createElement("pre"), {textContent: JSON.stringify(stills)}));
</script>
</body>"""


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
    draw = _DRAW.replace("TIMES", json.dumps(times)).replace("WIDTH", str(SIZE[0])).replace("HEIGHT", str(SIZE[1]))
    before, _, after = page_text(design, times[0]).rpartition("</body>")
    with TemporaryDirectory() as place:
        page = Path(place) / "stills.html"
        page.write_text(before + draw + after, encoding="utf-8")
        drawn = re.search(r"<pre>(.*?)</pre>", content(page), re.DOTALL)
    pictures = [b64decode(each.partition("base64,")[2]) for each in json.loads(drawn[1])] if drawn else []
    if len(pictures) != len(times) or not all(picture.startswith(_START) for picture in pictures):
        raise HandsError("the browser drew no pictures of the page: does it have WebGL (chrome://gpu)?")
    return pictures
