"""Small pictures of the shipped tasks."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from PIL import Image
from thumbnails import PROBLEMS, SIZE, thumbnail

from tests.export.browser import needs_browser


@needs_browser
def test_a_task_is_drawn() -> None:
    drawn = Image.open(BytesIO(thumbnail(PROBLEMS / "objects" / "cube.yaml"))).convert("RGB")
    kept = Image.open(PROBLEMS / "pictures" / "cube.webp").convert("RGB")
    assert drawn.size == kept.size == SIZE
    colors = np.asarray(drawn, float)
    assert np.abs(colors - np.asarray(kept, float)).mean() < 2
    # The object is of two tones, orange one of them, before a grey palm.
    red, _, blue = np.moveaxis(colors, 2, 0)
    assert 0.005 < (red - blue > 80).mean() < 0.3
