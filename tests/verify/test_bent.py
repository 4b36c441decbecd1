"""A hand of bent links: certified and replayed as it is, and refused where files or task say otherwise."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.verify.audit import audit
from tests.verify.falsify import HAND, JOINT, SCENE, Falsify, attribute, both, edited, record, refusal, task
from tests.verify.fixture import Scene, carried

Array = np.ndarray


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return carried(tmp_path_factory.mktemp("task"), bent=True)


@pytest.fixture(scope="module")
def good(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return scene.write(tmp_path_factory.mktemp("good"))


def angles_beside(scene: Scene, finger: int) -> tuple[float, float, float]:
    """Degrees: bend of a finger's last link, its joint's axis from it, and from the link before; by Rodrigues."""
    link = scene.hand.fingers[finger].links[1]
    size = np.linalg.norm(link.bend)
    x, y = np.array(link.bend) / size
    cross = np.array([[0, 0, y], [0, 0, -x], [-y, x, 0]])
    turn = np.eye(3) + np.sin(size) * cross + (1 - np.cos(size)) * cross @ cross
    cosines = [turn[2, 2], abs(link.axis[2]), abs((turn @ link.axis)[2])]
    bend, own, before = np.degrees(np.arccos(cosines)).tolist()
    return bend, own, before


def test_a_hand_of_bent_links_is_certified(scene: Scene, good: Path) -> None:
    assert refusal(good) == ""
    # Bends about other ways than the joints' axes, so that the order of turns counts.
    for finger in scene.hand.fingers:
        for link in finger.links:
            assert np.linalg.norm(np.cross([*link.bend, 0.0], link.axis)) > 0.1


def test_it_is_held_when_replayed(good: Path) -> None:
    found = audit(good, replays=1)
    assert found.reasons == []


@pytest.mark.parametrize("finger", range(3))
def test_bend_and_angles_of_the_axis_are_measured(scene: Scene, good: Path, tmp_path: Path, finger: int) -> None:
    bend, own, before = angles_beside(scene, finger)
    assert own == pytest.approx(90, abs=1e-9)
    assert 60 < before < 80
    for more, holds in ((0.01, True), (-0.01, False)):
        folder = shutil.copytree(good, tmp_path / f"bend{more}")
        task("bend: 90.0", f"bend: {bend + more}")(folder)
        said = refusal(folder)
        named = f"finger '{scene.hand.fingers[finger].name}' (link 1) is bent by {bend:.4g}° from the link before"
        assert (named in said) == (not holds), said
        folder = shutil.copytree(good, tmp_path / f"least{more}")
        axes(f"[{before - more}, 90.0]")(folder)
        said = refusal(folder)
        named = f"its joint's axis stands {before:.4g}° from the link before; the task allows {before - more:g}° to 90°"
        assert (named in said) == (not holds), said
    folder = shutil.copytree(good, tmp_path / "largest")
    axes("[60.0, 89.9]")(folder)
    assert "its joint's axis stands 90° from it; the task allows 60° to 89.9°" in refusal(folder)


def axes(allowed: str) -> Falsify:
    """Let the task allow other angles of axes, degrees."""
    return task("from_link: [60.0, 90.0]", f"from_link: {allowed}")


STATED = ("hand", "fingers", 0, "links", 1, "bend")
TURNED = r"finger 'one' \(link 1\): its frame in hand\.urdf is not turned at zero angle as result\.json has it bent"
FALSIFIED = {
    "a bend in result.json": (record(*STATED, value=lambda b: [b[0] + 1e-4, b[1]]), TURNED),
    "a bend the other way": (record(*STATED, value=lambda b: [-b[0], -b[1]]), TURNED),
    "no bend in result.json": (record(*STATED, drop=True), TURNED),
    "a bend of three numbers": (record(*STATED, value=[0.1, 0.2, 0.0]), r"result\.json states no bend of two numbers"),
    "a bend of words": (record(*STATED, value="little"), r"result\.json states no bend of two numbers"),
    "a turn in hand.urdf": (attribute(HAND, JOINT + "/origin", "rpy", "0.1 0 0"), TURNED),
    "no turn in hand.urdf": (attribute(HAND, JOINT + "/origin", "rpy", None), TURNED),
    "a turn about the link in hand.urdf": (
        lambda folder: attribute(HAND, JOINT + "/origin", "rpy", twisted)(folder),
        TURNED,
    ),
    "straight links only": (
        task("bend: 90.0", "bend: 0"),
        r"finger 'one' \(link 0\) is bent by \d+(\.\d+)?° from the link before; the task allows 0°",
    ),
    "an axis along its link": (
        both(
            attribute(HAND, JOINT + "/axis", "xyz", "0 0 1"),
            record("hand", "fingers", 0, "links", 1, "axis", value=[0.0, 0.0, 1.0]),
        ),
        r"finger 'one' \(link 1\): its joint's axis stands 0° from it; the task allows 60° to 90°",
    ),
    "an axis of the URDF alone": (
        attribute(HAND, JOINT + "/axis", "xyz", "0 0 1"),
        r"finger 'one' \(link 1\): its axis in hand\.urdf is not that of result\.json",
    ),
    "a link straight in the scene": (
        edited(SCENE, ".//body[@name='finger0_link1']", lambda e, p: e.set("quat", "1 0 0 0")),
        r"finger0_link1|finger 'one' \(link 1\)",
    ),
}


def twisted(rpy: str) -> str:
    turn = Rotation.from_euler("xyz", [float(word) for word in rpy.split()]) * Rotation.from_rotvec([0, 0, 1e-3])
    return " ".join(map(str, turn.as_euler("xyz")))


@pytest.mark.parametrize("name", FALSIFIED)
def test_falsified_bends_are_refused_and_named(good: Path, tmp_path: Path, name: str) -> None:
    falsify, named = FALSIFIED[name]
    folder = shutil.copytree(good, tmp_path / "bad")
    falsify(folder)
    said = refusal(folder)
    assert re.search(named, said), said
