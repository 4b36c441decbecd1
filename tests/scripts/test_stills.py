"""The pictures of a motion, beside where a camera must see it."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from stills import SIZE, stills

from casadi_hands.errors import HandsError
from casadi_hands.export.design import Design
from casadi_hands.export.page.scene import eye_towards
from tests.export.browser import needs_browser
from tests.export.example import example_hand, example_motion, example_task

pytestmark = needs_browser


def yellow_middle(picture: bytes) -> np.ndarray:
    """Mean place (right, up) of the object's dark patches, pixels."""
    pixels = np.asarray(Image.open(io.BytesIO(picture)).convert("RGB"), float)
    rows, columns = np.nonzero((pixels[..., 0] > pixels[..., 1]) & (pixels[..., 1] > pixels[..., 2] + 50))
    assert len(rows) > 500
    return np.array([columns.mean(), -rows.mean()])


def test_the_object_moves_as_the_camera_must_see_it() -> None:
    motion = example_motion()
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(motion.time), 1))
    motion = replace(motion, object_orientation=upright)
    design = Design(example_task(), "certified", hand=example_hand(), motion=motion)
    pictures = stills(design, [0.0, 0.5, 1.0])
    assert {Image.open(io.BytesIO(picture)).size for picture in pictures} == {SIZE}
    start, half, there = (yellow_middle(picture) for picture in pictures)
    eye = eye_towards(np.array([1.0, 0.0, 0.0]))
    right = np.cross([0.0, 0.0, 1.0], eye)
    right /= np.linalg.norm(right)
    seen = np.array([right[0], np.cross(eye, right)[0]])  # of the way along the world's x, in the picture's plane
    moved = there - start
    assert moved @ seen > 0.97 * np.linalg.norm(moved) * np.linalg.norm(seen)
    assert (half - start) @ seen == pytest.approx(moved @ seen / 2, rel=0.1)
    assert np.linalg.norm(moved) > 10


def test_a_browser_that_draws_nothing_is_told_of(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("casadi_hands.export.page.film.content", lambda page: "<html></html>")
    with pytest.raises(HandsError, match="WebGL"):
        stills(Design(example_task(), "failed"), [0.0])
