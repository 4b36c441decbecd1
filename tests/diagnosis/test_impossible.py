"""What is refused before anything is solved, at the number at which it becomes impossible and just short of it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from casadi_hands.diagnosis.impossible import LEAST_INERTIA, findings, impossibilities
from casadi_hands.problem.si import build_model
from casadi_hands.task import load_task, parse_task

ROOT = Path(__file__).parents[2]
PROBLEMS = sorted(path for folder in ("problems", "examples/everyday") for path in (ROOT / folder).glob("*.yaml"))
WEIGHT = 0.1 * 9.81


def told(
    palm: str = "position: [0, 0, 0.3], facing: [0, 0, -1]",
    motion: str = "[{at: 0, position: [0, 0, 0.2]}, {at: 2, position: [0, 0, 0.19]}]",
    more: str = "",
) -> list[str]:
    """What is impossible about a ball of 3 cm radius between two fingers, below a palm of 4 cm radius."""
    task = parse_task(
        f"""
object: {{mass: 0.1, shapes: [{{sphere: {{center: [0, 0, 0], radius: 0.03}}}}]}}
palm: {{radius: 0.04, {palm}}}
motion: {motion}
fingers: {{left: {{touches: [0, -0.03, 0]}}, right: {{touches: [0, 0.03, 0]}}}}
{more}
"""
    )
    return [reason.text for reason in impossibilities(task, build_model(task))]


@pytest.mark.parametrize("path", PROBLEMS, ids=lambda path: path.stem)
def test_what_can_be_done_is_not_refused(path: Path) -> None:
    task = load_task(path)
    assert impossibilities(task, build_model(task)) == []


def test_an_object_behind_the_palm() -> None:
    (text,) = told("position: [0, 0, 0.3], facing: [0, 0, 1]")
    assert text.startswith("the object is behind the palm at every goal, by 70 mm or more: fingers point to [0, 0, 1]")
    assert text.endswith("try palm.facing [0, 0, -1]")


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_motors_too_slow_for_the_way_from_goal_to_goal(share: float) -> None:
    """The tip of three links of 50 mm goes 300 mm for each radian that all its joints turn."""
    links = "hand: {link_length: [0.02, 0.05]}\nsearch: {max_joints: 3}"
    task = parse_task(
        f"""
object: {{mass: 0.1, shapes: [{{sphere: {{center: [0, 0, 0], radius: 0.03}}}}]}}
palm: {{radius: 0.04, position: [0, 0, 0.3], facing: [0, 0, -1]}}
motion: [{{at: 0, position: [0, 0, 0.2]}}, {{at: 2, position: [0, 0, 0.19]}}, {{at: 3, position: [0.006, 0, 0.19]}}]
fingers: {{left: {{touches: [0, -0.03, 0]}}, right: {{touches: [0, 0.03, 0]}}}}
actuator: {{speed: {share * 0.006 / 0.3}}}
{links}
"""
    )
    slow = [each for each in findings(task, build_model(task)) if "actuator.speed" in each.reason.text]
    assert not any(each.certain for each in slow)  # contacts may roll some of the way
    assert [each.reason.text[:58] for each in slow] == ["from 2 s to 3 s the object goes 6 mm, by 6 mm/s; fingers o"][
        : share < 1
    ]


def test_an_object_of_which_a_part_is_before_the_palm_or_comes_before_it_is_not_behind() -> None:
    beside = "[{at: 0, position: [0.2, 0, 0.271]}, {at: 2, position: [0.2, 0, 0.271]}]"
    assert told("position: [0, 0, 0.3], facing: [0, 0, 1]", beside) == []
    passing = "[{at: 0, position: [0.2, 0, 0.2]}, {at: 2, position: [0.2, 0, 0.32]}]"
    assert told("position: [0, 0, 0.3], facing: [0, 0, 1]", passing) == []


def test_a_palm_that_may_move_is_not_judged_by_where_it_starts() -> None:
    assert told("position: [0, 0, 0.3], facing: [0, 0, 1], moves: true") == []
    assert told("position: [0, 0, 3], facing: [0, 0, -1], moves: true", more="hand: {link_length: [0.02, 0.1]}") == []


@pytest.mark.parametrize(("longest", "reaches"), [(0.1, False), (0.101, True)])
def test_an_object_beyond_the_longest_finger(longest: float, reaches: bool) -> None:
    # Palm 0.04 and two links of 0.1 and a tip of 0.01 reach 0.25; the ball's near side is 0.251 away at goal 2.
    motion = "[{at: 0, position: [0, 0, 0.2]}, {at: 2, position: [0, 0, 0.119]}]"
    hand = f"hand: {{link_length: [0.02, {longest}], link_radius: 0.01}}\nsearch: {{max_joints: 2}}"
    texts = told("position: [0, 0, 0.4], facing: [0, 0, -1]", motion, hand)
    if reaches:
        assert texts == []
    else:
        assert texts[0].startswith("the object is out of reach at goal 2 (2 s): it is 251 mm from the palm's centre")
        assert "2 links of at most 100 mm each, on the palm's rim, reaches 250 mm; try" in texts[0]


def test_a_palm_that_follows_its_object_reaches_it() -> None:
    motion = "[{at: 0, position: [0, 0, 0.2]}, {at: 2, position: [1, 0, 0.2]}]"
    short = "hand: {link_length: [0.02, 0.1]}"
    follows = "position: [0, 0, 0.3], facing: [0, 0, -1], motion: [{at: 2, position: [1, 0, 0.3]}]"
    assert "out of reach at goal 2" in told(motion=motion, more=short)[0]
    assert told(follows, motion, short) == []


def drawing(distance: float, facing: int) -> list[str]:
    """A drawing whose tool is 0.1 m off the ball's centre, at a distance below the palm."""
    return told(
        f"position: [0, 0, {distance}], facing: [0, 0, {facing}]",
        "[{at: 0, tool_at: [0, 0, 0]}, {at: 2, tool_at: [0.01, 0, 0]}]",
        "tool: [0, 0, -0.05]\nhand: {link_length: [0.02, 0.1], link_radius: 0.01}\nsearch: {max_joints: 2}",
    )


def test_a_drawing_s_object_may_turn_about_its_tool() -> None:
    assert drawing(0.3, -1) == []
    assert "out of reach" in drawing(0.5, -1)[0]
    assert drawing(0.09, 1) == []
    assert "behind the palm" in drawing(0.3, 1)[0]


@pytest.mark.parametrize(("clearance", "possible"), [(0.0049, True), (0.0061, False)])
def test_a_goal_nearer_to_the_palm_than_bodies_keep_from_each_other(clearance: float, possible: bool) -> None:
    # 5 mm, and 0.5 mm of the goal's limit.
    motion = "[{at: 0, position: [0, 0, 0.2]}, {at: 2, position: [0, 0, 0.265]}]"
    texts = told(motion=motion, more=f"hand: {{clearance: {clearance}}}")
    if possible:
        assert texts == []
    else:
        assert texts == [
            "the object is 5 mm from the palm at goal 2 (2 s), and bodies that do not touch keep 6.1 mm from each "
            "other (hand.clearance); try a goal farther from the palm, or less hand.clearance"
        ]


def test_a_limit_of_contact_forces_that_the_task_s_torque_exceeds() -> None:
    # Two contacts, each bears torque / (2 × friction × radius) = 0.6 / (2 · 0.5 · 0.03) = 20 N.
    push = "gravity: [0, 0, 0]\nperturbations: [{from: 1, to: 1.5, torque: [0, 0, 0.6]}]\n"
    least = 20 / WEIGHT
    (text,) = told(more=push + f"hand: {{contact_force: {0.99 * least}}}")
    assert "must bear at least 20.3 weights (19.9 N) along an axis of the object at 1.05 s (between" in text
    assert "to withstand the task's torque of 0.6 N·m at friction 0.5 (friction)" in text
    assert "; hand.contact_force allows 20.2 (19.8 N); try" in text
    assert "hand.contact_force: 82, its default here" in text
    assert told(more=push + f"hand: {{contact_force: {1.01 * least}}}") == []
    assert told(more=push) == []


def test_motors_that_are_too_weak_with_the_shortest_levers() -> None:
    # As above, 40 N each; of which two joints with levers of 5 % of 30 mm share the torque evenly at best.
    push = "gravity: [0, 0, 0]\nperturbations: [{from: 1, to: 1.5, torque: [0, 0, 1.2]}]\nsearch: {max_joints: 2}\n"
    servo = "hand: {drive: {servo: SG90}}\n"
    least = (40 - 0.02 * WEIGHT) * 0.05 * 0.03 / 2**0.5
    (text,) = told(more=push + servo)
    assert re.search(r" takes 0\.042\d N·m of some joint .* and servos SG90 hold 0\.0352 N·m", text)
    assert text.endswith(
        "; try a stronger servo (XL330-M077, XL330-M288, XC330-M288, STS3215), a lighter object, more friction or more "
        "fingers"
    )
    # The friction cones of the bound are circumscribed, so it is half a percent short.
    assert told(more=push + servo + f"actuator: {{torque: {1.001 * least}}}\n") == []
    (text,) = told(more=push + f"actuator: {{torque: {0.99 * least}}}\n")
    assert "and motors give 0.042 N·m (actuator.torque); try stronger motors (actuator.torque), " in text


@pytest.mark.parametrize("inertia", [0.9, 1.1])
def test_what_mujoco_does_not_move_is_told_before_anything_is_solved(inertia: float) -> None:
    mujoco = pytest.importorskip("mujoco")
    scene = "<mujoco><worldbody><body><freejoint/><inertial pos='0 0 0' mass='1e-6' diaginertia='{0} {0} {0}'/></body>"
    moment = inertia * LEAST_INERTIA
    full = scene.replace("diaginertia='{0} {0} {0}'", "fullinertia='{0} {0} {0} 0 0 0'").format(moment)
    try:
        mujoco.MjModel.from_xml_string(f"{full}</worldbody></mujoco>")
        taken = True
    except ValueError:
        taken = False
    radius = (moment / (0.4 * 1e-6)) ** 0.5
    text = f"""\
object: {{mass: 1.0e-6, shapes: [{{sphere: {{center: [0, 0, 0], radius: {radius:.12e}}}}}]}}
palm: {{position: [0, 0, {4 * radius:.9e}], facing: [0, 0, -1]}}
motion: [{{at: 0, position: [0, 0, 0]}}, {{at: 2, position: [0, 0, {radius / 5:.9e}]}}]
fingers: {{thumb: {{touches: [{radius:.9e}, 0, 0]}}, index: {{touches: [-{radius:.9e}, 0, 0]}}}}
"""
    task = parse_task(text)
    told = [each.reason.what for each in findings(task, build_model(task)) if each.certain]
    assert any(what.startswith("the object has a least moment of inertia") for what in told) is not taken
    assert any(what.startswith("the largest links allowed") for what in told)
