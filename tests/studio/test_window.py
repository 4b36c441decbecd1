"""The studio in windows of all sizes, light and dark: nothing falls off, and the task is in sight."""

from __future__ import annotations

import asyncio
import io
import time
from base64 import b64decode
from contextlib import nullcontext
from unittest.mock import Mock, call

import numpy as np
import pytest

from casadi_hands.studio.session import Session
from casadi_hands.studio.window import NARROW, PHONE, View, arrange, placed
from tests.export.browser import SIZES, needs_browser
from tests.studio.example import CAPSULE

pytest.importorskip("viser")
iio = pytest.importorskip("imageio.v3")
BUTTONS = """[...document.querySelectorAll("button")].filter((each) => each.textContent && each.offsetParent)"""
SEEN = """((each) => {
  each.scrollIntoView({block: "nearest"});
  const box = each.getBoundingClientRect();
  return [box.x, box.y, box.right, box.bottom,
    each.contains(document.elementFromPoint((box.x + box.right) / 2, (box.y + box.bottom) / 2))];
})"""
CLOSE_WHAT_VISER_SAYS = """document.querySelectorAll(".mantine-Notification-closeButton").forEach((it) => it.click())"""


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    from casadi_hands.studio.access import open_server
    from casadi_hands.studio.studio import Studio

    folder = tmp_path_factory.mktemp("studio")
    server, address = open_server(label="task")
    (folder / "task.yaml").write_text(CAPSULE, encoding="utf-8")
    page = Studio(server, Session(folder / "task.yaml"), ("false",), folder / "result")
    yield address
    page.close()
    server.stop()


def light(browser, box):
    """The picture's (H, W) brightness within x, y, right, bottom."""
    png = b64decode(browser.call("Page.captureScreenshot", format="png")["data"])
    x, y, right, bottom = (int(each) for each in box)
    return iio.imread(io.BytesIO(png))[y:bottom, x:right, :3].mean(axis=2)


@needs_browser
@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize(("width", "height"), SIZES)
def test_it_fits_and_is_dark_where_the_browser_is(browser, address, width, height, dark):
    browser.open("about:blank")
    browser.open(address, width, height, dark)
    names = "save undo reload" if width >= NARROW else ""
    browser.wait(f"""{BUTTONS}.some((each) => each.textContent === "Solve")""")
    for _ in range(60):  # panels, camera and scene find their places, on a busy machine later
        time.sleep(1)
        browser.evaluate(CLOSE_WHAT_VISER_SAYS)
        x, y, right, bottom, _ = browser.evaluate(f"{SEEN}(document.querySelector('canvas'))")
        seen = (x, y, right, height / 2 if width <= PHONE else bottom)
        drawn = np.abs(light(browser, seen) - (20 if dark else 255)) > 15
        whole = not drawn[:, :20].any()  # the palm is
        if whole and drawn.mean() > 0.05:
            break
    assert right - x >= min(width, 360)
    assert whole
    assert 0.05 < drawn.mean() < 0.9
    for name in (*names.split(), "add goal", "add finger", "remove", "Solve"):
        seen = f"{SEEN}({BUTTONS}.find((each) => each.textContent === '{name}'))"
        browser.wait(f"{seen}[4]")
        left, top, end, under, _ = browser.evaluate(seen)
        assert min(left, top, width - end, height - under) >= 0, name
    assert browser.evaluate("document.documentElement.scrollWidth") <= width
    browser.keep("studio", dark)
    assert browser.problems == []


@needs_browser
def test_it_follows_the_browser_when_that_changes(browser, address):
    scheme = """document.documentElement.getAttribute("data-mantine-color-scheme")"""
    browser.open("about:blank")
    browser.open(address, 1000, 700, dark=False)
    browser.wait(f"{scheme} === 'light'")
    browser.look(1000, 700, dark=True)
    browser.wait(f"{scheme} === 'dark'")
    browser.look(1000, 700, dark=False)
    browser.wait(f"{scheme} === 'light'")


class Page:
    """A client of viser's with its camera, which is told of what the page has."""

    def __init__(self) -> None:
        self.position, self.look_at, self.fov = np.full(3, 3.0), np.zeros(3), np.radians(75)
        self.image_width, self.image_height = 768, 0
        self.heeds, self.panels = [], []
        self.camera, self.atomic, self.gui = self, nullcontext, self
        self.on_update = self.heeds.append

    @property
    def main_panel(self):
        """A new handle each time, as viser gives it."""
        self.panels.append(Mock(_placement_uuid="main"))
        return self.panels[-1]

    def says(self, width, height, position=None, look_at=None):
        self.image_width, self.image_height = width, height
        self.position = self.position if position is None else position
        self.look_at = self.look_at if look_at is None else look_at
        for heed in self.heeds:
            asyncio.run(heed(self))
        return self.position


def test_the_camera_follows_the_scene_until_someone_moves_it():
    view = View(np.array([0.1, 0, 0]), np.array([1.0, 0, 0]), 0.2)
    page = Page()
    arrange(page, Mock(_placement_uuid="file"), view)  # before there is a scene
    first, wide, narrow = page.position, page.says(768, 1024), page.says(364, 1024)
    assert np.linalg.norm(narrow) > np.linalg.norm(wide)
    assert page.says(364, 1024, first) == pytest.approx(narrow)  # what the page said before it heard
    assert page.says(768, 1024, narrow) == pytest.approx(wide)
    assert page.says(364, 1024, wide) == pytest.approx(narrow)
    page.says(364, 1024, narrow, narrow - wide)
    assert page.look_at == pytest.approx(view.middle)
    own = np.add(wide, [0, 0.01, 0])
    assert page.says(768, 1024, own) is own
    assert page.says(364, 1024, own) is own
    assert page.says(364, 1024, wide) is wide


@pytest.mark.parametrize(("width", "folded"), [(390, False), (768, True), (1440, False)])
def test_panels_are_docked_and_the_file_s_is_folded_up_where_there_is_little_room(width, folded):
    page = Page()
    page.image_width = width
    arrange(page, Mock(_placement_uuid="file"), None)
    (right,) = (each for each in page.panels if each._placement_uuid == "main")
    (left,) = (each for each in page.panels if each._placement_uuid == "file")
    assert right.method_calls == [call.dock_right(), call.set_width(360)]
    assert left.method_calls == [call.dock_left(), call.set_width(430), *[call.minimize()] * folded]
    assert page.heeds == []


@pytest.mark.parametrize("sheet", [False, True])
@pytest.mark.parametrize("size", [(650, 900), (364, 1024), (390, 844), (1200, 500)])
def test_the_camera_sees_all_of_it(rng, size, sheet):
    towards = np.array([0.4, -0.7, 0.5])
    view = View(rng.normal(size=3), towards / np.linalg.norm(towards), 0.2)
    fov = np.radians(75)
    position, middle = placed(view, fov, size, sheet)
    back = (position - middle) / np.linalg.norm(position - middle)
    right = np.cross([0, 0, 1], back)
    right /= np.linalg.norm(right)
    rays = rng.normal(size=(500, 3))
    seen = view.middle + view.reach * rays / np.linalg.norm(rays, axis=1)[:, None] - position
    deep = -seen @ back * np.tan(fov / 2)
    across, upwards = seen @ right / deep * size[1] / size[0], seen @ np.cross(back, right) / deep
    assert (deep > 0).all()
    assert np.abs(across).max() < 1
    assert upwards.max() < 1.1  # of a ball that is larger than what is in it
    assert upwards.min() > (-0.1 if sheet else -1)
