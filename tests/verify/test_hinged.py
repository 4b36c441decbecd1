"""A hand of hinged links: certified as it is, and refused where its files or task say otherwise."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
import pytest

from casadi_hands.export.urdf import hand_urdf
from casadi_hands.verify.audit import audit
from casadi_hands.verify.figures.clearance import body_pairs, penetration_figure
from casadi_hands.verify.figures.dynamics import shoot
from casadi_hands.verify.reading.folder import read_folder
from casadi_hands.verify.trajectory import build_trajectory
from tests.verify.falsify import HAND, LINK, SCENE, added, attribute, both, edited, record, refusal, removed, task
from tests.verify.fixture import SPHERE, TIP, Scene, carried, plain, read_task

HINGE = 2.1 * TIP
STATED = ("hand", "fingers", 0, "links", 0, "hinge")


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return carried(tmp_path_factory.mktemp("task"), hinge=HINGE)


@pytest.fixture(scope="module")
def good(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With tongues and pins, as hands are exported."""
    folder = scene.write(tmp_path_factory.mktemp("good"))
    (folder / HAND).write_text(hand_urdf(scene.hand))
    return folder


def test_a_hinged_hand_is_certified_with_and_without_what_is_only_looked_at(
    scene: Scene, good: Path, tmp_path: Path
) -> None:
    found = audit(good, replays=1)
    assert found.reasons == []
    plain_file = scene.write(tmp_path / "plain")
    assert (plain_file / HAND).read_text().count("<visual>") == 22  # a disc, three balls, six capsules of three parts
    assert (good / HAND).read_text().count("<visual>") == 22 + 2 * 6
    assert refusal(plain_file) == ""


def test_hinged_neighbours_may_not_touch_and_those_that_share_balls_do(good: Path, tmp_path: Path) -> None:
    def pairs(folder: Path) -> set[frozenset[str]]:
        return {frozenset((one.name, other.name)) for one, other in body_pairs(read_folder(folder))}

    shared = carried(tmp_path / "task").write(tmp_path / "shared")
    assert pairs(good) - pairs(shared) == {frozenset((f"finger{i}_link0", f"finger{i}_link1")) for i in range(3)}


@pytest.mark.parametrize("degrees", [90.0, 107.0, 109.0, 150.0])
def test_neighbours_overlap_once_they_are_folded_too_sharply(tmp_path: Path, degrees: float) -> None:
    # At a right angle and beyond, the near end of the second link's axis is nearest: a hinge times the turn's sine off.
    text = SPHERE.replace("hinge_length: 0", f"hinge_length: {HINGE}, link_length: [0.018, 0.1]")
    time = np.linspace(0.0, 1.0, 11)
    made = plain(read_task(tmp_path, text), time, 2)
    fingers = tuple(
        replace(finger, links=tuple(replace(link, hinge=HINGE) for link in finger.links))
        for finger in made.hand.fingers
    )
    angles = np.zeros((11, 4))
    angles[:, 1] = np.radians(degrees)
    folder = read_folder(
        replace(made, hand=replace(made.hand, fingers=fingers)).moved(joint_angles=angles).write(tmp_path / "f")
    )
    found = penetration_figure(folder, build_trajectory(folder, shoot(folder)))
    overlap = 2 * TIP - HINGE * np.sin(np.radians(degrees))
    assert found.value == pytest.approx(max(overlap, 0.0), abs=1e-8)
    assert ("finger 'left' (link 0) and finger 'left' (link 1) overlap" in found.text) == (degrees > 107.7)


def bar(start: float, end: float, radius: float) -> str:
    """A cylinder only to be seen, along a link's axis."""
    middle = 0.5 * (start + end)
    return (
        f"<visual><origin xyz='0 0 {middle}' rpy='0 0 0'/>"
        f"<geometry><cylinder radius='{radius}' length='{end - start}'/></geometry></visual>"
    )


LOOKS = r"link finger0_link0 looks other than it collides"
BEGINS = r"finger 'one' \(link 0\): it does not begin a hinge's length from its joint, as the task has it"
BALLS = r"the palm: its balls in hand\.urdf are not those in which result\.json has first joints turn"
FALSIFIED = {
    "a shorter hinge in result.json": (record(*STATED, value=0.9 * HINGE), BEGINS),
    "no hinge in result.json": (record(*STATED, drop=True), BEGINS),
    "a hinge of words": (record(*STATED, value="some"), BEGINS),
    "no hinge in the task": (task(f"hinge_length: {HINGE}", "hinge_length: 0"), BEGINS),
    "a longer hinge in the task": (task(f"hinge_length: {HINGE}", "hinge_length: 0.0135"), BEGINS),
    "a body from its joint on in hand.urdf": (
        edited(
            HAND,
            LINK + "//origin",
            lambda e, p: e.set("xyz", "0 0 0") if e.get("xyz", "").endswith(f"{HINGE}") else None,
            every=True,
        ),
        r"finger 'one' \(link 0\)|finger0_link0",
    ),
    "no balls on the palm": (
        edited(HAND, "link[@name='palm']", lambda e, p: unballed(e)),
        BALLS,
    ),
    "no balls that the palm is seen with": (
        edited(HAND, "link[@name='palm']", lambda e, p: unballed(e, "visual")),
        r"link palm looks other than it collides",
    ),
    "a smaller ball on the palm": (
        edited(HAND, "link[@name='palm']//sphere", lambda e, p: e.set("radius", "0.004"), every=True),
        BALLS,
    ),
    "no ball in the scene": (
        removed(SCENE, ".//geom[@name='palm_ball0']"),
        r"scene\.xml: the solids of the palm are not those of hand\.urdf",
    ),
    "a palm as light as without balls": (
        attribute(HAND, "link[@name='palm']//mass", "value", lambda v: str(float(v) - 1240 * 4 * np.pi * TIP**3)),
        r"the palm: .* kg is not its volume times the task's density",
    ),
    "a tongue as thick as its link": (added(HAND, LINK, bar(0.0, HINGE, TIP)), LOOKS),
    "a tongue into the link before": (added(HAND, LINK, bar(-1.1 * HINGE, HINGE, 0.5 * TIP)), LOOKS),
    "a tongue along the link": (added(HAND, LINK, bar(0.0, 1.1 * HINGE, 0.5 * TIP)), LOOKS),
    "a tongue that collides": (
        both(
            added(HAND, LINK, bar(0.0, HINGE, 0.5 * TIP).replace("visual", "collision")),
            added(HAND, LINK, bar(0.0, HINGE, 0.5 * TIP)),
        ),
        r"finger 'one' \(link 0\)|finger0_link0",
    ),
    "a ball for a tongue": (
        added(HAND, LINK, f"<visual><geometry><sphere radius='{0.5 * TIP}'/></geometry></visual>"),
        LOOKS,
    ),
    "a tongue in the palm": (added(HAND, "link[@name='palm']", bar(0.0, HINGE, 0.5 * TIP)), r"link palm looks other"),
}


def unballed(palm: Element, role: str = "") -> None:
    """Take the balls off the palm, as what collides, is seen or both."""
    for part in list(palm):
        if part.find("geometry/sphere") is not None and role in ("", part.tag):
            palm.remove(part)


@pytest.mark.parametrize("name", FALSIFIED)
def test_falsified_hinges_are_refused_and_named(good: Path, tmp_path: Path, name: str) -> None:
    falsify, named = FALSIFIED[name]
    folder = shutil.copytree(good, tmp_path / "bad")
    falsify(folder)
    said = refusal(folder)
    assert re.search(named, said), said
