"""Convex parts: what coacd makes of solids, kept on disk."""

from __future__ import annotations

import pickle
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from casadi_hands.errors import MeshError
from casadi_hands.meshes import Mesh, convex_parts, kept, mend, parts
from casadi_hands.meshes.topology import edges_of
from tests.meshes.solids import angle, ball, box, subdivided

pytest.importorskip("coacd")


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CASADI_HANDS_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def never(*_: Any) -> Any:
    raise AssertionError("cut again")


def same(one: Mesh, other: Mesh) -> bool:
    return np.array_equal(one.vertices, other.vertices) and np.array_equal(one.faces, other.faces)


def test_a_convex_mesh_is_one_part_of_its_corners(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "_cut", never)
    found = convex_parts(subdivided(box(), 3), 8)
    assert [len(part.vertices) for part in found.parts] == [8]
    assert found.error == pytest.approx(0, abs=1e-6)


def test_an_angle_is_two_boxes() -> None:
    found = convex_parts(angle(), 8)
    assert [len(part.vertices) for part in found.parts] == [8, 8]
    assert sum(part.volume for part in found.parts) == pytest.approx(angle().volume, rel=0.02)
    assert found.error < 4e-4
    assert str(found).startswith("2 convex parts, which leave out up to ")
    assert all(not edges_of(part.faces).balance.any() for part in found.parts)


def test_a_round_one_has_few_corners_and_says_what_that_costs() -> None:
    fine = ball(0.02, 24)
    found = convex_parts(fine, 8)
    assert len(found.parts) == 1
    assert len(found.parts[0].vertices) == 96
    # Were they as even as a hexagonal lattice, with a circumradius of 0.2245 rad, faces would be 2.5 % too near.
    assert (1 - np.cos(0.2245)) * 0.02 < found.missing < 2 * (1 - np.cos(0.2245)) * 0.02
    assert found.added == pytest.approx(0, abs=1e-6)


def test_as_few_parts_as_asked_for() -> None:
    found = convex_parts(angle(), 1)
    assert len(found.parts) == 1
    # The hull bridges the corner; see `tests/meshes/test_geometry.py`.
    assert found.added == pytest.approx(0.015, rel=0.05)


def test_the_same_mesh_is_cut_the_same_way_and_only_once(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = convex_parts(angle(), 8)
    for file in (cache / "meshes").iterdir():
        file.unlink()
    again = convex_parts(angle(), 8)
    monkeypatch.setattr(parts, "_cut", never)
    read = convex_parts(angle(), 8)
    for other in (again, read):
        assert all(same(a, b) for a, b in zip(first.parts, other.parts, strict=True))
        assert (other.missing, other.added) == (first.missing, first.added)
    with pytest.raises(AssertionError, match="cut again"):
        convex_parts(angle(), 7)
    with pytest.raises(AssertionError, match="cut again"):
        convex_parts(Mesh(angle().vertices * 1.001, angle().faces), 8)


def spoilt(file: Path, how: str) -> None:
    content = file.read_bytes()
    if how == "cut off":
        file.write_bytes(content[: len(content) // 2])
    if how == "text":
        file.write_text("nothing")
    if how == "a pickle":
        file.write_bytes(pickle.dumps(Never()))
    if how == "an array of objects":
        np.savez(file, key=np.array(file.stem), error=np.array([Never()], dtype=object))
    if how == "another's":
        np.savez(file, key=np.array("another"), error=np.zeros(2), part0=box().vertices)
    if how == "writable by all":
        np.savez(file, key=np.array(file.stem), error=np.zeros(2), part0=box().vertices)
        file.chmod(0o666)


class Never:
    """Fails the test where it is unpickled."""

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        return pytest.fail, ("what was kept has been run",)


@pytest.mark.parametrize("how", ["cut off", "text", "a pickle", "an array of objects", "another's", "writable by all"])
def test_what_others_put_there_is_not_taken(how: str, cache: Path) -> None:
    found = convex_parts(box(), 8)
    (file,) = (cache / "meshes").glob("*.npz")
    spoilt(file, how)
    again = convex_parts(box(), 8)
    assert same(found.parts[0], again.parts[0])
    assert kept.load(file.stem) is not None


def test_nothing_is_kept_where_nothing_can_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("CASADI_HANDS_CACHE", str(tmp_path / "file"))
    assert len(convex_parts(box(), 8).parts) == 1


def without(library: str) -> Any:
    def load(name: str) -> Any:
        if name == library:
            raise ImportError(name)
        return import_module(name)

    return load


def test_without_the_extra_one_message_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    install = "installed: pip install 'casadi-hands[mesh]'"
    monkeypatch.setattr("casadi_hands.meshes.extra.import_module", without("coacd"))
    with pytest.raises(MeshError) as caught:
        convex_parts(angle(), 8)
    assert str(caught.value) == f"given a mesh that is not convex; allowed: with coacd {install}"
    assert len(convex_parts(box(), 8).parts) == 1
    monkeypatch.setattr("casadi_hands.meshes.extra.import_module", without("fast_simplification"))
    with pytest.raises(MeshError, match="given a mesh of 196608 faces; allowed: with fast-simplification installed"):
        mend(subdivided(box(), 7))


def test_a_cut_that_fails_or_takes_too_long_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "_CUT", "raise SystemExit('no way')")
    with pytest.raises(MeshError, match=r"given a mesh that coacd cannot cut into convex parts \(no way\)"):
        convex_parts(angle(), 8)
    monkeypatch.setattr(parts, "_CUT", "import os; os.abort()")
    with pytest.raises(MeshError, match="given a mesh that coacd cannot cut into convex parts"):
        convex_parts(angle(), 8)
    monkeypatch.setattr(parts, "_CUT", "import time; time.sleep(60)")
    monkeypatch.setattr(parts, "_LONGEST", 0.5)
    with pytest.raises(MeshError, match="given a mesh of 20 faces that coacd has not cut into convex parts"):
        convex_parts(angle(), 8)
