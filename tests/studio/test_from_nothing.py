"""From nothing to a hand with the mouse and the keys alone: the result is that of the file which they wrote."""

from __future__ import annotations

import time

import numpy as np
import pytest

from casadi_hands.cli.studio import SOLVE
from casadi_hands.export.design import Design
from casadi_hands.pipeline import solve
from casadi_hands.studio.session import Session
from casadi_hands.task import load_task
from tests.export.browser import Browser, needs_browser
from tests.studio.test_page import FIELD, picture, until

viser = pytest.importorskip("viser")
iio = pytest.importorskip("imageio.v3")
pytestmark = [needs_browser, pytest.mark.slow]
SECONDS = 2400.0


def type_into(browser, field, text):
    """Replace what a field of the form has."""
    browser.evaluate(f"{FIELD % field}.focus()")
    browser.evaluate(f"{FIELD % field}.select()")
    browser.call("Input.insertText", text=text)


def drag_up(page, browser, path, where, pixels):
    """Choose a place, and drag the upward arrow of its gizmo: what is blue now and was not."""
    page.choose(None)
    time.sleep(2)
    before = picture(browser, path / "before.png")
    page.choose(where)
    time.sleep(2)
    after = picture(browser, path / "gizmo.png")
    blue = (after[..., 2] - after[..., 0] > 40) & (np.abs(after - before).sum(axis=2) > 60)
    blue[:, :440] = blue[:, 1070:] = False
    rows, columns = np.nonzero(blue)
    tip = float(rows.min() + 12)
    x = float(np.median(columns[np.abs(rows - tip) < 4]))
    understood = page.session.understood
    browser.drag((x, tip), (x, tip - pixels), steps=30)  # slowly: without a graphics card pages draw slowly
    until(lambda: page.session.understood is not understood)


def test_a_task_made_by_hand_and_eye_is_solved_as_its_file_is(tmp_path):
    from casadi_hands.studio.access import open_server
    from casadi_hands.studio.studio import Studio

    file, out = tmp_path / "new.yaml", tmp_path / "out"
    server, address = open_server(label="new")
    page = Studio(server, Session(file), (*SOLVE, "--jobs", "1"), out)
    try:
        with Browser() as browser:
            browser.open(address)
            assert browser.wait('document.querySelector("textarea")?.value') == page.session.text
            assert not file.exists()
            time.sleep(4)  # the picture comes a little later

            def made():
                return page.session.understood.written

            type_into(browser, "mass", "0.06")
            until(lambda: made() and made().object.mass == 0.06)
            type_into(browser, "shapes", "[capsule: {start: [0, -0.03, 0], end: [0, 0.03, 0], radius: 0.02}]")
            until(lambda: made() and made().object.shapes[0].end[1] == 0.03)
            first = made()
            drag_up(page, browser, tmp_path, ("motion", 2), 25)
            assert 0.2 < made().motion[2].position[2] < 0.28
            assert made().motion[2].position[:2] == (0, 0)
            drag_up(page, browser, tmp_path, ("fingers", "index", "touches"), 6)
            assert made().fingers["index"].point[2] > first.fingers["index"].point[2]
            assert page.session.understood.solvable
            browser.evaluate("[...document.querySelectorAll('button')].find((e) => e.textContent === 'Solve').click()")
            until(lambda: page.results._running)
            until(lambda: not page.results._running, SECONDS)
            mine = Design.load(out)
            browser.wait(f"document.body.innerText.includes('{mine.status}')")
            browser.wait("document.body.innerText.includes('time, s')")
            time.sleep(2)
            picture(browser, tmp_path / "hand.png")
            assert browser.problems == []
    finally:
        page.close()
        server.stop()
    assert mine.status == "certified"
    assert load_task(file).object.mass == 0.06
    again = solve(load_task(file), jobs=1, out=tmp_path / "again")
    assert again.status == mine.status
    for name in ("hand.urdf", "object.urdf", "scene.xml", "task.yaml"):
        assert (out / name).read_bytes() == (tmp_path / "again" / name).read_bytes(), name
    with np.load(out / "motion.npz") as one, np.load(tmp_path / "again/motion.npz") as other:
        assert one.files == other.files
        for name in one.files:
            assert np.array_equal(one[name], other[name]), name
