"""Objects on joints in a task file, against SciPy's rotations; and what contradicts itself."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.errors import TaskError
from casadi_hands.task import Task, parse_task, task_to_yaml

TEXT = """
object:
  mass: 0.1
  shapes: [{{capsule: {{start: [0.01, 0.02, 0], end: [0.05, 0.02, 0], radius: 0.01}}}}]
  attached: {{{joint}}}
palm: {{position: [0, 0, 0.3], facing: [0, 0, -1]{palm}}}
motion:
  - {{at: 0, position: [0.1, 0, 0.1], rotation: {{axis: [1, 0, 0], degrees: 30}}{first}}}
  - {{at: 2, {goal}}}
fingers: {{a: {{touches: [0.03, 0.03, 0]}}, b: {{touches: [0.03, 0.01, 0]}}}}
{more}
"""
HINGE = "hinge: {point: [0.02, -0.01, 0.03], axis: [0, 3, 4], friction_torque: 0.02, stiffness: 0.05, damping: 0.01}"
SCREW = "screw: {point: [0.02, -0.01, 0.03], axis: [0, 3, 4], pitch: -0.006}"
SLIDER = "slider: {axis: [2, 0, 0], friction_force: 1}"


def task(joint: str, goal: str, **more: str) -> Task:
    given = {"palm": "", "first": "", "more": "", **more}
    return parse_task(TEXT.format(joint=joint, goal=goal, **given))


@pytest.mark.parametrize(("joint", "advance"), [(HINGE, 0.0), (SCREW, -0.006 * 70 / 360)])
def test_an_angle_turns_the_object_about_the_axis(joint: str, advance: float) -> None:
    found = task(joint, "angle: 70")
    # The centre of mass, which loading makes the frame's origin, is at the middle of the capsule's axis.
    first = Rotation.from_euler("x", 30, degrees=True)
    axis = first.apply([0, 0.6, 0.8])
    pivot = np.array([0.1, 0, 0.1]) + first.apply([0.02, -0.01, 0.03])
    centre = np.array([0.1, 0, 0.1]) + first.apply([0.03, 0.02, 0])
    turn = Rotation.from_rotvec(np.radians(70) * axis)
    goal = found.motion[1]
    np.testing.assert_allclose(goal.position, pivot + turn.apply(centre - pivot) + advance * axis, atol=1e-12)
    apart = Rotation.from_rotvec(goal.rotation.vector).inv() * turn * first
    assert apart.magnitude() < 1e-9


def test_a_distance_moves_the_object_along_the_axis() -> None:
    goal = task(SLIDER, "distance: 0.02").motion[1]
    centre = np.array([0.1, 0, 0.1]) + Rotation.from_euler("x", 30, degrees=True).apply([0.03, 0.02, 0])
    np.testing.assert_allclose(goal.position, centre + np.array([0.02, 0, 0]), atol=1e-12)


@pytest.mark.parametrize(("joint", "goal"), [(HINGE, "angle: 200"), (SCREW, "angle: -70"), (SLIDER, "distance: 0.02")])
def test_a_written_task_loads_as_it_was(joint: str, goal: str) -> None:
    found = task(joint, f"{goal}, exert: {{force: [0, 0, 1]}}")
    assert parse_task(task_to_yaml(found), name=found.name) == found


def test_turns_about_the_first_goal_s_own_axis_add_up() -> None:
    text = TEXT.replace("axis: [1, 0, 0], degrees: 30", "axis: [0, 0, 1], degrees: 150")
    joint = "hinge: {point: [0, 0, 0], axis: [0, 0, 1]}"
    found = parse_task(text.format(joint=joint, goal="angle: 200", palm="", first="", more=""))
    assert found.motion[1].rotation.degrees == pytest.approx(350)


def test_the_unit_of_force_is_what_resists_most() -> None:
    found = task(HINGE, "angle: 70")
    length = 0.03  # half of the capsule of 60 mm
    assert found.force_unit == pytest.approx((0.02 + 0.05 * np.radians(70)) / length)
    assert task(SLIDER, "distance: 0.02").force_unit == pytest.approx(1.0)
    assert task(SLIDER, "distance: 0.02, exert: {force: [0, 3, 4]}").force_unit == pytest.approx(5.0)
    assert task("hinge: {point: [0, 0, 0], axis: [0, 0, 1]}", "angle: 70").force_unit == pytest.approx(0.981)


@pytest.mark.parametrize(
    ("joint", "goal", "more", "field", "words"),
    [
        (HINGE, "distance: 0.1", {}, "motion", "goals by angle: the object is attached by a hinge"),
        (SLIDER, "angle: 10", {}, "motion", "goals by distance"),
        (HINGE, "angle: 310", {}, "motion[1].angle", "a turn of at most ±300°"),
        (HINGE, "angle: 10, position: [0, 0, 0]", {}, "motion[1]", "an angle or a distance alone"),
        (HINGE, "position: [0.1, 0, 0.1]", {}, "motion[1].position", "a pose that the hinge lets the object reach"),
        (f"{HINGE}, {SLIDER}", "angle: 10", {}, "object.attached", "one joint: hinge, slider or screw"),
        (HINGE, "angle: 10", {"palm": ", moves: true"}, "palm.moves", "a palm that stands"),
        (
            SLIDER,
            "distance: 0.02",
            {"first": ", exert: {force: [1, 0, 0]}"},
            "motion[0].exert",
            "exert of a later goal",
        ),
        (HINGE.replace("0.05", "100"), "angle: 10", {}, "object.attached.hinge.stiffness", "at most"),
        (HINGE.replace("[0, 3, 4]", "[0, 0, 0]"), "angle: 10", {}, "axis", "at least one number other than 0"),
    ],
)
def test_what_does_not_go_with_a_joint_is_refused(
    joint: str, goal: str, more: dict[str, str], field: str, words: str
) -> None:
    with pytest.raises(TaskError) as refused:
        task(joint, goal, **more)
    assert field in str(refused.value)
    assert words in str(refused.value)


def test_angles_are_of_attached_objects() -> None:
    with pytest.raises(TaskError, match="angle and distance are of objects that are `attached`"):
        parse_task(TEXT.replace("  attached: {{{joint}}}\n", "").format(goal="angle: 10", palm="", first="", more=""))


def test_one_finger_may_turn_what_the_world_holds() -> None:
    text = TEXT.replace(", b: {{touches: [0.03, 0.01, 0]}}", "")
    assert len(parse_task(text.format(joint=HINGE, goal="angle: 10", palm="", first="", more="")).fingers) == 1
