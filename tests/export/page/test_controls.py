"""The page's buttons and keys in a real browser: each does what it says, to the scene, the clock and the address."""

from __future__ import annotations

import io
import re
from base64 import b64decode
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from casadi_hands.export.page.page import page_text
from tests.export.browser import SIZES, needs_browser
from tests.export.example import example_design, example_motion
from tests.export.report.test_in_a_browser import contrast

pytestmark = needs_browser
COLORS = {"Forces": (217, 31, 38), "Goals": (64, 153, 89), "Joint axes": (250, 133, 13)}
# What the browser draws now, as PNG.
DRAWN = "(viewer.render(), viewer.renderer.domElement.toDataURL())"
CLOCK = "parseFloat(document.getElementById('clock').textContent)"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "viewer.html"
    path.write_text(page_text(example_design()))
    return path


@pytest.fixture
def opened(browser, page):
    """The page, opened anew, at rest at 1 s."""
    browser.open("about:blank")
    browser.open(page.as_uri() + "#t=1", 640, 480)
    browser.wait("document.querySelectorAll('#views button').length === 4 && viewer.renderer.domElement.width === 640")
    return browser


def drawn(browser):
    """Pixels (480, 640, 3)."""
    picture = b64decode(browser.evaluate(DRAWN).partition("base64,")[2])
    return np.asarray(Image.open(io.BytesIO(picture)).convert("RGB"), float)


def press(browser, text):
    """Press the box or button that says so."""
    found = "[...document.querySelectorAll('#layers label, #views button')]"
    browser.evaluate(f"{found}.find((each) => each.textContent.trim() === {text!r}).click()")


def key(browser, name, code=None):
    for kind in ("keyDown", "keyUp"):
        browser.call("Input.dispatchKeyEvent", type=kind, key=name, code=code or name, text=" " if name == " " else "")


def near(pixels, color, within=40):
    """How many pixels have nearly a colour."""
    return int((np.abs(pixels - color).max(axis=2) < within).sum())


def test_forces_and_axes_are_shown_and_hidden_in_their_colours(opened):
    forces, axes = COLORS["Forces"], COLORS["Joint axes"]
    before = drawn(opened)
    assert near(before, forces) > 300
    assert near(before, axes) < 20
    press(opened, "Forces")
    press(opened, "Joint axes")
    after = drawn(opened)
    assert near(after, forces) < 20
    assert near(after, axes) > 300
    # Forces that come later stay hidden, too.
    opened.evaluate("document.getElementById('forth').click()")
    assert near(drawn(opened), forces) < 20
    press(opened, "Forces")
    press(opened, "Joint axes")
    opened.evaluate("document.getElementById('back').click()")
    assert np.abs(drawn(opened) - before).max() < 3


def test_goals_are_hidden(opened):
    def green(pixels):
        return int(((pixels[..., 1] > pixels[..., 0] + 12) & (pixels[..., 1] > pixels[..., 2] + 6)).sum())

    before = green(drawn(opened))
    assert before > 500
    press(opened, "Goals")
    assert green(drawn(opened)) < before / 5


def test_paths_go_where_the_contacts_go(opened):
    before = drawn(opened)
    press(opened, "Contact paths")
    changed = np.abs(drawn(opened) - before).max(axis=2) > 25
    assert 30 < changed.sum() < 6000
    # Where the browser's own library puts each contact of the motion there is, or is not far from, a changed pixel.
    motion = example_motion()
    rows, columns = np.nonzero(changed)
    for k in (0, 5, 10):
        opened.evaluate(f"stage.show({motion.time[k]})")
        spots = opened.evaluate(
            """['thumb', 'index', 'middle'].map((name) => {
              const node = viewer.scene_tree.find(['design', 'object', 'forces', `at ${name}`]).object;
              const at = node.getWorldPosition(viewer.camera.position.clone()).project(viewer.camera);
              return [(at.x + 1) / 2 * 640, (1 - at.y) / 2 * 480];
            })"""
        )
        for x, y in spots:
            assert np.hypot(columns - x, rows - y).min() < 4


def test_a_hand_is_seen_through(opened):
    before = drawn(opened)
    press(opened, "See-through hand")
    through = drawn(opened)
    # The object's and the ground's pixels show where links were.
    assert (np.abs(through - before).max(axis=2) > 20).sum() > 3000
    press(opened, "See-through hand")
    assert np.abs(drawn(opened) - before).max() < 3


def test_cameras_stand_where_their_names_say(opened):
    def eye():
        x, y, z = opened.evaluate("viewer.camera.getWorldPosition(viewer.camera.position.clone()).toArray()")
        # The scene of meshcat's camera has y up.
        return np.array([x, -z, y]) / np.linalg.norm([x, y, z])

    pictures = [drawn(opened)]
    # The example's palm faces along x.
    for name, direction in (("Front", [1, 0, 0]), ("Side", [0, -1, 0]), ("Top", [0, 0, 1])):
        press(opened, name)
        assert eye() == pytest.approx(direction, abs=2e-3)
        pictures.append(drawn(opened))
    for k, one in enumerate(pictures):
        assert all((np.abs(one - other).max(axis=2) > 30).sum() > 2000 for other in pictures[:k])
    press(opened, "Start")
    assert np.abs(drawn(opened) - pictures[0]).max() < 3


def test_steps_go_from_sample_to_sample_and_the_address_follows(opened):
    times = example_motion().time
    opened.evaluate("document.getElementById('scrub').value = 0.33")
    opened.evaluate("document.getElementById('scrub').dispatchEvent(new Event('input'))")
    assert opened.evaluate(CLOCK) == 0.33
    opened.wait("location.hash === '#t=0.33'")
    opened.evaluate("document.getElementById('forth').click()")
    assert opened.evaluate(CLOCK) == pytest.approx(times[4])
    key(opened, "ArrowRight")
    assert opened.evaluate(CLOCK) == pytest.approx(times[5])
    opened.wait("location.hash === '#t=0.5'")
    key(opened, "ArrowLeft")
    key(opened, "ArrowLeft")
    assert opened.evaluate(CLOCK) == pytest.approx(times[3])
    key(opened, "End")
    assert opened.evaluate(CLOCK) == 2
    key(opened, "Home")
    opened.wait("location.hash === '#t=0'")
    # The object is where the motion has it.
    opened.evaluate("location.hash = '#t=1'")
    opened.wait(f"{CLOCK} === 1")
    place = opened.evaluate("viewer.scene_tree.find(['design', 'object']).object.position.toArray()")
    assert place == pytest.approx(example_motion().object_position[10])


def test_space_plays_and_the_address_lets_go(opened):
    key(opened, " ", "Space")
    opened.wait(f"{CLOCK} !== 1")
    opened.wait("location.hash === ''")
    key(opened, " ", "Space")
    rest = opened.evaluate(CLOCK)
    opened.wait(f"Math.abs(location.hash.slice(3) - {rest}) < 0.006 && location.hash")
    assert opened.evaluate(f"new Promise((done) => setTimeout(() => done({CLOCK}), 300))") == rest


def test_speed_is_time_by_the_clock_on_the_wall(browser, tmp_path):
    motion = example_motion()
    slow = replace(example_design(), motion=replace(motion, time=30 * motion.time))  # a minute: it does not begin anew
    (tmp_path / "slow.html").write_text(page_text(slow))
    browser.open((tmp_path / "slow.html").as_uri() + "#t=1", 320, 240)
    browser.wait(f"{CLOCK} === 1")
    opened = browser
    # The page's own frames say how fast its time goes by.
    measured = """new Promise((done) => {
      const found = [], scrub = document.getElementById('scrub');
      function look(now) {
        found.push([now, Number(scrub.value)]);
        if (found.length < 12) requestAnimationFrame(look); else done(found);
      }
      requestAnimationFrame(look);
    })"""
    for speed in (0.25, 1):
        opened.evaluate(f"document.getElementById('speed').value = {speed}")
        opened.evaluate("location.hash = '#t=0.01'")
        opened.wait(f"{CLOCK} === 0.01")
        opened.evaluate("document.getElementById('play').click()")
        found = np.array(opened.evaluate(measured))
        steps = np.diff(found, axis=0)
        forward = (steps[:, 1] > 0) & (steps[:, 0] > 0)
        assert forward.sum() > 3
        assert np.median(steps[forward, 1] / (steps[forward, 0] / 1000)) == pytest.approx(speed, rel=0.05)


def test_parts_are_called_what_people_call_them(opened):
    titles = "[...document.querySelectorAll('#parts li.title')].map((each) => each.textContent)"
    found = opened.evaluate(titles)
    assert {"palm", "thumb link 1", "index link 2", "sphere 1", "cylinder 1", "goal 1", "goal 2", "forces"} <= set(
        found
    )
    assert not [each for each in found if re.search(r"shape ?\d|finger\d|_", each)]
    # A part's own box hides it.
    before = drawn(opened)
    opened.evaluate(
        """[...document.querySelectorAll('#parts .folder')].find((each) =>
          each.querySelector('li.title').textContent === 'index link 1')
          .querySelector('.meshcat-visibility-checkbox input').click()"""
    )
    assert (np.abs(drawn(opened) - before).max(axis=2) > 20).sum() > 1000


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize(("width", "height"), SIZES)
def test_it_fits_and_can_be_read(browser, page, tmp_path, width, height, dark):
    browser.open("about:blank")
    browser.open(page.as_uri() + "#t=1", width, height, dark)
    browser.wait("document.querySelectorAll('#views button').length === 4")
    assert browser.evaluate("document.getElementById('tools').open") == (width > 900)
    browser.evaluate("document.getElementById('tools').open = true")
    boxes = browser.evaluate(
        """[...document.querySelectorAll('#bar button, #bar input, #bar select, #tools label, #tools button')]
          .map((each) => { const box = each.getBoundingClientRect(); return [box.x, box.y, box.right, box.bottom]; })"""
    )
    assert len(boxes) == 5 + 5 + 4
    for k, (left, top, right, bottom) in enumerate(boxes):
        assert min(left, top, width - right, height - bottom) >= 0
        assert bottom - top >= (36 if width < 500 else 24)
        for other in boxes[:k]:
            assert left >= other[2] - 1 or right <= other[0] + 1 or top >= other[3] - 1 or bottom <= other[1] + 1
    style = "getComputedStyle(document.body)"
    ink, back = (
        [int(part) for part in re.findall(r"\d+", browser.evaluate(f"{style}.{what}"))[:3]]
        for what in ("color", "backgroundColor")
    )
    assert (sum(ink) > sum(back)) == dark
    assert contrast(ink, back) > 7  # WCAG 2.2, 1.4.6
    browser.picture(tmp_path / "window.png")
    browser.keep("viewer", dark)
    corner = np.asarray(Image.open(tmp_path / "window.png").convert("L"), float)[height // 2, 2]
    assert (corner < 100) == dark
    assert browser.problems == []
    assert [each for each in browser.requests if not each.startswith(("data:", "blob:"))] == [page.as_uri()]
