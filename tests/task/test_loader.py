from pathlib import Path

import pytest

from casadi_hands.errors import TaskError
from casadi_hands.task import load_task, parse_task, task_to_yaml
from casadi_hands.task.yamlfile import TaskFile

TEXT = """\
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {position: [0, 0, 0.3], facing: [0, 0, -1]}
motion: [&start {at: 0, position: [0, 0, 0.2]}, {<<: *start, at: 2}]
fingers: {thumb: {touches: [0.03, 0, 0]}, index: {touches: [-0.03, 0, 0]}}
"""


def test_name_is_the_files(tmp_path: Path) -> None:
    (tmp_path / "turn a ball.yaml").write_text(TEXT)
    assert load_task(tmp_path / "turn a ball.yaml").name == "turn a ball"
    (tmp_path / "named.yaml").write_text("name: my ball\n" + TEXT)
    assert load_task(str(tmp_path / "named.yaml")).name == "my ball"


def test_a_text_that_was_read_before_is_read_as_before() -> None:
    first = TaskFile(TEXT, "first")
    first.data["palm"]["position"][2] = 5
    again = TaskFile(TEXT, "again")
    assert again.source == "again"
    assert again.data["palm"]["position"] == [0, 0, 0.3]
    assert again.line(("palm", "facing")) == first.line(("palm", "facing")) == 2
    for source in ("one", "other"):
        with pytest.raises(TaskError, match=f"^{source}:1: "):
            TaskFile("- a list", source)


def test_anchors() -> None:
    task = parse_task(TEXT)
    assert [goal.position for goal in task.motion] == [(0, 0, 0.2), (0, 0, 0.2)]
    assert [goal.at for goal in task.motion] == [0, 2]


def test_everything_optional_survives_saving() -> None:
    task = parse_task(
        TEXT
        + """
about: everything
duration: 3
time_step: 0.05
keyframes_between: 1
ground: {height: -0.5, friction: 0.3, touches: [0, 0, -0.03]}
perturbations: [{from: 1, to: 2, force: [0, 0, -0.5], torque: [0.001, 0, 0]}]
hand: {link_radius: 0.004, link_length: [0.01, 0.1], joint_limits: [-45, 60], density: 2700}
actuator: {torque: 0.3, speed: 4}
limits: {slip: 0.005}
search: {trials: 2, recombinations: 1, max_joints: 2, threshold: 0.25, seed: 7}
weights: {synthesis: {collision: [1, 2, 3]}}
"""
    )
    assert (task.perturbations[0].start, task.perturbations[0].end) == (1, 2)
    assert task.actuator is not None
    assert (task.actuator.torque, task.actuator.speed) == (0.3, 4)
    assert task.hand.joint_limits == (-45, 60)
    assert (task.limits.slip, task.limits.goal_angle) == (0.005, 0.5)
    assert task.search.model_dump() == {"trials": 2, "recombinations": 1, "max_joints": 2, "threshold": 0.25, "seed": 7}
    assert task.weights.synthesis.collision == (1, 2, 3)
    assert parse_task(task_to_yaml(task)) == task


def test_moving_palm_survives_saving() -> None:
    motion = "moves: true, up: [0, 1, 0], motion: [{at: 1, position: [0, 0, 0.31]}]"
    task = parse_task(TEXT.replace("facing: [0, 0, -1]", f"facing: [0, 0, -1], {motion}"))
    assert task.palm.may_move
    assert task.palm.motion is not None
    assert parse_task(task_to_yaml(task)) == task
