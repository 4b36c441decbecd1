"""Meshes among the shapes of a task's object."""

from __future__ import annotations

import io
import pickle
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh

from casadi_hands.cli.task_summary import check_summary
from casadi_hands.errors import TaskError
from casadi_hands.export.meshes import mesh_files
from casadi_hands.export.page.robot import object_robot
from casadi_hands.export.urdf import object_urdf
from casadi_hands.geometry.hull import mass_moments
from casadi_hands.meshes import Mesh
from casadi_hands.task import Task, load_task, parse_task, task_to_yaml
from casadi_hands.task.raw_mesh import RawMesh
from tests.meshes.solids import angle, binary_stl, box, inverted, joined, without

TASK = """\
name: an angle
object:
  mass: 0.1
  shapes:
    - mesh: {file: parts/angle.stl, scale: 0.001}
palm: {radius: 0.06, position: [0, 0, 0.3], facing: [1, 0, 0]}
motion:
  - {at: 0, position: [0.075, 0, 0.3]}
  - {at: 2, position: [0.095, 0, 0.3]}
fingers:
  thumb: {touches: [0.02, 0, 0.02]}
  index: {touches: [0, 0.02, 0.02]}
"""


def millimetres(mesh: Mesh) -> bytes:
    return binary_stl(Mesh(1e3 * mesh.vertices, mesh.faces))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "angle.stl").write_bytes(millimetres(angle()))
    return tmp_path


def loaded(folder: Path, text: str = TASK, within: bool = False) -> Task:
    (folder / "task.yaml").write_text(text)
    return load_task(folder / "task.yaml", within=within)


def message(folder: Path, text: str = TASK, within: bool = False) -> str:
    with pytest.raises(TaskError) as caught:
        loaded(folder, text, within)
    return str(caught.value).removeprefix(f"{folder}/task.yaml:")


def test_a_mesh_becomes_its_convex_parts(folder: Path) -> None:
    task = loaded(folder)
    assert [shape.body.kind for shape in task.object.shapes] == ["convex", "convex"]
    assert sum(shape.body.volume for shape in task.object.shapes) == pytest.approx(angle().volume, rel=0.02)
    (record,) = task.object.meshes or ()
    assert (record.file, record.parts, record.mended) == ("angle.stl", 2, ())
    assert max(record.leaves_out, record.adds) < 4e-4


def test_it_is_weighed_as_the_solid_that_it_is(folder: Path) -> None:
    # Far from what its hull weighs, whose parts this is cut into.
    task = loaded(folder, TASK.replace("scale: 0.001", "scale: 0.001, parts: 1"))
    _, center, inertia = mass_moments(angle().corners)
    np.testing.assert_allclose(task.object.inertia, 0.1 * inertia, rtol=1e-6, atol=1e-12)
    corner = min((shape.body.bounding_box[0] for shape in task.object.shapes), key=lambda lower: float(lower[0]))
    np.testing.assert_allclose(corner, -center, atol=1e-7)


def test_mass_properties_may_be_given(folder: Path) -> None:
    given = "mass: 0.1\n  center_of_mass: [0.02, 0.01, 0.02]\n  inertia: [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4]]"
    task = loaded(folder, TASK.replace("mass: 0.1", given))
    np.testing.assert_array_equal(task.object.inertia, 1e-4 * np.eye(3))
    lower = np.min([shape.body.bounding_box[0] for shape in task.object.shapes], axis=0)
    np.testing.assert_allclose(lower, [-0.02, -0.01, -0.02], atol=1e-7)


def test_beside_other_shapes_it_counts_by_its_volume(folder: Path) -> None:
    ball = "\n    - sphere: {center: [0.1, 0, 0.02], radius: 0.01}"
    task = loaded(folder, TASK.replace("scale: 0.001}", "scale: 0.001, parts: 1}" + ball))
    volume, center, _ = mass_moments(angle().corners)
    sphere = 4 / 3 * np.pi * 0.01**3
    due = (volume * center + sphere * np.array([0.1, 0, 0.02])) / (volume + sphere)
    np.testing.assert_allclose(task.object.shapes[1].body.centroid, [0.1, 0, 0.02] - due, atol=1e-7)


def test_what_is_written_needs_no_file_and_loads_as_the_same_task(folder: Path) -> None:
    task = loaded(folder)
    text = task_to_yaml(task)
    (folder / "parts" / "angle.stl").unlink()
    assert parse_task(text) == task
    assert task_to_yaml(parse_task(text)) == text


def test_other_tasks_are_written_as_before(folder: Path) -> None:
    task = loaded(folder, re.sub("mesh: .*", "sphere: {center: [0.02, 0.02, 0.02], radius: 0.02}", TASK))
    assert "meshes" not in task_to_yaml(task)


def test_a_path_may_be_absolute_or_from_the_current_folder(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    absolute = loaded(folder, TASK.replace("parts/angle", f"{folder}/parts/angle"))
    assert absolute == loaded(folder)
    monkeypatch.chdir(folder)
    assert parse_task(TASK) == absolute


def test_check_tells_what_has_become_of_it(folder: Path) -> None:
    (folder / "parts" / "angle.stl").write_bytes(millimetres(inverted(angle())))
    group, _ = check_summary(loaded(folder))
    cells = [str(cell) for table in getattr(group, "renderables", ())[1:2] for cell in table.columns[1]._cells]
    (told,) = [cell for cell in cells if cell.startswith("angle.stl")]
    pattern = (
        r"angle\.stl: turned the surface inside out; 2 convex parts, which leave out up to .* mm and add up to .* mm"
    )
    assert re.fullmatch(pattern, told)
    assert any("2 polytopes" in cell for cell in cells)


REFUSED = {
    "in millimetres": (
        ", scale: 0.001",
        "",
        "5: object.shapes[0].mesh: given a mesh 40 m long; allowed: at most 5 m; is it in millimetres? `scale: 0.001`",
    ),
    "no such file": (
        "angle.stl",
        "angel.stl",
        "5: object.shapes[0].mesh: given '...angel.stl', which is not there; allowed: the path of an STL or OBJ file",
    ),
    "no file": (
        "file: parts/angle.stl, ",
        "",
        "5: object.shapes[0].mesh.file: given nothing; allowed: a value, it has no default: An STL...",
    ),
    "a number for a file": ("parts/angle.stl", "7", "5: object.shapes[0].mesh.file: given 7; allowed: text"),
    "unknown field": (
        "scale",
        "scales",
        "5: object.shapes[0].mesh.scales: given an unknown field; allowed: file, scale, parts, edge_radius, name; ...",
    ),
    "no parts": (
        "scale: 0.001",
        "scale: 0.001, parts: 0",
        "5: object.shapes[0].mesh.parts: given 0; allowed: a number of at least 1",
    ),
    "too many parts": (
        "scale: 0.001",
        "scale: 0.001, parts: 65",
        "5: object.shapes[0].mesh.parts: given 65; allowed: a number of at most 64",
    ),
    "scale of nothing": ("0.001", "0", "5: object.shapes[0].mesh.scale: given 0; allowed: a number greater than 0"),
    "edges too round": (
        "scale: 0.001",
        "scale: 0.001, edge_radius: 0.006",
        "4: object.shapes: given ...; allowed: for each mesh an edge_radius smaller than half the least width of ...",
    ),
    "another format": (
        "angle.stl",
        "angle.ply",
        "5: object.shapes[0].mesh: given 'angle.ply'; allowed: a file named *.stl or *.obj; ...",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_wrong_is_told_with_its_line(case: str, folder: Path) -> None:
    old, new, due = REFUSED[case]
    said = message(folder, TASK.replace(old, new, 1))
    assert re.fullmatch(re.escape(due).replace(r"\.\.\.", ".*"), said), said


def test_a_bad_mesh_is_told_with_its_line(folder: Path) -> None:
    (folder / "parts" / "angle.stl").write_bytes(millimetres(without(box(), 0, 1)))
    assert message(folder).startswith(
        "5: object.shapes[0].mesh: given an open surface: 1 hole, the largest 56.6 mm across;"
    )


def test_a_result_folder_reads_no_file_outside(folder: Path) -> None:
    inside = folder / "result"
    inside.mkdir()
    (inside / "near.stl").write_bytes(millimetres(joined(angle())))
    (inside / "link.stl").symlink_to(folder / "parts" / "angle.stl")
    assert loaded(inside, TASK.replace("parts/angle", "near"), within=True) == loaded(folder).model_copy(
        update={"object": loaded(inside, TASK.replace("parts/angle", "near")).object}
    )
    for outside in ("../parts/angle.stl", f"{folder}/parts/angle.stl", "link.stl", "../../etc/passwd.stl"):
        said = message(inside, TASK.replace("parts/angle.stl", outside), within=True)
        allowed = "a file in the task's own folder: a result folder holds all that it needs"
        assert said == f"5: object.shapes[0].mesh: given {outside!r}; allowed: {allowed}"


def of_angle(folder: Path, text: str = TASK) -> RawMesh:
    """The raw mesh of the only one in a task."""
    (record,) = loaded(folder, text).object.meshes or ()
    assert record.raw_mesh is not None
    return record.raw_mesh


def test_the_mesh_is_kept_as_it_was_before_it_was_cut(folder: Path) -> None:
    raw = of_angle(folder)
    volume, center, _ = mass_moments(angle().corners)
    found, origin, _ = mass_moments(raw.vertices[raw.faces])
    assert found == pytest.approx(volume, rel=1e-6)
    np.testing.assert_allclose(origin, 0, atol=1e-9)  # of the object's frame
    np.testing.assert_allclose(raw.vertices.min(axis=0), angle().vertices.min(axis=0) - center, atol=1e-7)


def test_a_folder_with_the_mesh_beside_its_task_knows_it_again(folder: Path, tmp_path: Path) -> None:
    task = loaded(folder)
    result = tmp_path / "result"
    (result / "meshes").mkdir(parents=True)
    (result / "task.yaml").write_text(task_to_yaml(task))
    for name, text in mesh_files(task).items():
        (result / name).write_text(text)
    again = load_task(result / "task.yaml", within=True)
    assert again == task
    assert (again.object.meshes or ())[0].raw_mesh is not None
    assert mesh_files(again) == mesh_files(task)
    assert object_urdf(again) == object_urdf(task)
    (result / "meshes" / "object_raw0.obj").unlink()
    assert load_task(result / "task.yaml", within=True) == task
    (result / "meshes" / "object_raw0.obj").write_text("v 0 0\n")
    with pytest.raises(TaskError, match=r"object\.meshes\[0\].*: given "):
        load_task(result / "task.yaml", within=True)


def test_it_looks_like_the_mesh_and_collides_as_its_parts(folder: Path) -> None:
    ball = "\n    - sphere: {center: [0.02, 0.02, 0.02], radius: 0.015}"
    task = loaded(folder, TASK.replace("scale: 0.001}", "scale: 0.001}" + ball))
    link = ElementTree.fromstring(object_urdf(task)).find("link")
    assert link is not None
    names = {
        role: sorted(mesh.get("filename", "") for mesh in link.findall(f"{role}/geometry/mesh"))
        for role in ("visual", "collision")
    }
    assert names["visual"] == ["meshes/object_raw0.obj"]
    assert names["collision"] == ["meshes/object0.obj", "meshes/object1.obj"]
    assert len(link.findall("visual/geometry/sphere")) == len(link.findall("collision/geometry/sphere")) == 1
    raw: Any = trimesh.load(io.StringIO(mesh_files(task)["meshes/object_raw0.obj"]), file_type="obj", process=True)
    assert raw.is_watertight
    assert raw.volume == pytest.approx(angle().volume, rel=1e-6)
    (_, drawn) = sorted(object_robot(task).shapes, key=lambda shape: shape.mesh is not None)
    assert drawn.mesh is not None
    assert len(drawn.mesh[1]) == len(angle().faces)


@pytest.mark.parametrize("shape", ["sphere", "capsule", "box", "cylinder", "mesh"])
def test_tasks_of_any_shape_go_to_other_processes(shape: str, folder: Path) -> None:
    given = {
        "sphere": "{center: [0, 0, 0], radius: 0.02}",
        "capsule": "{start: [0, 0, -0.01], end: [0, 0, 0.01], radius: 0.02}",
        "box": "{center: [0, 0, 0], size: [0.04, 0.04, 0.04]}",
        "cylinder": "{start: [0, 0, -0.01], end: [0, 0, 0.01], radius: 0.02}",
        "mesh": "{file: parts/angle.stl, scale: 0.001}",
    }[shape]
    text = TASK[: TASK.index("fingers:")].replace("mesh: {file: parts/angle.stl, scale: 0.001}", f"{shape}: {given}")
    task = loaded(folder, text + "fingers: 3\n")
    again = pickle.loads(pickle.dumps(task))
    assert again == task
    assert all((each.raw_mesh is not None) for each in again.object.meshes or ())
