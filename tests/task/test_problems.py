"""The task files that come with the package: they load, and a hand could hold the object at every goal."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation as ScipyRotation

from casadi_hands.task import Task, load_task, parse_task, task_to_yaml

PROBLEMS = sorted((Path(__file__).parents[2] / "problems").glob("*.yaml"))
# Forces a design may use: friction short of its limit, and a squeeze of a few weights.
FRICTION_SHARE, SQUEEZE = 0.8, 8.0
EDGES = 16


def test_every_figure_of_the_thesis_has_its_file() -> None:
    first_lines = [path.read_text().partition("\n")[0] for path in PROBLEMS]
    of_the_thesis = [line for line in first_lines if not line.startswith("# Not from the thesis: ")]
    text = "".join(of_the_thesis)
    figures = "3.1a 3.1b 3.1c 3.1d 3.2a 3.2b 3.2c 3.3a 3.3b 3.4a 3.4b 3.5a 3.5b 3.6a 3.6b 3.6c 3.6d 3.6e 3.7a 3.7b 3.7c"
    assert [figure for figure in figures.split() if figure not in text] == []
    assert len(of_the_thesis) == 20


@pytest.mark.parametrize("path", PROBLEMS, ids=lambda path: path.stem)
def test_saving_and_loading_changes_nothing(path: Path) -> None:
    task = load_task(path)
    assert parse_task(task_to_yaml(task)) == task


@pytest.mark.parametrize("path", PROBLEMS, ids=lambda path: path.stem)
def test_object_can_be_held_at_every_goal(path: Path) -> None:
    task = load_task(path)
    for time, position, vector in task.goal_poses():
        lowest = lowest_height(task, position, vector)
        resting = task.ground is not None and abs(lowest - task.ground.height) < 1e-6
        assert holds(task, vector, np.zeros(6), resting), f"not at {time} s"


def test_sphere_resists_the_perturbation_with_its_top_contact_only() -> None:
    task = load_task(PROBLEMS[0].with_name("sphere_rotation_and_translation.yaml"))
    push = np.array([*task.perturbations[0].force, 0, 0, 0])
    # With as much squeeze as the top finger needs to push back, the three below cannot.
    fewer = task.model_copy(update={"fingers": {n: f for n, f in task.fingers.items() if n != "top"}})
    assert holds(task, np.zeros(3), push, resting=False)
    assert not holds(fewer, np.zeros(3), 4 * push, resting=False)
    assert holds(task, np.zeros(3), 4 * push, resting=False)


def test_same_motion_from_above_and_from_the_side() -> None:
    above, side = (
        load_task(PROBLEMS[0].with_name(f"tabletop_rotation_{name}.yaml")) for name in ("overhead", "from_the_side")
    )
    assert (above.object, above.motion, above.fingers, above.ground) == (
        side.object,
        side.motion,
        side.fingers,
        side.ground,
    )
    assert above.palm.facing != side.palm.facing


def test_gravity_is_all_that_differs_between_the_first_two() -> None:
    names = ("horizontal_translation", "horizontal_translation_no_gravity")
    on, off = (load_task(PROBLEMS[0].with_name(f"{name}.yaml")) for name in names)
    assert off.gravity == (0, 0, 0)
    differing = {name for name in Task.model_fields if getattr(on, name) != getattr(off, name)}
    assert differing == {"name", "about", "gravity"}


def lowest_height(task: Task, position: np.ndarray, vector: np.ndarray) -> float:
    turn = ScipyRotation.from_rotvec(vector)
    return min(float((position + turn.apply(end))[2]) - s.radius for s in task.object.shapes for end in ends_of(s))


def ends_of(shape: Any) -> tuple[np.ndarray, np.ndarray]:
    """Both ends of a sphere's or a capsule's axis, (3,) each."""
    start, end = (shape.center, shape.center) if hasattr(shape, "center") else (shape.start, shape.end)
    return np.array(start), np.array(end)


def holds(task: Task, vector: np.ndarray, push: np.ndarray, resting: bool) -> bool:
    """Whether contact forces within linearised cones balance gravity and the push (6,) on the object, by an LP."""
    turn = ScipyRotation.from_rotvec(vector)
    contacts = [
        (turn.apply(f.touches), turn.apply(inward(task, f.touches)), task.friction) for f in task.fingers.values()
    ]
    if task.ground and resting:
        contacts.append((turn.apply(task.ground.touches), np.array([0.0, 0.0, 1.0]), task.ground.friction))
    columns = []
    for point, normal, friction in contacts:
        across = np.linalg.svd(normal[None])[2][1:]
        for angle in 2 * np.pi * np.arange(EDGES) / EDGES:
            edge = normal + FRICTION_SHARE * friction * (np.cos(angle) * across[0] + np.sin(angle) * across[1])
            columns.append(np.concatenate([edge, np.cross(point, edge)]))
    weight = task.object.mass * np.array(task.gravity)
    needed = -np.concatenate([weight, np.zeros(3)]) - push
    scale = np.array([1.0] * 3 + [task.object.characteristic_length] * 3) * task.force_unit
    # Torques within 1e-3 of weight × size: figures typed to a tenth of a millimetre are not balanced better.
    slack = np.diag(scale)
    result = linprog(
        np.zeros(len(columns) + 6),
        A_eq=np.hstack([np.array(columns).T, slack]),
        b_eq=needed,
        A_ub=np.array([[*[1.0] * len(columns), *[0.0] * 6]]),
        b_ub=[SQUEEZE * task.force_unit],
        bounds=[(0, None)] * len(columns) + [(0, 0)] * 3 + [(-1e-3, 1e-3)] * 3,
    )
    return bool(result.success)


def inward(task: Task, point: tuple[float, float, float]) -> np.ndarray:
    """Normal into the object at a point of its surface, (3,), by finite differences of the distance."""

    def distance(at: np.ndarray) -> float:
        gaps = []
        for shape in task.object.shapes:
            start, end = ends_of(shape)
            samples = start + np.linspace(0, 1, 2001)[:, None] * (end - start)
            gaps.append(np.linalg.norm(samples - at, axis=1).min() - shape.radius)
        return float(min(gaps))

    step = 1e-6
    gradient = [distance(np.array(point) + step * e) - distance(np.array(point) - step * e) for e in np.eye(3)]
    return -np.array(gradient) / np.linalg.norm(gradient)
