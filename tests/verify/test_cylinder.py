"""A result whose object is a cylinder: what the audit says of it, and how it is replayed."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from casadi_hands.verify import audit_files, replay
from casadi_hands.verify.audit import audit
from casadi_hands.verify.reading.folder import read_folder
from casadi_hands.verify.shapes import Cylinder
from tests.verify.falsify import OBJECT, SCENE, Falsify, attribute, edited, record
from tests.verify.fixture import Scene, carried

GEOM = ".//body[@name='object']/geom"


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return carried(tmp_path_factory.mktemp("task"), shape="cylinder")


@pytest.fixture(scope="module")
def good(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return scene.write(tmp_path_factory.mktemp("good"))


def test_it_is_certified(good: Path) -> None:
    assert audit(good, replays=0).reasons == []
    folder = read_folder(good)
    (shape,) = folder.object.shapes
    assert isinstance(shape, Cylinder)
    # Turned about no axis, half its largest extent is half its length.
    assert folder.length == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("falsify", "named"),
    [
        (edited(OBJECT, ".//cylinder", lambda e, p: e.set("length", "0.05"), every=True), r"not the shapes of task"),
        (
            edited(OBJECT, ".//cylinder", lambda e, p: e.set("radius", "0.019"), every=True),
            r"shape that is not in task",
        ),
        (record("object", "shapes", 0, "end", 2, value=0.04), r"shapes: those of result\.json"),
        (record("object", "shapes", 0, "radius", value=0.03), r"shapes: those of result\.json"),
        (record("object", "shapes", 0, "edge_radius", value=0.01), r"shapes: those of result\.json"),
        (record("object", "shapes", 0, "edge_radius", drop=True), r"shapes: those of result\.json"),
        (record("object", "shapes", 0, "type", value="capsule"), r"shapes: those of result\.json"),
        (record("object", "shapes", 0, "type", value=["cylinder"]), r"shapes: those of result\.json"),
        (attribute(SCENE, GEOM, "type", "capsule"), r"scene\.xml: the solids of the object"),
        (attribute(SCENE, GEOM, "size", "0.019"), r"scene\.xml: the solids of the object"),
        (attribute(SCENE, GEOM, "fromto", "0 0 -0.03 0 0.001 0.03"), r"scene\.xml: the solids of the object"),
    ],
)
def test_what_it_is_not_is_named(good: Path, tmp_path: Path, falsify: Falsify, named: str) -> None:
    bad = shutil.copytree(good, tmp_path / "bad")
    falsify(bad)
    assert re.search(named, "\n".join(audit_files(bad).reasons))


def test_contacts_off_its_side_are_seen(scene: Scene, tmp_path: Path) -> None:
    points = 1.01 * scene.motion.contact_point_object
    found = audit_files(scene.moved(contact_point_object=points).write(tmp_path))
    # Radii grow by 0.2 mm, and the object's and the fingers' points are as far apart.
    assert found.figures["gap"].value == pytest.approx(np.linalg.norm([2e-4, 4e-5]), rel=1e-6)


def test_a_good_grasp_carries_it_in_both_engines(good: Path) -> None:
    mujoco = replay(good)
    assert not mujoco.dropped
    assert mujoco.lost_contacts == ()
    drake = replay(good, engine="drake")
    assert not drake.dropped
    assert drake.lost_contacts == ()
    assert drake.position_mean == pytest.approx(mujoco.position_mean, abs=1e-3)
    assert drake.angle_mean == pytest.approx(mujoco.angle_mean, abs=1.0)
