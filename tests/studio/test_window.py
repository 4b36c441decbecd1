"""The studio in windows of all sizes, light and dark: nothing falls off, and the task is in sight."""

from __future__ import annotations

import io
import time
from base64 import b64decode

import numpy as np
import pytest

from casadi_hands.studio.session import Session
from casadi_hands.studio.window import NARROW, PHONE, View, placed
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
    time.sleep(5)  # the panels find their places, the camera its own, and what viser says of the browser goes
    browser.evaluate(
        """document.querySelectorAll(".mantine-Notification-closeButton").forEach((each) => each.click())"""
    )
    time.sleep(1)
    x, y, right, bottom, _ = browser.evaluate(f"{SEEN}(document.querySelector('canvas'))")
    assert right - x >= min(width, 360)
    if width <= PHONE:
        bottom = height / 2
    back = 20 if dark else 255
    for _ in range(60):  # on a busy machine the scene comes later
        drawn = np.abs(light(browser, (x, y, right, bottom)) - back) > 15
        if drawn.mean() > 0.05:
            break
        time.sleep(1)
    assert 0.05 < drawn.mean() < 0.9
    assert not drawn[:, :20].any()  # the palm is whole
    found = browser.evaluate(f"{BUTTONS}.map((each) => each.textContent)")
    assert set(f"{names} Solve remove".split()) | {"add goal", "add finger"} <= set(found)
    for name in (*names.split(), "add goal", "add finger", "remove", "Solve"):
        left, top, end, under, hit = browser.evaluate(
            f"{SEEN}({BUTTONS}.find((each) => each.textContent === '{name}'))"
        )
        assert hit, name
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
