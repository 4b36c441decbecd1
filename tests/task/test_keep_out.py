"""Boxes that the palm keeps off: distances as SciPy finds them, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation as ScipyRotation

from casadi_hands.errors import TaskError
from casadi_hands.task import load_task, parse_task, task_to_yaml
from casadi_hands.task.keep_out import KeepOut
from casadi_hands.task.yamlfile import TaskFile
from tests.task.test_refusals import GOOD

RADIUS, THICKNESS = 0.05, 0.012
SHELF = "keep_out: [{name: shelf, box: {center: [0, 0, 0.2], size: [0.1, 0.1, 0.1]}}]\n"


def random_box(rng: np.random.Generator) -> KeepOut:
    turn = ScipyRotation.random(rng=rng).as_rotvec()
    axis, degrees = turn / np.linalg.norm(turn), np.degrees(np.linalg.norm(turn))
    return KeepOut.model_validate(
        {
            "box": {
                "center": rng.uniform(-0.12, 0.12, 3).tolist(),
                "size": rng.uniform(0.01, 0.3, 3).tolist(),
                "rotation": {"axis": axis.tolist(), "degrees": float(degrees)},
            }
        }
    )


def nearest_points(each: KeepOut, position: np.ndarray, rotation: np.ndarray) -> float:
    """Distance of a palm's disc from a box: the least over a point of either, by SciPy."""
    box = each.box
    turn = ScipyRotation.from_rotvec(np.radians(box.rotation.degrees) * np.array(box.rotation.axis)).as_matrix()

    def apart(x: np.ndarray) -> np.ndarray:
        return np.asarray(position + rotation @ x[:3] - turn @ x[3:] - np.array(box.center))

    found = minimize(
        lambda x: float(apart(x) @ apart(x)),
        np.zeros(6),
        jac=lambda x: 2 * np.concatenate([rotation.T @ apart(x), -turn.T @ apart(x)]),
        bounds=[(-RADIUS, RADIUS)] * 2 + [(-THICKNESS, 0)] + [(-size / 2, size / 2) for size in box.size],
        constraints={"type": "ineq", "fun": lambda x: RADIUS**2 - x[0] ** 2 - x[1] ** 2},
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 500},
    )
    return float(np.sqrt(found.fun))


def test_distances_from_palms_are_the_least_between_points(rng: np.random.Generator) -> None:
    apart = met = 0
    for _ in range(300):
        each, position = random_box(rng), rng.uniform(-0.12, 0.12, 3)
        # Some discs lie flat on a face, or on edge.
        own = ScipyRotation.random(rng=rng).as_matrix()
        rotation = own if rng.random() < 0.7 else each.box.rotation.matrix[:, [1, 2, 0]]
        expected = nearest_points(each, position, rotation)
        found = each.distance_from_palm(position, rotation, RADIUS, THICKNESS)
        if expected > 1e-3:
            assert found == pytest.approx(expected, abs=2e-5)
            apart += 1
        else:
            assert found < 2e-3
            met += 1
    assert apart > 80
    assert met > 80


def test_distances_of_points_from_boxes(rng: np.random.Generator) -> None:
    each = random_box(rng)
    box = each.box
    turn = ScipyRotation.from_rotvec(np.radians(box.rotation.degrees) * np.array(box.rotation.axis))
    half = np.array(box.size) / 2
    on_faces = rng.uniform(-1, 1, (200, 3))
    on_faces[np.arange(200), rng.integers(0, 3, 200)] = rng.choice([-1, 1], 200)
    assert each.distance(turn.apply(half * on_faces) + box.center) == pytest.approx(0, abs=1e-12)
    beyond = np.array([half[0] + 0.03, half[1] + 0.04, 0.0])
    assert each.distance(turn.apply(beyond) + box.center) == pytest.approx(0.05)
    assert each.distance(np.array(box.center)) == pytest.approx(-half.min())


def test_a_palm_in_a_box_is_refused() -> None:
    assert load_task({**_data(), "keep_out": [_box([0.4, 0, 0.3])]}).keep_out[0].name == "shelf"
    x, y, z = parse_task(GOOD).palm.position
    with pytest.raises(TaskError, match=r"palm.position: given .*the whole palm is out of shelf \(keep_out\)"):
        load_task({**_data(), "keep_out": [_box([x, y, z])]})


def test_a_palm_that_moves_knows_no_boxes() -> None:
    data = _data()
    data["palm"] = {**data["palm"], "moves": True}
    with pytest.raises(TaskError, match=r"palm.moves: given a palm that moves; allowed: a palm that stands still"):
        load_task({**data, "keep_out": [_box([0.4, 0, 0.3])]})


def test_boxes_are_written_with_the_task() -> None:
    task = load_task({**_data(), "keep_out": [_box([0.4, 0, 0.3])]})
    assert parse_task(task_to_yaml(task)) == task


def _box(center: list[float]) -> dict[str, object]:
    return {"name": "shelf", "box": {"center": center, "size": [0.1, 0.1, 0.1]}}


def _data() -> dict[str, dict[str, object]]:
    data: dict[str, dict[str, object]] = TaskFile(GOOD, "task").data
    return data
