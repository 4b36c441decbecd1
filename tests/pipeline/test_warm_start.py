"""A hand and motion made by hand, carried over to a task that was edited."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.errors import SolveError
from casadi_hands.export.design import Design
from casadi_hands.pipeline.earlier_motion import continuous_vectors
from casadi_hands.pipeline.margins import SMALL, Margins, margins_for
from casadi_hands.pipeline.warm_start import _other_regrasps, as_floating, kept_margin, warm_start
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.motion import Motion
from casadi_hands.problem.outcome import whole_hand_motion
from casadi_hands.problem.si import build_model, hand_of
from casadi_hands.task import Task, parse_task
from tests.export.example import BASES, HEIGHT, LENGTHS, TASK, example_hand, example_motion

# One keyframe between goals puts the samples where the motion's are.
HELD = TASK.replace("ground: {height: 0.2, friction: 0.8}\n", "keyframes_between: 1\nhand: {link_radius: 0.008}\n")
LENGTH, WEIGHT = 0.06, 0.1 * 9.81  # characteristic length and weight of the capsule


LIFTS = "  index: {{touches: [0, -0.02, 0.02], regrasps: [{{from: {}, to: {}, touches: [0, -0.02, 0.02]}}]}}"


def edited(*changes: str) -> str:
    """The task with texts replaced (``old -> new``) or added."""
    text = HELD
    for change in changes:
        old, _, new = change.partition(" -> ")
        assert not new or old in text
        text = text.replace(old, new) if new else text + old + "\n"
    return text


def earlier(text: str = HELD, motion: Motion | None = None, status: str = "feasible") -> Design:
    return Design(parse_task(text), status, hand=example_hand(), motion=motion or example_motion())


def start_for(text: str, design: Design | None = None) -> tuple[Task, WholeHand, Motion]:
    """The start for an edited task, and the motion that it would be written as."""
    task = parse_task(text)
    model = build_model(task)
    start = warm_start(design or earlier(), task, model)
    return task, start, whole_hand_motion(model, start)


def turned(motion: Motion) -> Rotation:
    return Rotation.from_quat(motion.object_orientation, scalar_first=True)


def test_of_an_unchanged_task_it_is_the_earlier_hand_and_motion() -> None:
    task, start, found = start_for(HELD)
    wanted = example_motion()
    for name in ("time", "object_position", "base_position", "joint_angles", "contact_force"):
        np.testing.assert_allclose(getattr(found, name), getattr(wanted, name), atol=1e-9)
    for name in ("contact_point_object", "contact_point_link"):
        np.testing.assert_allclose(getattr(found, name), getattr(wanted, name), atol=1e-9)
    for name in ("object_orientation", "base_orientation"):
        one, other = (Rotation.from_quat(getattr(m, name), scalar_first=True) for m in (found, wanted))
        assert (one.inv() * other).magnitude().max() < 1e-9
    assert (found.joint_names, found.contact_names, found.contact_link) == (
        wanted.joint_names,
        wanted.contact_names,
        wanted.contact_link,
    )
    assert found.contact_active.all()
    hand, built = example_hand(), hand_of(task, build_model(task), start.fingers, start.contacts, 1.0, 1.0)
    for one, other in zip(built.fingers, hand.fingers, strict=True):
        assert one.name == other.name
        np.testing.assert_allclose(one.base, other.base, atol=1e-12)
        for link, before in zip(one.links, other.links, strict=True):
            assert link.length == pytest.approx(before.length, abs=1e-12)
            np.testing.assert_allclose(link.axis, before.axis, atol=1e-9)


def test_fingers_in_another_order_keep_their_joints_and_contacts() -> None:
    thumb, index = "  thumb: {touches: [0, 0.02, -0.01]}\n", "  index: {touches: [0, -0.02, 0.02]}\n"
    task, start, found = start_for(edited(f"{thumb}{index} -> {index}{thumb}"))
    wanted = example_motion()
    assert [built.name for built in hand_of(task, build_model(task), start.fingers, start.contacts, 1, 1).fingers] == [
        "index",
        "thumb",
        "middle",
    ]
    np.testing.assert_allclose(found.joint_angles, wanted.joint_angles[:, [2, 3, 0, 1, 4, 5]], atol=1e-9)
    np.testing.assert_allclose(found.contact_force, wanted.contact_force[:, [1, 0, 2]], atol=1e-9)


def test_a_goal_moved_moves_the_path_there_exactly_and_smoothly_elsewhere() -> None:
    _, _, found = start_for(edited("[0.115, 0, 0.3] -> [0.115, 0.004, 0.303]"))
    shift = found.object_position - example_motion().object_position
    np.testing.assert_allclose(shift[10], [0, 0.004, 0.003], atol=1e-12)
    np.testing.assert_allclose(shift[[0, 20]], 0, atol=1e-12)
    # 6s⁵ - 15s⁴ + 10s³ from goal to goal, here of the way at 0.1, 0.2 and 0.5: at rest, and unaccelerated, at each.
    for k, share in ((1, 0.00856), (2, 0.05792), (5, 0.5), (15, 0.5), (19, 0.00856)):
        np.testing.assert_allclose(shift[k], share * np.array([0, 0.004, 0.003]), atol=1e-12)
    assert (turned(found).inv() * turned(example_motion())).magnitude().max() < 1e-9


def test_a_goal_turned_turns_the_path_there() -> None:
    _, _, found = start_for(edited("degrees: 30 -> degrees: 35"))
    turn = turned(found) * turned(example_motion()).inv()
    np.testing.assert_allclose(turn[10].as_rotvec(degrees=True), [0, 0, 5], atol=1e-7)
    np.testing.assert_allclose(turn[5].as_rotvec(degrees=True), [0, 0, 2.5], atol=1e-7)
    np.testing.assert_allclose(turn[[0, 20]].as_rotvec(degrees=True), 0, atol=1e-7)


def test_another_orientation_at_the_start_is_where_the_path_starts() -> None:
    # The reference of rotation vectors moves with the first goal; at the second the goal is what it was.
    _, _, found = start_for(
        edited("[0.075, 0, 0.3]}\n  - {at: 1 -> [0.075, 0, 0.3], rotation: {axis: [0, 0, 1], degrees: 4}}\n  - {at: 1")
    )
    np.testing.assert_allclose(turned(found)[[0, 10]].as_rotvec(degrees=True), [[0, 0, 4], [0, 0, 30]], atol=1e-7)


def test_joints_follow_the_object_where_they_can() -> None:
    # All goals 4 mm farther out from the palm, along its z axis, which lies in the plane that each finger bends in.
    changes = [f"position: [{x}, 0, 0.3] -> position: [{x + 0.004:.3f}, 0, 0.3]" for x in (0.075, 0.115)]
    _, start, found = start_for(edited(*changes))
    motion = example_motion()
    np.testing.assert_allclose(found.object_position[:, 0], motion.object_position[:, 0] + 0.004, atol=1e-12)
    for i in range(3):
        before, now = (
            on_finger(m.joint_angles[:, 2 * i : 2 * i + 2], motion.contact_point_link[:, i]) for m in (motion, found)
        )
        np.testing.assert_allclose(now - before, np.tile([0, 0, 0.004], (21, 1)), atol=5e-5)
        np.testing.assert_allclose(start.fingers[i].angles, start.angles[i][[0, 5, 10, 15, 20]], atol=0)


def on_finger(angles: np.ndarray, on_link: np.ndarray) -> np.ndarray:
    """Points (S, 3) of the last link from the finger's base: two joints about x, links along z."""
    first, last = (Rotation.from_rotvec(np.outer(a, [1, 0, 0])) for a in (angles[:, 0], angles.sum(axis=1)))
    reached: np.ndarray = first.apply([0, 0, LENGTHS[0]]) + last.apply(on_link)
    return reached


def test_fingers_of_an_earlier_version_stand_up_and_their_contacts_stay() -> None:
    # Their first joints were in the palm's face. With all as much nearer, this motion is one of the same angles.
    changes = [f"position: [{x}, 0, 0.3] -> position: [{x - HEIGHT:.4f}, 0, 0.3]" for x in (0.075, 0.115)]
    hand, motion = example_hand(), example_motion()
    flat = replace(hand, fingers=tuple(replace(f, base=(*f.base[:2], 0.0)) for f in hand.fingers))
    nearer = replace(motion, object_position=motion.object_position - [HEIGHT, 0, 0])
    task, start, found = start_for(
        edited(*changes), Design(parse_task(edited(*changes)), "feasible", hand=flat, motion=nearer)
    )
    for name in ("object_position", "contact_force", "contact_point_object"):
        np.testing.assert_allclose(getattr(found, name), getattr(nearer, name), atol=1e-9)
    built = hand_of(task, build_model(task), start.fingers, start.contacts, 1.0, 1.0)
    for i, (finger, old) in enumerate(zip(built.fingers, flat.fingers, strict=True)):
        np.testing.assert_allclose(finger.base, [*old.base[:2], HEIGHT], atol=1e-12)
        before, now = (
            base + on_finger(m.joint_angles[:, 2 * i : 2 * i + 2], motion.contact_point_link[:, i])
            for m, base in ((nearer, old.base), (found, finger.base))
        )
        np.testing.assert_allclose(now, before, atol=5e-5)
    # The angles alone would leave them as much too far out as the fingers stand higher.
    assert np.abs(found.joint_angles - nearer.joint_angles).max() > 0.03


def test_bends_stay_and_bent_fingers_follow_the_object() -> None:
    # Each first link bent by 20 degrees about its joint's axis, and the joint turned back by as much: the same motion.
    bend, hand, motion = np.radians(20), example_hand(), example_motion()
    bent = tuple(replace(f, links=(replace(f.links[0], bend=(bend, 0.0)), f.links[1])) for f in hand.fingers)
    turned_back = replace(motion, joint_angles=motion.joint_angles - np.tile([bend, 0.0], 3))
    for changes in ([], [f"position: [{x}, 0, 0.3] -> position: [{x + 0.004:.3f}, 0, 0.3]" for x in (0.075, 0.115)]):
        text = edited(*changes)
        earlier_one = Design(parse_task(HELD), "feasible", hand=replace(hand, fingers=bent), motion=turned_back)
        task, start, found = start_for(text, earlier_one)
        straight = start_for(text)[2]
        np.testing.assert_allclose(found.joint_angles, straight.joint_angles - np.tile([bend, 0.0], 3), atol=1e-9)
        np.testing.assert_allclose(found.contact_point_link, straight.contact_point_link, atol=1e-9)
        built = hand_of(task, build_model(task), start.fingers, start.contacts, 1.0, 1.0)
        for finger in built.fingers:
            assert [link.bend for link in finger.links] == [(bend, 0.0), (0.0, 0.0)]


def test_a_contact_moved_moves_its_points_on_the_surface() -> None:
    _, _, found = start_for(edited("[0, 0.02, -0.01] -> [0, 0.02, -0.005]"))
    wanted = example_motion().contact_point_object.copy()
    wanted[:, 0, 2] += 0.005
    np.testing.assert_allclose(found.contact_point_object, wanted, atol=1e-9)


def test_points_lie_on_an_object_of_another_shape_and_lengths_of_fingers_stay() -> None:
    longer = edited(
        "start: [0, 0, -0.04] -> start: [0, 0, -0.05]", "[0, 0, 0.04], radius: 0.02 -> [0, 0, 0.05], radius: 0.022"
    )
    task, start, found = start_for(longer)
    radii = np.hypot(*np.moveaxis(found.contact_point_object[..., :2], -1, 0))
    np.testing.assert_allclose(radii, 0.022, atol=1e-9)
    built = hand_of(task, build_model(task), start.fingers, start.contacts, 1.0, 1.0)
    assert [link.length for link in built.fingers[0].links] == pytest.approx(LENGTHS, abs=1e-12)
    np.testing.assert_allclose(found.object_position, example_motion().object_position, atol=1e-12)


def test_forces_grow_with_the_object_s_weight() -> None:
    _, _, found = start_for(edited("mass: 0.1 -> mass: 0.15"))
    np.testing.assert_allclose(found.contact_force, 1.5 * example_motion().contact_force, atol=1e-9)


def test_goals_at_other_times_stretch_the_motion() -> None:
    _, start, found = start_for(edited("at: 2, -> at: 3,"))
    np.testing.assert_allclose(found.time, np.linspace(0, 3, 31), atol=1e-12)
    swing = (1 - np.cos(np.pi * np.where(found.time < 1, found.time, 1 + (found.time - 1) / 2))) / 2
    # The earlier motion is known at its samples; in between it is a spline.
    np.testing.assert_allclose(found.object_position[:, 0], 0.075 + 0.04 * swing, atol=1e-5)
    np.testing.assert_allclose(turned(found).as_rotvec(degrees=True)[:, 2], 30 * swing, atol=1e-2)
    np.testing.assert_allclose(found.joint_angles[[10, 20, 30]], example_motion().joint_angles[[10, 15, 20]], atol=1e-9)
    assert [len(finger.angles) for finger in start.fingers] == [5, 5, 5]


def test_a_lifted_contact_is_lifted_at_the_same_share_of_the_way() -> None:
    active = np.ones((21, 3), bool)
    active[12:16, 1] = False
    force = example_motion().contact_force * active[:, :, None]
    design = earlier(motion=replace(example_motion(), contact_active=active, contact_force=force))
    _, _, found = start_for(edited("at: 2, -> at: 3,"), design)
    # From 1.2 s to 1.6 s before, so from 1.4 s to 2.2 s now.
    np.testing.assert_array_equal(np.flatnonzero(~found.contact_active[:, 1]), np.arange(14, 22))
    assert found.contact_active[:, [0, 2]].all()
    assert not found.contact_force[14:22, 1].any()


def test_a_palm_that_the_program_moved_stays_as_far_off_the_task_s() -> None:
    moves = "facing: [1, 0, 0] -> facing: [1, 0, 0], moves: true"
    design = earlier(edited(moves), example_motion((0.0, 0.01, 0.0)))
    _, _, same = start_for(edited(moves), design)
    np.testing.assert_allclose(same.base_position, example_motion((0.0, 0.01, 0.0)).base_position, atol=1e-9)
    _, _, found = start_for(edited(moves, "position: [0, 0, 0.3], -> position: [0, 0, 0.302],"), design)
    np.testing.assert_allclose(found.base_position - same.base_position, np.tile([0, 0, 0.002], (21, 1)), atol=1e-9)
    # The task's palm where it stands is followed at once.
    _, _, still = start_for(edited("position: [0, 0, 0.3], -> position: [0, 0, 0.302],"))
    np.testing.assert_allclose(still.base_position, np.tile([0, 0, 0.302], (21, 1)), atol=1e-12)


def pressing(normal: float, across: float) -> Motion:
    """The motion with other forces: so many weights into the surface and along it, upwards."""
    motion = example_motion()
    inward = np.array([-np.sign(base[1]) * np.array([0, -1.0, 0]) for base in BASES.values()])
    force = WEIGHT * (normal * inward + across * np.array([0, 0, 1.0]))
    return replace(motion, contact_force=np.tile(force, (21, 1, 1)))


def held_margins() -> Margins:
    """What is asked of the hand made by hand."""
    task, start, _ = start_for(HELD)
    return margins_for(build_model(task), start)


@pytest.mark.parametrize(
    ("normal", "use", "status", "margin"),
    [
        (2.1, 0.39, "certified", "larger"),
        (2.1, 0.45, "certified", "ample"),  # more of the friction than the larger leaves
        (1.9, 0.3, "certified", "ample"),
        (1.05, 0.45, "certified", "ample"),
        (1.05, 0.67, "certified", "small"),  # two thirds of the friction
        (0.9, 0.1, "certified", "small"),
        (0.9, 0.1, "feasible", "ample"),
        (3.0, 0.1, "feasible", "ample"),
    ],
)
def test_the_margin_that_a_result_keeps_is_kept(normal: float, use: float, status: str, margin: str) -> None:
    margins = held_margins()
    normal *= margins.ample.normal_force
    found = kept_margin(earlier(motion=pressing(normal, 0.5 * use * normal), status=status))
    assert found == (SMALL if margin == "small" else getattr(margins, margin))


def test_what_the_judge_needs_of_the_object_s_motion() -> None:
    task, start, found = start_for(HELD)
    floating = as_floating(build_model(task), start)
    at = [0, 5, 10, 15, 20]
    np.testing.assert_allclose(floating.pose[:, :3] * LENGTH, found.object_position[at], atol=1e-9)
    np.testing.assert_allclose(np.degrees(floating.pose[:, 5]), [0, 15, 30, 15, 0], atol=1e-7)
    np.testing.assert_allclose(floating.point * LENGTH, found.contact_point_object[at], atol=1e-9)
    assert floating.active.all()


GOAL = "  - {at: 2, position: [0.075, 0, 0.3]}\n"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            ["  thumb: -> pollex:".replace("-> ", "->   ")],
            ["fingers: index, middle, thumb there, index, middle, pollex"],
        ),
        (
            [GOAL + " -> " + GOAL + "  - {at: 3, position: [0.08, 0, 0.3]}\n"],
            ["number of goals: 3 there, 4 in the task"],
        ),
        (["ground: {height: 0.2}"], ["ground: none there, one in the task"]),
        (
            ["  index: {touches: [0, -0.02, 0.02]} -> " + LIFTS.format(0.5, 0.9)],
            ["when finger 'index' lets go: never there, 0.5 s in the task"],
        ),
        (["facing: [1, 0, 0] -> facing: [1, 0, 0], moves: true"], ["palm: where the task has it there, moved by"]),
        (["search: {max_joints: 1}"], ["joints of a finger: 2 there, at most 1 in the task"]),
        (
            ["search: {max_joints: 1}", "ground: {height: 0.2}"],
            ["ground: none there, one in the task; joints of a finger: 2 there"],
        ),
    ],
)
def test_another_structure_is_refused_in_one_message(changes: list[str], words: list[str]) -> None:
    task = parse_task(edited(*changes))
    with pytest.raises(SolveError) as error:
        warm_start(earlier(), task, build_model(task))
    text = str(error.value)
    assert text.startswith("the earlier result, of 'move a capsule & back', is no start for this task: ")
    assert text.endswith("; solving without --from works")
    assert all(word in text for word in words), text


def test_fingers_may_let_go_where_goals_have_moved_to() -> None:
    index = "  index: {touches: [0, -0.02, 0.02]} -> "
    before = parse_task(edited(index + LIFTS.format(0.4, 0.8)))
    slower = ["at: 1, -> at: 2,", "at: 2, position: [0.075 -> at: 4, position: [0.075"]
    said = "when finger 'index' lets go: 0.8 s there, 0.4 s in the task"
    for start, end, words in ((0.8, 1.6, ""), (0.4, 0.8, said)):
        after = parse_task(edited(index + LIFTS.format(start, end), *reversed(slower)))
        assert _other_regrasps(before, after, "index") == words


def test_fingers_may_let_go_after_the_last_goal() -> None:
    index = "  index: {touches: [0, -0.02, 0.02]} -> "
    longer = "name: move -> duration: 4\nname: move"
    task = parse_task(edited(index + LIFTS.format(2.4, 3.2), longer))
    assert _other_regrasps(task, task, "index") == ""


def test_drawings_and_poses_are_no_start_for_each_other() -> None:
    drawing = edited("tool: [0, 0, -0.06]")
    for at, x in ((0, "0.075"), (1, "0.115"), (2, "0.075")):
        drawing = drawing.replace(f"at: {at}, position: [{x}, 0, 0.3]", f"at: {at}, tool_at: [{x}, 0, 0.24]")
    drawing = drawing.replace(", rotation: {axis: [0, 0, 1], degrees: 30}", "")
    task = parse_task(drawing)
    with pytest.raises(SolveError, match="kind of goals: poses there, points to draw in the task"):
        warm_start(earlier(), task, build_model(task))


def test_a_drawing_keeps_its_tool_on_the_path() -> None:
    drawing = edited("tool: [0, 0, -0.06]")
    for at, x in ((0, "0.075"), (1, "0.115"), (2, "0.075")):
        drawing = drawing.replace(f"at: {at}, position: [{x}, 0, 0.3]", f"at: {at}, tool_at: [{x}, 0, 0.24]")
    drawing = drawing.replace(", rotation: {axis: [0, 0, 1], degrees: 30}", "")
    changed = drawing.replace("tool_at: [0.115, 0, 0.24]", "tool_at: [0.115, 0.005, 0.24]")
    _, _, found = start_for(changed.replace("tool: [0, 0, -0.06]", "tool: [0.003, 0, -0.06]"), earlier(drawing))
    tip = found.object_position + turned(found).apply([0.003, 0, -0.06])
    np.testing.assert_allclose(tip[[0, 10, 20]], [[0.075, 0, 0.24], [0.115, 0.005, 0.24], [0.075, 0, 0.24]], atol=1e-9)


def test_a_result_without_a_motion_is_refused() -> None:
    task = parse_task(HELD)
    with pytest.raises(SolveError, match="it holds no hand with a motion; solving without --from works"):
        warm_start(replace(earlier(), motion=None), task, build_model(task))


def test_turns_of_more_than_a_round_stay_where_they_are_counted_from() -> None:
    angles = np.radians(np.arange(-360, 361, 15))
    turns = np.array([[[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]] for a in angles])
    found = continuous_vectors(turns, np.array([0, 0, -2 * np.pi]))
    np.testing.assert_allclose(found, np.outer(angles, [0, 0, 1]), atol=1e-9)
