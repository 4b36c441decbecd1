"""The studio in a browser without a network: what the mouse and the keys do is what the file says."""

from __future__ import annotations

import time
from urllib.parse import urlsplit

import numpy as np
import pytest

from casadi_hands.studio.session import Session
from casadi_hands.task import load_task
from tests.export.browser import Browser, needs_browser
from tests.studio.example import CAPSULE

viser = pytest.importorskip("viser")
iio = pytest.importorskip("imageio.v3")
pytestmark = needs_browser

FIELD = """[...document.querySelectorAll("label, .mantine-Text-root")].find((e) => e.textContent === "%s")
  .closest(".mantine-Flex-root").querySelector("input")"""


@pytest.fixture
def studio(tmp_path):
    from casadi_hands.studio.access import open_server
    from casadi_hands.studio.studio import Studio

    server, address = open_server(label="task")
    (tmp_path / "task.yaml").write_text(CAPSULE, encoding="utf-8")
    page = Studio(server, Session(tmp_path / "task.yaml"), ("false",), tmp_path / "result")
    yield page, address
    page.close()
    server.stop()


@pytest.fixture
def browser():
    with Browser() as browser:
        yield browser


def picture(browser, path):
    browser.picture(path)
    return iio.imread(path)[..., :3].astype(int)


def settled(browser, path, unlike=None):
    """The picture once it stays what it is, which is neither blank nor like another."""
    before = picture(browser, path)

    def stays():
        nonlocal before
        time.sleep(0.3)
        now = picture(browser, path)
        same, before = np.array_equal(now, before), now
        blank = len(np.unique(now @ [1 << 16, 1 << 8, 1])) <= 200
        return same and not blank and (unlike is None or (np.abs(now - unlike).sum(axis=2) > 60).sum() > 100)

    until(stays, 60.0)
    return before


def until(found, seconds=30.0):
    end = time.monotonic() + seconds
    while not (value := found()):
        assert time.monotonic() < end
        time.sleep(0.2)
    return value


def test_the_page_edits_the_file_and_asks_nobody_else(studio, browser, tmp_path):
    page, address = studio
    browser.open(address)
    assert browser.wait('document.querySelector("textarea")?.value') == CAPSULE
    before = settled(browser, tmp_path / "before.png")

    # A gizmo: its upward arrow is what is blue now and was not.
    page.choose(("motion", 1))
    after = settled(browser, tmp_path / "gizmo.png", before)
    blue = (after[..., 2] - after[..., 0] > 40) & (np.abs(after - before).sum(axis=2) > 60)
    blue[:, :440] = blue[:, 1070:] = False
    rows, columns = np.nonzero(blue)
    tip = float(rows.min() + 12)
    x = float(np.median(columns[np.abs(rows - tip) < 4]))
    browser.drag((x, tip), (x, tip - 60))
    # The file follows while it is dragged, and for a little after.
    until(lambda: page.session.understood.written.motion[1].position[2] > 0.31)
    time.sleep(2)
    first, second = page.session.understood.written.motion
    assert first.position == (0.09, 0.0, 0.3)
    assert second.position[:2] == (0.09, 0.02)
    assert second.position[2] < 0.4
    browser.wait(f'document.querySelector("textarea").value.includes("{second.position[2]}")')

    # A field.
    browser.evaluate(f"{FIELD % 'mass'}.select()")
    browser.evaluate(f"{FIELD % 'mass'}.focus()")
    browser.call("Input.insertText", text="0.25")
    until(lambda: page.session.understood.written and page.session.understood.written.object.mass == 0.25)
    browser.wait('document.querySelector("textarea").value.includes("mass: 0.25")')

    # What is typed and refused stays to be mended, and changes nothing.
    kept = page.session.text
    browser.evaluate(f"{FIELD % 'shapes'}.focus()")
    browser.evaluate(f"{FIELD % 'shapes'}.select()")
    browser.call("Input.insertText", text="[sphere: {center")
    time.sleep(3)
    assert browser.evaluate(f"{FIELD % 'shapes'}.value") == "[sphere: {center"
    assert page.session.text == kept
    browser.evaluate(f"{FIELD % 'shapes'}.select()")
    browser.call("Input.insertText", text="[capsule: {start: [0, 0, -0.03], end: [0, 0, 0.03], radius: 0.02}]")
    browser.wait('document.querySelector("textarea").value.includes("-0.03]")')

    # The text, and what check says of it.
    browser.evaluate('document.querySelector("textarea").focus()')
    browser.evaluate('document.querySelector("textarea").setSelectionRange(1e6, 1e6)')
    browser.call("Input.insertText", text="gravty: [0, 0, 0]\n")
    assert "did you mean gravity?" in browser.wait('document.querySelector(".studio .bad")?.textContent')
    browser.evaluate("[...document.querySelectorAll('button')].find((e) => e.textContent === 'undo').click()")
    browser.wait('!document.querySelector(".studio .bad")')

    # The file.
    assert page.session.path.read_text(encoding="utf-8") == CAPSULE
    browser.evaluate("[...document.querySelectorAll('button')].find((e) => e.textContent === 'save').click()")
    until(lambda: page.session.path.read_text(encoding="utf-8") != CAPSULE)
    task = load_task(page.session.path)
    assert task.object.mass == 0.25
    assert task.motion[1].position == second.position

    picture(browser, tmp_path / "end.png")
    assert browser.problems == []
    hosts = {urlsplit(each.removeprefix("blob:")).netloc for each in browser.requests if not each.startswith("data:")}
    assert hosts == {urlsplit(address).netloc}


def test_a_hand_that_comes_is_shown_and_moves(studio, browser, tmp_path):
    from tests.export.example import example_design

    page, address = studio
    browser.open(address)
    browser.wait('document.querySelector("textarea")?.value')
    example_design().save(tmp_path / "result")
    browser.wait('document.body.innerText.includes("made by hand")')
    middle = np.s_[200:700, 450:1060]
    still = settled(browser, tmp_path / "still.png")[middle]
    page.results.show_hand()

    def changed(from_what):
        return (np.abs(from_what - picture(browser, tmp_path / "now.png")[middle]).sum(axis=2) > 60).sum() > 200

    until(lambda: changed(still))
    one = picture(browser, tmp_path / "one.png")[middle]
    until(lambda: changed(one))
    assert browser.problems == []
