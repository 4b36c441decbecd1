"""A hand whose last links are thicker than others: certified as it is, and refused where its sizes differ."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from casadi_hands.export.urdf import hand_urdf
from casadi_hands.verify.audit import audit
from casadi_hands.verify.figures.structure import finger_bars
from casadi_hands.verify.reading.folder import read_folder
from casadi_hands.verify.trajectory import sample_placements
from tests.verify.falsify import HAND, LINK, NEXT, Cases, both, edited, links_of, record, refusal, task
from tests.verify.fixture import TIP, Scene, carried

THIN = 0.004
HINGE = 2.1 * THIN


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return carried(tmp_path_factory.mktemp("task"), hinge=HINGE, link=THIN)


@pytest.fixture(scope="module")
def good(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = scene.write(tmp_path_factory.mktemp("good"))
    (folder / HAND).write_text(hand_urdf(scene.hand))
    return folder


def test_a_hand_with_thick_tips_is_certified(good: Path) -> None:
    assert audit(good, replays=1).reasons == []


def test_each_link_bends_by_its_own_radius(good: Path) -> None:
    folder = read_folder(good)
    for bars in finger_bars(folder, sample_placements(folder)):
        assert [bar.radius for bar in bars] == pytest.approx([THIN, TIP])
    # Bearings are those of hinges as wide as the links behind the tip.
    strength = folder.task.hand.material.strength / folder.task.hand.safety_factor
    assert folder.task.limits.bearing_moment == pytest.approx(2 / 15 * strength * THIN**3)


TOO_THICK = both(
    edited(HAND, NEXT + "//*[@radius]", lambda e, p: e.set("radius", "0.0065"), every=True),
    record("hand", "fingers", 0, "links", 1, "radius", value=0.0065),
)
FALSIFIED: Cases = {
    "thicker tips in the task": (
        task(f"radius: {TIP}, torsion", "radius: 0.007, torsion"),
        r"finger 'one' \(link 1\) has a radius of 6 mm, the task 7 mm",
    ),
    "tips of the links' radius in the task": (
        task(f"radius: {TIP}, torsion", f"radius: {THIN}, torsion"),
        r"finger 'one' \(link 1\) has a radius of 6 mm, the task 4 mm",
    ),
    "thinner links in the task": (
        task(f"link_radius: {THIN}", "link_radius: 0.0039"),
        r"finger 'one' \(link 0\) has a radius of 4 mm, the task 3\.9 mm",
    ),
    "a thicker tip in the files": (TOO_THICK, r"finger 'one' \(link 1\) has a radius of 6\.5 mm, the task 6 mm"),
    "a first link as thick as the tip": (
        both(
            edited(HAND, LINK + "//sphere", lambda e, p: e.set("radius", str(TIP)), every=True),
            record("hand", "fingers", 0, "links", 0, "radius", value=TIP),
        ),
        r"finger 'one' \(link 0\)|finger0_link0",
    ),
    "a tip that begins as near its joint as a thin link": (
        record("hand", "fingers", 0, "links", 1, "hinge", value=HINGE),
        r"finger 'one' \(link 1\): it does not begin a hinge's length from its joint, as the task has it",
    ),
}


@pytest.mark.parametrize("name", FALSIFIED)
def test_falsified_sizes_are_refused_and_named(good: Path, tmp_path: Path, name: str) -> None:
    falsify, named = FALSIFIED[name]
    folder = shutil.copytree(good, tmp_path / "bad")
    falsify(folder)
    said = refusal(folder)
    assert re.search(named, said), said


def test_a_last_link_may_not_be_shorter_than_its_hinge_asks(good: Path, tmp_path: Path) -> None:
    # Beyond its hinge the last link's body is as long as that of the shortest of the others: here 4.2 mm more in all.
    folder = shutil.copytree(good, tmp_path / "short")
    links_of(folder, 0.058, 0.1)
    assert "finger 'one' (link 1) is 61.4 mm long; the task allows 62.2 to 100 mm" in refusal(folder)
    folder = shutil.copytree(good, tmp_path / "long")
    links_of(folder, 0.057, 0.1)
    assert "finger 'one' (link 1) is" not in refusal(folder)
