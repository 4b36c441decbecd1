"""The report in a real browser with the network off: it moves, it is quiet, and it fits."""

import re

import pytest

from casadi_hands.export.report.page import write_report
from tests.export.browser import SIZES, Browser, needs_browser
from tests.export.example import example_design
from tests.export.report.test_report import nasty_design

pytestmark = needs_browser
READY = "document.querySelectorAll('#goals img').length === 3"
CLOCK = "parseFloat(document.getElementById('clock').textContent)"
LINE = "parseFloat(document.querySelector('[data-panel=angles] .now').style.left)"
INNER = "document.getElementById('viewer').contentDocument"


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(example_design(), path)
    return path


@pytest.fixture
def opened(browser, report):
    """The report, at rest at its start."""
    if not browser.requests:
        browser.open(report, 1024, 700)
        browser.wait(READY)
    browser.look(1024, 700)
    browser.evaluate("document.querySelectorAll('#goals button')[0].click()")
    browser.wait(f"{CLOCK} === 0")
    return browser


def test_nothing_is_asked_of_the_network_and_nothing_goes_wrong(opened, report):
    opened.evaluate("scrollTo(0, document.body.scrollHeight)")
    asked = [address for address in opened.requests if not address.startswith(("data:", "blob:", "about:"))]
    assert asked == [report.resolve().as_uri()]
    assert opened.problems == []


def test_the_cursor_moves_with_the_animation(opened):
    opened.evaluate(f"{INNER}.getElementById('play').click()")
    opened.wait(f"{INNER}.getElementById('scrub').value > 0.3")
    before = opened.evaluate(LINE)
    opened.wait(f"{LINE} > {before} + 5 || {LINE} < {before}")
    # Stopped in the viewer, it stands.
    opened.evaluate(f"{INNER}.getElementById('play').click()")
    opened.wait(f"Math.abs({CLOCK} - {INNER}.getElementById('scrub').value) < 0.006")
    stands = opened.evaluate(LINE)
    assert opened.evaluate(f"new Promise((done) => setTimeout(() => done({LINE}), 300))") == stands


def test_the_animation_goes_to_where_a_plot_is_pressed(opened):
    x, y, width = opened.evaluate(
        """(() => {
            const over = document.querySelector('[data-panel=torques] .u-over');
            over.scrollIntoView({block: 'center'});
            const box = over.getBoundingClientRect();
            return [box.left, box.top + 20, box.width];
        })()"""
    )
    opened.drag((x + 0.5 * width, y), (x + 0.75 * width, y))
    opened.wait(f"Math.abs({CLOCK} - 1.5) < 0.02")  # the motion takes 2 s
    assert opened.evaluate(f"Number({INNER}.getElementById('scrub').value)") == pytest.approx(1.5, abs=0.02)
    torque = opened.evaluate("document.querySelector('[data-panel=torques] .legend b').textContent")
    assert re.fullmatch(r"−?[\d.]+(e−\d)?", torque)


def test_goals_are_pictures_that_lead_to_their_times(opened):
    opened.evaluate("document.querySelectorAll('#goals button')[1].click()")
    opened.wait(f"{CLOCK} === 1")
    opened.wait("[...document.querySelectorAll('#goals img')].every((each) => each.naturalWidth > 100)")
    # Start and middle of the motion do not look the same.
    assert (
        opened.evaluate(
            "new Set([...document.querySelectorAll('#goals img')].slice(0, 2).map((each) => each.src)).size"
        )
        == 2
    )


def test_a_curve_is_hidden_by_its_name(opened):
    shown = "document.querySelector('[data-panel=forces] .legend button').getAttribute('aria-pressed')"
    image = "document.querySelector('[data-panel=forces] canvas').toDataURL()"
    before = opened.evaluate(image)
    opened.evaluate("document.querySelector('[data-panel=forces] .legend button').click()")
    assert opened.evaluate(shown) == "false"
    opened.wait(f"{image} !== {before!r}")


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [width for width, _ in SIZES])
def test_it_fits_and_can_be_read(opened, width, dark):
    browser = opened
    browser.look(width, 900, dark)
    browser.evaluate("scrollTo(0, 0)")
    plot = "document.querySelector('[data-panel=angles]')"
    browser.wait(f"{plot}.clientWidth === {plot}.querySelector('.uplot').offsetWidth")
    assert browser.evaluate("document.documentElement.scrollWidth") == width
    assert browser.problems == []
    ink, card = (
        [int(part) for part in re.findall(r"\d+", browser.evaluate(f"getComputedStyle({where}).{what}"))[:3]]
        for where, what in (("document.body", "color"), ("document.querySelector('section')", "backgroundColor"))
    )
    assert (sum(ink) > sum(card)) == dark
    assert contrast(ink, card) > 7  # WCAG 2.2, 1.4.6
    browser.evaluate(f"{INNER}.getElementById('tools').open = {INNER}.defaultView.innerWidth > 900")  # as when opened
    browser.keep("report", dark)
    small = browser.evaluate(
        "Math.min(...[...document.querySelectorAll('svg text')].map((t) => t.getBoundingClientRect().height))"
    )
    assert small > 10


def contrast(first, second):
    """Ratio of luminances, as WCAG 2.2 defines it."""

    def luminance(color):
        parts = [part / 255 for part in color]
        red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
        return 0.2126 * red + 0.7152 * green + 0.0722 * blue

    low, high = sorted((luminance(first), luminance(second)))
    return (high + 0.05) / (low + 0.05)


def test_it_prints(opened, tmp_path):
    path = tmp_path / "report.pdf"
    opened.pdf(path)
    assert path.read_bytes().startswith(b"%PDF")
    assert len(path.read_bytes()) > 50_000
    assert opened.problems == []


def test_markup_in_names_does_not_run(tmp_path):
    path = tmp_path / "report.html"
    write_report(nasty_design(), path)
    with Browser() as browser:
        browser.open(path)
        browser.wait(READY)
        inner = "document.getElementById('viewer').contentWindow"
        assert browser.evaluate(f"[window.hacked, {inner}.hacked]") == [None, None]
        assert "<script>" in browser.evaluate("document.querySelector('h1').textContent")
        assert browser.problems == []
