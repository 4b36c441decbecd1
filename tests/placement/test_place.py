"""Contacts placed for whole tasks: where regions allow, where fingers can touch, the same each time."""

import numpy as np
import pytest

from casadi_hands.errors import SolveError
from casadi_hands.placement.place import ContactSet, Proposal, propose
from casadi_hands.task import Task, load_task, parse_task, task_to_yaml

TASK = """\
object:
  mass: 0.1
  shapes:
    - capsule: {start: [0, 0, -0.04], end: [0, 0, 0.04], radius: 0.02, name: bar}
    - sphere: {center: [0, 0, 0.05], radius: 0.025, name: knob}
  center_of_mass: [0, 0, 0.01]
palm: {radius: 0.06, position: [0, 0, 0.3], facing: [1, 0, 0]}
motion:
  - {at: 0, position: [0.085, 0, 0.3]}
  - {at: 2, position: [0.135, 0, 0.3]}
"""


def placed(fingers: str) -> tuple[Task, Proposal]:
    task = parse_task(TASK + f"fingers: {fingers}\n")
    return task, propose(task)


@pytest.fixture(scope="module")
def three() -> tuple[Task, Proposal]:
    return placed("3")


def test_contacts_are_on_the_surface_with_room(three: tuple[Task, Proposal]) -> None:
    task, proposal = three
    assert 1 <= len(proposal.sets) <= 4
    for each in proposal.sets:
        points = np.array(list(each.points.values()))
        assert len(points) == 3
        for point in points:
            assert min(abs(shape.body.signed_distance(point)) for shape in task.object.shapes) < 1e-9
        gaps = [np.linalg.norm(a - b) for i, a in enumerate(points) for b in points[:i]]
        assert min(gaps) > task.hand.link_radius


def test_best_first(three: tuple[Task, Proposal]) -> None:
    costs = [each.cost for each in three[1].sets]
    assert costs == sorted(costs)


def test_the_same_each_time_but_not_for_another_seed(three: tuple[Task, Proposal]) -> None:
    task, proposal = three
    assert propose(task) == proposal
    other = task.model_copy(update={"search": task.search.model_copy(update={"seed": 1})})
    assert propose(other) != proposal


def test_written_into_the_task(three: tuple[Task, Proposal]) -> None:
    task, proposal = three
    full = proposal.sets[0].in_task(task)
    assert full.is_placed
    again = parse_task(task_to_yaml(full))
    assert again.fingers == full.fingers
    assert [str(finger.placed) for finger in again.fingers.values()] == ["anywhere"] * 3
    assert {name: finger.point for name, finger in again.fingers.items()} == proposal.sets[0].points


def test_regions_and_given_contacts_are_kept_to() -> None:
    task, proposal = placed(
        "{a: {touches: {near: [0, 0.02, 0], within: 0.015}}, b: {touches: {on: knob}}, c: {touches: {not_on: knob}},"
        " d: {touches: [0, -0.02, 0]}}"
    )
    near = np.array([0, 0.02, -0.01])  # the centre of mass is the origin now
    bar, knob = (shape.body for shape in task.object.shapes)
    for each in proposal.sets:
        points = {name: np.array(point) for name, point in each.points.items()}
        assert np.linalg.norm(points["a"] - near) <= 0.015
        assert abs(knob.signed_distance(points["b"])) < 1e-9
        assert abs(bar.signed_distance(points["c"])) < 1e-9
        assert points["d"] == pytest.approx([0, -0.02, -0.01])
        full = each.in_task(task)
        assert full.fingers["d"] == task.fingers["d"]
        assert str(full.fingers["b"].placed) == "on knob"


def test_no_more_fingers_than_it_takes() -> None:
    _, proposal = placed("{count: [2, 4]}")
    assert {len(each.points) for each in proposal.sets} <= {3, 4}
    assert all(each.firm for each in proposal.sets)


def test_fingers_that_may_be_left_out() -> None:
    _, proposal = placed("{a: {touches: anywhere}, b: {touches: anywhere}, c: {touches: anywhere, optional: true}}")
    assert {frozenset(each.points) for each in proposal.sets} <= {frozenset("ab"), frozenset("abc")}
    assert proposal.sets


def test_a_place_that_no_finger_reaches() -> None:
    task = parse_task(TASK + "fingers: {a: {touches: {near: [-0.02, 0, 0], within: 0.004}}, b: {touches: anywhere}}\n")
    proposal = propose(task)
    assert not proposal.sets
    assert proposal.reason.startswith("contact 'a' (within 4 mm of [-0.02, 0.0, -0.01] m): of ")
    assert "its side faces to or from the palm, by 65° or more on average" in proposal.reason


@pytest.mark.parametrize("thicker", [1.0, 1.5])
def test_the_ground_is_stayed_clear_of(thicker: float) -> None:
    task = load_task("problems/tabletop_rotation_overhead.yaml")
    asked = {name: {"touches": "anywhere"} for name in task.fingers}
    task = Task.model_validate(task.model_dump(by_alias=True, exclude_none=True) | {"fingers": asked})
    radius = thicker * task.hand.link_radius
    tip = task.fingertip.model_copy(update={"radius": radius})
    task = task.model_copy(update={"fingertip": tip})
    assert task.ground is not None
    for each in propose(task).sets:
        for point in each.points.values():
            out = task.object.shapes[0].body.outward(np.array(point))
            for _, position, vector in task.goal_poses():
                assert abs(vector[:2]).max() < 1e-9  # it turns about the vertical
                assert position[2] + point[2] + radius * out[2] - radius >= task.ground.height


def test_nothing_to_place() -> None:
    with pytest.raises(SolveError, match="all contacts are given"):
        propose(load_task("problems/in_and_out.yaml"))


def test_firm_sets_withstand_torques(three: tuple[Task, Proposal]) -> None:
    best: ContactSet = three[1].sets[0]
    assert best.firm
    assert best.withstands == "pushes of half the weight and torques along any axis"
