from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from ruamel.yaml import YAML
from vary import CONTACT, Change, fingertips_fit, scaled_turn, varied, write_variation

from casadi_hands.task import Task, load_task, parse_task

PROBLEMS = sorted((Path(__file__).parents[2] / "problems").glob("*.yaml"))
GROUND = [file for file in PROBLEMS if load_task(file).ground is not None]
DRAWING = [file for file in PROBLEMS if load_task(file).draws]


def name_of(file: Path) -> str:
    return file.stem


def raw(file: Path) -> dict[str, Any]:
    data: dict[str, Any] = YAML(typ="safe").load(file)
    return data


def axis_points(shape: dict[str, Any], count: int = 20001) -> tuple[np.ndarray, float]:
    """Points along a primitive's axis, and its radius."""
    ((_, fields),) = shape.items()
    start = np.array(fields.get("start", fields.get("center")))
    end = np.array(fields.get("end", fields.get("center")))
    return start + np.linspace(0, 1, count)[:, None] * (end - start), fields["radius"]


def from_surface(data: dict[str, Any], point: list[float]) -> tuple[float, np.ndarray]:
    """Distance of a point from the nearest primitive's surface, and the direction out of its axis: by search."""
    found = []
    for shape in data["object"]["shapes"]:
        points, radius = axis_points(shape)
        away = np.array(point) - points
        nearest = np.linalg.norm(away, axis=1).argmin()
        length = float(np.linalg.norm(away[nearest]))
        found.append((length - radius, away[nearest] / length))
    return min(found, key=lambda pair: abs(pair[0]))


def lowest(task: Task, number: int) -> float:
    """Height of the object's lowest point at a goal."""
    _, position, vector = task.goal_poses()[number]
    rotation = pin.exp3(vector)
    raised = (
        float((position + rotation @ p)[2]) - s.body.radius for s in task.object.shapes for p in s.body.edges()[0]
    )
    return min(raised)


@pytest.mark.parametrize("file", PROBLEMS, ids=name_of)
def test_variation_is_a_task_like_the_first(file: Path, tmp_path: Path) -> None:
    for number in (1, 2):
        made, change = write_variation(file, number, 0, tmp_path)
        old, new = load_task(file), load_task(made)
        assert new.object.mass / old.object.mass == pytest.approx(change.mass, rel=1e-6)
        assert new.object.characteristic_length / old.object.characteristic_length == pytest.approx(
            change.size, rel=1e-6
        )
        assert 0.8 <= change.size <= 1.2
        assert 0.7 <= change.mass <= 1.3
        assert 0.8 <= change.goal <= 1.2
        assert list(new.fingers) == list(old.fingers)
        assert [goal.at for goal in new.motion] == [goal.at for goal in old.motion]
        assert fingertips_fit(new)


@pytest.mark.parametrize("file", PROBLEMS, ids=name_of)
def test_contacts_stay_on_the_surface_and_near_where_they_were(file: Path, tmp_path: Path) -> None:
    made, change = write_variation(file, 3, 0, tmp_path)
    old, new = raw(file), raw(made)
    moved = []
    for name, finger in new["fingers"].items():
        distance, out = from_surface(new, finger["touches"])
        assert abs(distance) < 1e-7
        _, before = from_surface(old, old["fingers"][name]["touches"])
        angle = np.degrees(np.arccos(np.clip(before @ out, -1, 1)))
        assert angle < CONTACT + 1.0
        moved.append(angle)
    assert max(moved) > 0.1
    assert max(abs(degrees) for degrees, _ in change.contacts.values()) <= CONTACT


def test_variation_is_fixed_by_file_seed_and_number(tmp_path: Path) -> None:
    file = PROBLEMS[0]
    first, again = (write_variation(file, 2, 5, tmp_path / name)[0].read_bytes() for name in ("a", "b"))
    assert first == again
    others = [write_variation(file, 3, 5, tmp_path / "c"), write_variation(file, 2, 6, tmp_path / "d")]
    others.append(write_variation(PROBLEMS[1], 2, 5, tmp_path / "e"))
    assert len({write_variation(file, 2, 5, tmp_path)[1].size, *(change.size for _, change in others)}) == 4


@pytest.mark.parametrize("file", GROUND, ids=name_of)
def test_object_rests_on_the_ground_where_it_rested(file: Path, tmp_path: Path) -> None:
    old = load_task(file)
    assert old.ground is not None
    rested = 0
    for number in range(1, 4):
        made, change = write_variation(file, number, 0, tmp_path)
        new = load_task(made)
        for goal in range(len(old.motion)):
            before, after = lowest(old, goal) - old.ground.height, lowest(new, goal) - old.ground.height
            rests = abs(before) < 1e-4
            assert after == pytest.approx(0.0 if rests else change.goal * before, abs=1e-8)
            rested += rests
    assert rested >= 3
    assert len(GROUND) >= 4


@pytest.mark.parametrize("file", DRAWING, ids=name_of)
def test_drawing_keeps_its_shape(file: Path, tmp_path: Path) -> None:
    made, change = write_variation(file, 1, 0, tmp_path)
    old, new = (np.array([goal.tool_at for goal in load_task(each).motion]) for each in (file, made))
    np.testing.assert_allclose(new - new[0], change.goal * (old - old[0]), atol=1e-8)
    np.testing.assert_allclose(load_task(made).tool, change.size * np.array(load_task(file).tool), atol=1e-8)


def test_displacements_turns_and_the_palms_way_are_scaled() -> None:
    text = """
object: {mass: 0.1, shapes: [{capsule: {start: [0, 0, 0], end: [0, 0, 0.04], radius: 0.02}}]}
palm:
  position: [0, 0, 0.3]
  facing: [1, 0, 0]
  motion: [{at: 2, position: [0, 0.1, 0.3]}]
motion:
  - {at: 0, position: [0.1, 0, 0.3]}
  - {at: 2, position: [0.1, 0.1, 0.3], rotation: {axis: [0, 0, 1], degrees: -200}}
fingers: {left: {touches: [0, 0.02, 0.02]}, right: {touches: [0, -0.02, 0.02]}}
"""
    data = YAML(typ="safe").load(text)
    change = Change(1.1, 0.8, 1.2, 0.9, {"left": (0.0, 0.0), "right": (0.0, 0.0)})
    made = varied(data, change)
    assert data == YAML(typ="safe").load(text)
    np.testing.assert_allclose(made["motion"][1]["position"], [0.1, 0.12, 0.3])
    assert made["palm"]["motion"][0]["position"] == [0.0, 0.12, 0.3]
    rotation = made["motion"][1]["rotation"]
    np.testing.assert_allclose(np.array(rotation["axis"]) * rotation["degrees"], [0, 0, -180.0])
    np.testing.assert_allclose(made["fingers"]["left"]["touches"], [0, 0.022, 0.022], atol=1e-9)
    assert made["object"]["mass"] == pytest.approx(0.08)
    assert parse_task(str(made).replace("'", '"')).object.characteristic_length == pytest.approx(1.1 * 0.04)


def test_turn_about_another_axis_is_scaled_from_the_first_orientation() -> None:
    random = np.random.default_rng(3)
    for _ in range(20):
        first, vector = random.uniform(-1, 1, (2, 3))
        made = scaled_turn(first, vector, 0.8)
        whole, part = (pin.log3(pin.exp3(each) @ pin.exp3(first).T) for each in (vector, made))
        np.testing.assert_allclose(part, 0.8 * whole, atol=1e-9)


def test_fingertips_that_overlap_or_reach_into_the_ground_do_not_fit() -> None:
    text = """
object: {{mass: 0.1, shapes: [{{sphere: {{center: [0, 0, 0], radius: 0.02}}}}]}}
palm: {{position: [0, 0, 0.2], facing: [0, 0, -1]}}
motion: [{{at: 0, position: [0, 0, {z}]}}, {{at: 1, position: [0, 0, 0.06]}}]
ground: {{height: 0}}
hand: {{link_radius: 0.006}}
fingers: {{a: {{touches: [0, 0.02, 0]}}, b: {{touches: {b}}}}}
"""

    def fits(z: float, b: list[float]) -> bool:
        return fingertips_fit(parse_task(text.format(z=z, b=[float(x) for x in b])))

    # On a sphere of 0.02 m, tips of 0.006 m have their middles at 0.026 m: 26.7 degrees keep them apart.
    assert fits(0.02, [0, -0.02, 0])
    assert fits(0.02, [0.02 * np.sin(np.radians(27)), 0.02 * np.cos(np.radians(27)), 0])
    assert not fits(0.02, [0.02 * np.sin(np.radians(26)), 0.02 * np.cos(np.radians(26)), 0])
    # 0.02 - 0.026 sin a = 0.006 at a = 32.6 degrees below the equator.
    assert fits(0.02, [0, -0.02 * np.cos(np.radians(32)), -0.02 * np.sin(np.radians(32))])
    assert not fits(0.02, [0, -0.02 * np.cos(np.radians(34)), -0.02 * np.sin(np.radians(34))])
    assert fits(0.04, [0, -0.02 * np.cos(np.radians(34)), -0.02 * np.sin(np.radians(34))])
