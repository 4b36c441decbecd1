"""A palm that the program places: against coal, closed forms and a score counted one by one."""

from __future__ import annotations

from typing import Any

import coal
import numpy as np
import pytest
from scipy.spatial.transform import Rotation as ScipyRotation

from casadi_hands.errors import TaskError
from casadi_hands.task import Task, load_task, parse_task, task_to_yaml
from casadi_hands.task.palm_place import ROOM, directions, standing
from casadi_hands.task.palm_reach import cost_of, keyframe_poses, touched

RADIUS, LENGTH = 0.02, 0.08  # of a capsule
RING = {
    name: {"touches": [RADIUS * np.cos(a), RADIUS * np.sin(a), 0]} for name, a in zip("abc", (0, 2.1, 4.2), strict=True)
}


def task_of(palm: Any = "auto", axis: tuple[float, float, float] = (0, 0, 1), **more: Any) -> Task:
    """A capsule carried 20 mm, its axis along ``axis``, touched in a ring about its middle."""
    turn = ScipyRotation.align_vectors([axis], [[0, 0, 1]])[0].as_rotvec(degrees=True)
    degrees = float(np.linalg.norm(turn))
    rotation = {"axis": (turn / degrees).tolist() if degrees else [0, 0, 1], "degrees": degrees}
    ends = np.array([[0, 0, -LENGTH / 2], [0, 0, LENGTH / 2]])
    return load_task(
        {
            "object": {"mass": 0.1, "shapes": [{"capsule": {"start": ends[0], "end": ends[1], "radius": RADIUS}}]},
            "palm": palm,
            "motion": [
                {"at": 0, "position": [0, 0, 0.3], "rotation": rotation},
                {"at": 2, "position": [0, 0.02, 0.3], "rotation": rotation},
            ],
            "fingers": RING,
            **more,
        }
    )


@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0), (0, 1, 1), (2, -1, 1)])
def test_fingers_reach_a_ring_from_where_all_of_it_is_side_on(axis: tuple[float, float, float]) -> None:
    palm = task_of(axis=axis).palm
    unit = np.array(axis) / np.linalg.norm(axis)
    facing = np.array(palm.facing) / np.linalg.norm(palm.facing)
    assert abs(facing @ unit) == pytest.approx(1)
    assert facing[2] <= 0  # of two alike the one above
    # Two radii away from the middle of all fingertips, which is the middle of the way.
    away = np.array([0, 0.01, 0.3]) - np.array(palm.position)
    assert away @ facing == pytest.approx(2 * palm.radius, abs=0.26 * palm.radius)
    assert np.linalg.norm(away - (away @ facing) * facing) < 0.2 * palm.radius
    assert standing(task_of(axis=axis)).off_side == pytest.approx(0, abs=1e-4)


def test_directions_are_all_around() -> None:
    ways = directions() / np.linalg.norm(directions(), axis=1, keepdims=True)
    assert len(ways) == 98
    assert {tuple(way) for way in ways} == {tuple(-way) for way in ways}
    probes = ScipyRotation.random(200, rng=1).apply([0, 0, 1])
    assert np.degrees(np.arccos((probes @ ways.T).max(axis=1))).max() < 20


def test_the_score_counted_one_by_one() -> None:
    task = task_of(axis=(0, 1, 1))
    position, rotation = np.array([0.05, -0.02, 0.2]), ScipyRotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix()
    turn = ScipyRotation.from_rotvec(task.motion[0].rotation.vector)
    tip, palm = task.hand.link_radius, task.palm.radius
    each = []
    tips = []
    for finger in task.fingers.values():
        point = np.array(finger.point)
        normal = turn.apply([point[0] / RADIUS, point[1] / RADIUS, 0])
        off = abs(np.pi / 2 - np.arccos(normal @ rotation[:, 2]))
        for share in (0, 1 / 3, 2 / 3, 1):
            world = np.array([0, 0.02 * share, 0.3]) + turn.apply(point) + tip * normal
            x, y, z = rotation.T @ (world - position)
            distance = np.hypot(max(np.hypot(x, y) - palm, 0), z) / palm
            each.append((off / np.radians(48)) ** 2 + 0.3 * (distance - 2) ** 2)
        tips.append(rotation.T @ (world - position))
    gaps = [np.hypot(*(tips[a] - tips[b])[:2]) for a, b in ((0, 1), (0, 2), (1, 2))]
    crowded = 0.5 * sum(max(1 - gap / (2.6 * tip), 0) for gap in gaps) / 3
    expected = np.mean(each) + crowded + 0.1 * (1 + rotation[2, 2]) / 2
    found = cost_of(task, touched(task), keyframe_poses(task), position[None], rotation)
    assert found == pytest.approx([expected])


def gap_by_coal(task: Task, shape: coal.CollisionGeometry, rotation: np.ndarray, position: np.ndarray) -> float:
    """Distance of a shape from the task's palm, m."""
    palm = task.palm
    disc, request, result = coal.Cylinder(palm.radius, palm.thickness), coal.DistanceRequest(), coal.DistanceResult()
    at = coal.Transform3s(palm.rotation, np.array(palm.position) - palm.thickness / 2 * palm.rotation[:, 2])
    return float(coal.distance(disc, at, shape, coal.Transform3s(rotation, position), request, result))


SHELF = {"name": "shelf", "box": {"center": [0, 0.01, 0.42], "size": [0.2, 0.2, 0.02]}}
WALL = {"box": {"center": [0, 0.01, 0.1], "size": [0.4, 0.4, 0.1], "rotation": {"axis": [1, 0, 0], "degrees": 20}}}


@pytest.mark.parametrize(
    "fingers", [RING, 3, {"a": {"touches": {"near": [0, 0.02, 0.02], "within": 0.02}}, "b": RING["b"]}]
)
@pytest.mark.parametrize(
    "more",
    [
        {},
        {"keep_out": [SHELF]},
        {"keep_out": [SHELF, WALL]},
        {"ground": {"height": 0.2}, "keep_out": [SHELF]},
    ],
    ids=["free", "shelf", "shelf and wall", "shelf and ground"],
)
def test_the_palm_is_clear_of_everything(more: dict[str, Any], fingers: Any) -> None:
    task = task_of(**more, fingers=fingers)
    width = 2 * task.hand.link_radius
    capsule = coal.Capsule(RADIUS, LENGTH)
    for goal in task.motion:
        assert gap_by_coal(task, capsule, np.eye(3), np.array(goal.position)) >= ROOM * task.palm.radius - 1e-6
    for each in task.keep_out:
        turn = ScipyRotation.from_rotvec(each.box.rotation.vector).as_matrix()
        assert gap_by_coal(task, coal.Box(*each.box.size), turn, np.array(each.box.center)) >= width - 1e-6
    if task.ground:
        half = coal.Halfspace(np.array([0.0, 0.0, 1.0]), task.ground.height)
        assert gap_by_coal(task, half, np.eye(3), np.zeros(3)) >= width - 1e-6
    told = standing(task)
    keyframes = [np.array([0, 0.02 * share, 0.3]) for share in (0, 1 / 3, 2 / 3, 1)]
    gaps = [gap_by_coal(task, capsule, np.eye(3), place) for place in keyframes]
    assert told.object_gap == pytest.approx(min(gaps), abs=1e-6)
    assert list(told.keep_out_gaps) == [each.name or f"keep_out[{k}]" for k, each in enumerate(task.keep_out)]
    # Fingers stand before the palm's face.
    heights = [
        (np.array(goal.position) + finger.point - np.array(task.palm.position)) @ task.palm.rotation[:, 2]
        for goal in task.motion
        for finger in task.fingers.values()
        if finger.is_placed
    ]
    assert min(heights, default=1.0) > 0


def test_a_box_between_turns_the_palm_elsewhere() -> None:
    """Above the object fingers reach best; a shelf there leaves the other side."""
    assert task_of().palm.facing == (0, 0, -1)
    assert task_of(keep_out=[SHELF]).palm.facing == (0, 0, 1)
    between = {"box": {"center": [0, 0.01, 0.38], "size": [0.3, 0.3, 0.002]}}
    assert task_of(keep_out=[between]).palm.facing == (0, 0, 1)


def test_what_is_given_of_the_palm_is_kept() -> None:
    task = task_of({"auto": True, "radius": 0.04, "thickness": 0.01, "facing": [3, 0, 0], "up": [0, 1, 0]})
    palm = task.palm
    assert (palm.radius, palm.thickness, palm.facing, palm.up) == (0.04, 0.01, (3, 0, 0), (0, 1, 0))
    assert palm.position[0] < -RADIUS
    assert task_of({"auto": True, "moves": True}).palm.may_move


def test_the_task_is_whole_and_the_same_again() -> None:
    task = task_of()
    written = task_to_yaml(task)
    assert "auto" not in written
    assert "placed: true" in written
    again = parse_task(written)
    assert again == task
    assert again == task_of()
    given = task_of({"position": list(task.palm.position), "facing": list(task.palm.facing)})
    assert given.hand == task.hand


def test_a_changed_task_stands_the_palm_anew() -> None:
    task = task_of()
    shifted = task.changed(
        motion=[{"at": 0, "position": [1, 0, 0.3]}, {"at": 2, "position": [1, 0.02, 0.3]}], palm={"auto": True}
    )
    assert np.subtract(shifted.palm.position, task.palm.position) == pytest.approx([1, 0, 0], abs=1e-3)
    assert task.changed(friction=0.4).palm == task.palm
    assert task.changed(palm={"position": [0, 0, 0.5], "facing": [0, 0, -1]}).palm.placed is None


@pytest.mark.parametrize(
    ("palm", "more", "words"),
    [
        ({"auto": True, "position": [0, 0, 0.4]}, {}, r"a palm without `position` where `auto: true`"),
        ({"auto": True, "motion": [{"at": 1, "position": [0, 0, 0.4]}]}, {}, r"a palm without `motion`"),
        ({"auto": 1}, {}, r"palm.auto: given 1; allowed: true or false"),
        ("anywhere", {}, r"palm: given 'anywhere'"),
        ({"auto": True, "radius": -1}, {}, r"palm.radius: given -1; allowed: a number greater than 0"),
        ({"auto": False}, {}, r"palm.position: given nothing"),
        (
            "auto",
            {"keep_out": [{"box": {"center": [0, 0, 0.3], "size": [2, 2, 2]}}]},
            r"palm: given auto; allowed: a palm for which there is room: each of \d+ places",
        ),
        (
            {"auto": True, "radius": 0.04},
            {"hand": {"link_length": [0.012, 0.015]}, "search": {"max_joints": 1}},
            "reach",
        ),
        ("auto", {"motion": [{"at": 1, "position": [0, 0, 0]}, {"at": 2, "position": [0, 0, 0]}]}, r"motion\[0\].at"),
    ],
)
def test_refused(palm: Any, more: dict[str, Any], words: str) -> None:
    with pytest.raises(TaskError, match=words):
        task_of(palm, **more)
