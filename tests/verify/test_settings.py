"""How MuJoCo computes contacts, against what it says itself."""

from pathlib import Path

import mujoco
import pytest

from casadi_hands.verify.checks.settings import _eases, rubber_time
from casadi_hands.verify.reading.folder import read_folder
from tests.verify.fixture import carried


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return carried(tmp_path_factory.mktemp("task")).write(tmp_path_factory.mktemp("folder"))


def test_links_are_moved_as_easily_as_mujoco_says(folder: Path) -> None:
    """The palm is a free body, which moves along."""
    model, read = mujoco.MjModel.from_xml_path(str(folder / "scene.xml")), read_folder(folder)
    eases = _eases(read, True)
    assert set(eases) == set(read.links) - {"palm"}
    for name, ease in eases.items():
        assert ease == pytest.approx(model.body(name).invweight0[0], rel=1e-6)
    held = _eases(read, False)
    assert all(held[name] < ease for name, ease in eases.items())


def test_the_scene_has_the_time_that_rubber_takes(folder: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    assert model.geom_solref[:, 0] == pytest.approx(rubber_time(read_folder(folder), True), rel=1e-6)
