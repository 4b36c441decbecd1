"""A result whose object was made of a mesh: what its convex parts hide is measured, and what is falsified is named."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh

from casadi_hands.errors import DesignError
from casadi_hands.export.meshes import mesh_files
from casadi_hands.export.urdf import object_urdf
from casadi_hands.task import load_task
from casadi_hands.task.mesh import MeshRecord
from casadi_hands.verify import audit_files
from casadi_hands.verify.checks.raw_mesh import raw_mesh_problems
from casadi_hands.verify.raw_mesh import RawMesh
from casadi_hands.verify.reading.folder import read_folder
from casadi_hands.verify.reading.robot import read_robot
from tests.documents import ROOT
from tests.verify.fixture import RADIUS, Scene, carried

RAW = "meshes/object_raw0.obj"
# Of a prism whose corners are in the order of the fixture's: three edges along z, lower end first.
FACES = [[0, 4, 2], [1, 3, 5], [0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3], [4, 0, 1], [4, 1, 5]]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return carried(tmp_path_factory.mktemp("task"), shape="convex")


def prism(scene: Scene, inward: float) -> np.ndarray:
    """Corners (6, 3) of the object's prism, its sides moved inward."""
    (shape,) = scene.task.object.shapes
    return np.array(shape.vertices) * [1 - inward / RADIUS, 1 - inward / RADIUS, 1]


def written(
    scene: Scene, folder: Path, inward: float, leaves_out: float = 0.0, adds: float = 0.0, faces: object = FACES
) -> Path:
    """A folder that says that the prism stands for one whose sides are further in."""
    record = MeshRecord(file="prism.stl", parts=1, leaves_out=leaves_out, adds=adds, first=0, raw=RAW)
    body = scene.task.object.model_copy(update={"meshes": (record,)})
    replace(scene, task=scene.task.model_copy(update={"object": body})).write(folder)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in prism(scene, inward).tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]  # type: ignore[attr-defined]
    (folder / RAW).write_text("\n".join(lines) + "\n")
    tree = ElementTree.parse(folder / "object.urdf")
    mesh = tree.find(".//visual//mesh")
    assert mesh is not None
    mesh.set("filename", RAW)
    tree.write(folder / "object.urdf")
    return folder


@pytest.mark.parametrize("inward", [0.0, 4e-4, -4e-4])
def test_gaps_and_overlaps_are_those_of_its_sides(scene: Scene, tmp_path: Path, inward: float) -> None:
    found = audit_files(written(scene, tmp_path / "made", inward, 2 * max(-inward, 0.0), 2 * max(inward, 0.0)))
    assert found.reasons == []
    gap, overlap = found.figures["gap_mesh"], found.figures["penetration_mesh"]
    assert gap.value == pytest.approx(abs(inward), abs=2e-6)
    assert overlap.value == pytest.approx(max(-inward, 0.0), abs=2e-6)
    assert (gap.limit, overlap.limit) == (None, None)
    assert re.search(r"contact '.*' is .* mm off the object's mesh at", gap.text) or gap.value < 1e-6


def test_an_object_without_a_mesh_has_no_such_figures(scene: Scene, tmp_path: Path) -> None:
    found = audit_files(scene.write(tmp_path / "made"))
    assert found.reasons == []
    assert "gap_mesh" not in found.figures


def test_what_is_seen_is_read_beside_what_collides(scene: Scene, tmp_path: Path) -> None:
    body = read_folder(written(scene, tmp_path / "made", 1e-3, adds=2e-3)).object
    (mesh,) = body.raw
    assert mesh.vertices == pytest.approx(prism(scene, 1e-3))
    assert body.unseen == body.shapes
    assert body.seen == ()


@pytest.mark.parametrize(
    ("inward", "named"),
    [
        (-2e-3, r"what is seen stands out of what collides by 4 mm, unstated"),
        (2e-3, r"what collides stands out of what is seen by 4 mm, unstated"),
    ],
)
def test_a_mesh_farther_off_than_the_task_says_is_named(
    scene: Scene, tmp_path: Path, inward: float, named: str
) -> None:
    reasons = "\n".join(audit_files(written(scene, tmp_path / "bad", inward, 1e-3, 1e-3)).reasons)
    assert re.search(named, reasons)


def test_a_mesh_that_the_task_does_not_tell_of_is_named(scene: Scene, tmp_path: Path) -> None:
    folder = written(scene, tmp_path / "bad", 0.0)
    text = (folder / "task.yaml").read_text()
    scene.write(tmp_path / "plain")
    (folder / "task.yaml").write_text((tmp_path / "plain" / "task.yaml").read_text())
    assert text != (folder / "task.yaml").read_text()
    assert "object.urdf shows 1 meshes, task.yaml tells of 0" in audit_files(folder).reasons


@pytest.mark.parametrize("faces", [[[0, 1, 6]] * 4, [[-1, 1, 2]] * 4, [[0, 1, 2]], [[10**30, 1, 2]] * 4])
def test_triangles_of_no_vertices_are_told(scene: Scene, tmp_path: Path, faces: list[list[int]]) -> None:
    with pytest.raises(DesignError, match=r"object_raw0\.obj: (not a mesh|a mesh has)"):
        audit_files(_unread(written(scene, tmp_path / "bad", 0.0, faces=faces)))


def _unread(folder: Path) -> Path:
    """The folder with a task that tells nothing of the mesh, whose file it would else find wrong first."""
    text = (folder / "task.yaml").read_text()
    assert RAW in text
    (folder / "task.yaml").write_text(re.sub(r"\n *raw: .*", "", text))
    return folder


def test_distances_of_segments_are_the_least_of_their_points(rng: np.random.Generator) -> None:
    torus = trimesh.creation.torus(0.05, 0.015, major_sections=24, minor_sections=12)
    proximity: Any = trimesh.proximity

    def from_points(points: np.ndarray) -> np.ndarray:
        return np.asarray(proximity.closest_point(torus, points)[1])

    mesh = RawMesh(np.array(torus.vertices), np.array(torus.faces))
    found = 0
    for _ in range(40):
        start, end = rng.uniform(-0.1, 0.1, (2, 3))
        shares = np.linspace(0, 1, 400)[:, None]
        distances = from_points(start + shares * (end - start))
        step = np.linalg.norm(end - start) / 399
        distance = mesh.distance(start, end)
        assert distances.min() - step <= distance <= distances.min() + 1e-6
        assert mesh.distance(start, start) == pytest.approx(from_points(start[None])[0], abs=1e-6)
        found += distance > 1e-3
    assert found > 10


def test_what_is_inside_is_what_trimesh_has_inside(rng: np.random.Generator) -> None:
    torus: Any = trimesh.creation.torus(0.05, 0.015, major_sections=24, minor_sections=12)
    points = rng.uniform([-0.07, -0.07, -0.02], [0.07, 0.07, 0.02], (300, 3))
    expected = trimesh.proximity.ProximityQuery(torus).signed_distance(points) > 0
    assert expected.sum() > 30
    assert (RawMesh(np.array(torus.vertices), np.array(torus.faces)).contains(points) == expected).all()


@pytest.mark.parametrize("name", ["mug", "hammer", "toy_brick"])
def test_objects_that_are_shipped_look_like_what_they_collide_as(name: str, tmp_path: Path) -> None:
    task = load_task(ROOT / "problems/objects" / f"{name}.yaml")
    (tmp_path / "meshes").mkdir()
    for file, text in {**mesh_files(task), "object.urdf": object_urdf(task)}.items():
        (tmp_path / file).write_text(text)
    found = read_robot(tmp_path / "object.urdf")
    body = found.links["object"]
    assert found.strange == ()
    assert body.raw
    assert body.unseen == body.shapes
    folder: Any = SimpleNamespace(object=body, task=task, length=task.object.characteristic_length)
    assert raw_mesh_problems(folder) == []
