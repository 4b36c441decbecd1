"""Two designs on one page: one clock, one camera, one scale, nothing from outside."""

from __future__ import annotations

import io
from base64 import b64decode
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from casadi_hands.errors import DesignError
from casadi_hands.export.page.own_page import open_pair
from casadi_hands.export.page.pair import pair_text
from tests.export.browser import Browser, needs_browser
from tests.export.example import example_design, example_hand, example_motion

CLOCK = "parseFloat(document.getElementById('clock').textContent)"


def longer():
    """The example with a larger palm, which takes twice as long."""
    motion = example_motion()
    hand = replace(example_hand(), palm_radius=0.2)
    return replace(example_design(), hand=hand, motion=replace(motion, time=2 * motion.time))


@pytest.fixture
def opened(monkeypatch):
    found = []
    monkeypatch.setattr("webbrowser.open", lambda address: found.append(address) or True)
    return found


def test_the_page_of_two_folders_is_written_and_opened(tmp_path, opened):
    for name in ("a", "b"):
        example_design().save(tmp_path / name)
    page = open_pair(tmp_path / "a", tmp_path / "b")
    assert page == tmp_path / "a/viewer-pair.html"
    assert opened == [page.as_uri()]
    assert "move a capsule &amp; back (a) and move a capsule &amp; back (b)" in page.read_text()
    assert len(page.read_text()) < 1.2e6
    before = page.read_bytes()
    assert open_pair(tmp_path / "a", tmp_path / "b", tmp_path / "both.html").read_bytes() == before
    with pytest.raises(DesignError, match=r"none/both\.html: the page of both cannot be written: .*No such file"):
        open_pair(tmp_path / "a", tmp_path / "b", tmp_path / "none/both.html")


@needs_browser
def test_both_move_by_one_clock_and_are_seen_by_one_camera(tmp_path):
    path = tmp_path / "pair.html"
    path.write_text(pair_text(example_design(), longer(), ("a", "b")))
    inner = "[...document.querySelectorAll('iframe')].map((frame) => frame.contentWindow.stage)"
    with Browser() as browser:
        browser.open(path, 1000, 600)
        browser.wait("document.querySelectorAll('#views button').length === 4")

        def each(expression):
            return browser.evaluate(f"{inner}.map((stage) => {expression})")

        def drawn():
            found = each("(stage.viewer.render(), stage.viewer.renderer.domElement.toDataURL())")
            return [np.asarray(Image.open(io.BytesIO(b64decode(one.partition("base64,")[2]))), float) for one in found]

        place = "stage.viewer.scene_tree.find(['design', 'object']).object.position.toArray()"
        browser.evaluate("location.hash = '#t=1'")
        browser.wait(f"{CLOCK} === 1")
        motion = example_motion()
        one, other = each(place)
        assert one == pytest.approx(motion.object_position[10])
        assert other == pytest.approx(motion.object_position[5])
        # What ends earlier waits for the other.
        browser.evaluate("document.getElementById('scrub').value = 4")
        browser.evaluate("document.getElementById('scrub').dispatchEvent(new Event('input'))")
        assert browser.evaluate("document.getElementById('clock').textContent") == "4.00 / 4.00 s"
        assert each(place)[0] == pytest.approx(motion.object_position[20])
        # From one side, and from as far in metres.
        eyes = "stage.viewer.camera.position.toArray().map((part) => part * stage.radius)"
        one, other = each(eyes)
        assert one == pytest.approx(other)
        before = drawn()
        browser.evaluate("document.getElementById('tools').open = false")
        browser.drag((700, 300), (800, 260))
        turned = each(eyes)
        assert turned[0] == pytest.approx(turned[1], rel=1e-6)
        assert np.linalg.norm(np.subtract(turned[0], one)) > 0.1 * np.linalg.norm(one)
        after = drawn()
        assert all((np.abs(a - b).max(axis=2) > 30).sum() > 500 for a, b in zip(before, after, strict=True))
        # Boxes are for both.
        browser.evaluate("document.querySelector('#layers input').click()")
        forces = "stage.viewer.scene_tree.find(stage.layers[0].paths[0]).object.visible"
        assert each(forces) == [False, False]
        assert browser.problems == []
        reached = [address for address in browser.requests if not address.startswith(("data:", "blob:", "about:"))]
        assert reached == [path.resolve().as_uri()]
