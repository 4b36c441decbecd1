"""A result whose object is a polytope: what the audit says of it, what is falsified, and how it is replayed."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from casadi_hands.verify import audit_files, replay
from casadi_hands.verify.audit import audit
from casadi_hands.verify.flat import Convex
from casadi_hands.verify.reading.folder import read_folder
from tests.verify.falsify import OBJECT, SCENE, Falsify, attribute, record
from tests.verify.fixture import Scene, carried

GEOM, MESH = ".//body[@name='object']/geom", "asset/mesh"


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return carried(tmp_path_factory.mktemp("task"), shape="convex")


@pytest.fixture(scope="module")
def good(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return scene.write(tmp_path_factory.mktemp("good"))


def test_it_is_certified(good: Path) -> None:
    assert audit(good, replays=0).reasons == []
    (shape,) = read_folder(good).object.shapes
    assert isinstance(shape, Convex)
    assert len(shape.corners) == 6


def _mesh(change: Callable[[str], str]) -> Falsify:
    def falsify(folder: Path) -> None:
        path = folder / "meshes" / "0.obj"
        path.write_text(change(path.read_text()))

    return falsify


def _gone(folder: Path) -> None:
    (folder / "meshes" / "0.obj").unlink()


def _outside(folder: Path) -> None:
    (folder / "meshes" / "0.obj").rename(folder.parent / "outside.obj")
    (folder / "meshes" / "0.obj").symlink_to(folder.parent / "outside.obj")


@pytest.mark.parametrize(
    ("falsify", "named"),
    [
        (_mesh(lambda text: text.replace("0.03", "0.031")), r"not the shapes of task"),
        (_mesh(lambda text: text + "v 0 0 0.04\n"), r"not the shapes of task"),
        (record("object", "shapes", 0, "vertices", 2, 1, value=0.04), r"shapes: those of result\.json"),
        (record("object", "shapes", 0, "edge_radius", drop=True), r"shapes: those of result\.json"),
        (record("object", "shapes", 0, "type", value="box"), r"shapes: those of result\.json"),
        (attribute(SCENE, GEOM, "type", "capsule"), r"fromto|solids of the object"),
        (attribute(SCENE, GEOM, "pos", "0 0 0.01"), r"no attribute pos there"),
        (attribute(SCENE, GEOM, "quat", "0 1 0 0"), r"no attribute quat there"),
        (attribute(SCENE, MESH, "scale", "2 2 2"), r"scale"),
        (attribute(SCENE, MESH, "vertex", "0 0 0 1 0 0 0 1 0 0 0 1"), r"scene\.xml: the solids of the object"),
    ],
)
def test_what_it_is_not_is_named(good: Path, tmp_path: Path, falsify: Falsify, named: str) -> None:
    bad = shutil.copytree(good, tmp_path / "bad")
    falsify(bad)
    assert re.search(named, "\n".join(_reasons(bad)))


@pytest.mark.parametrize(
    ("falsify", "named"),
    [
        (_gone, r"missing"),
        (_outside, r"leads out of the folder"),
        (_mesh(lambda text: "v 0 0 0\n" * 5), r"lie in one plane"),
        (_mesh(lambda text: text.replace("v ", "v nan ", 1)), r"not a mesh|finite"),
        (attribute(OBJECT, ".//mesh", "filename", "../outside.obj"), r"no \.obj file within the folder"),
        (attribute(OBJECT, ".//mesh", "filename", "/etc/passwd"), r"no \.obj file within the folder"),
    ],
)
def test_a_mesh_that_cannot_be_read_is_told(good: Path, tmp_path: Path, falsify: Falsify, named: str) -> None:
    bad = shutil.copytree(good, tmp_path / "bad", symlinks=True)
    falsify(bad)
    assert re.search(named, "\n".join(_reasons(bad)))


def _reasons(folder: Path) -> list[str]:
    from casadi_hands.errors import DesignError

    try:
        return audit_files(folder).reasons
    except DesignError as error:
        return [str(error)]


def test_a_good_grasp_carries_it_in_both_engines(good: Path) -> None:
    mujoco, drake = replay(good), replay(good, engine="drake")
    for found in (mujoco, drake):
        assert not found.dropped
        assert found.lost_contacts == ()
    assert drake.position_mean == pytest.approx(mujoco.position_mean, abs=1e-3)
    assert np.isfinite(mujoco.angle_mean)
