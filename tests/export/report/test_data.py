"""Numbers of the report against closed forms, the exported hand, and servos' own data."""

import re
from dataclasses import replace
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest

from casadi_hands.export.page.timeline import Timeline
from casadi_hands.export.report.data import goal_errors, panels
from casadi_hands.export.report.drawing import finger_drawings, palm_drawing, stretched
from casadi_hands.export.report.motors import Demand, demands, fit, lightest
from casadi_hands.export.report.slip import slip_so_far
from casadi_hands.problem.drive import Drive
from casadi_hands.problem.hand import Finger, Hand, Link
from casadi_hands.task.servos import SERVOS
from tests.export.example import example_design, example_hand, example_motion
from tests.export.test_urdf import chain, odd_hand, turn

RADIUS, WAY = 0.03, 0.2


def on_the_ground(time, position, rotations, contact, active=None):
    """A body that only the ground touches, as a motion and a timeline; `contact` (S, 3) is in the body's frame."""
    count = len(time)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotations, position
    motion = replace(
        example_motion(),
        time=time,
        contact_names=("ground",),
        contact_link=("ground",),
        contact_active=np.ones((count, 1), dtype=bool) if active is None else active[:, None],
        contact_point_object=contact[:, None],
        contact_point_link=np.zeros((count, 1, 3)),
    )
    return motion, Timeline(time, np.tile(np.eye(4), (count, 1, 1)), poses, {})


def swing(time):
    """From 0 to 1 and at rest at both ends."""
    return (1 - np.cos(np.pi * time / time[-1])) / 2


def test_what_slides_slips_as_far_as_it_goes():
    time = np.linspace(0, 2, 41)
    way = WAY * swing(time)
    contact = np.tile([0, 0, -RADIUS], (41, 1))
    motion, timeline = on_the_ground(time, way[:, None] * [1, 0, 0], np.tile(np.eye(3), (41, 1, 1)), contact)
    assert slip_so_far(motion, timeline)[:, 0] == pytest.approx(way, abs=1e-3 * WAY)


def test_what_rolls_does_not_slip():
    time = np.linspace(0, 2, 41)
    way = WAY * swing(time)
    rotations = np.array([turn(np.array([0.0, 1.0, 0.0]), angle) for angle in way / RADIUS])
    contact = np.einsum("sji,j->si", rotations, [0, 0, -RADIUS])
    motion, timeline = on_the_ground(time, way[:, None] * [1, 0, 0], rotations, contact)
    assert slip_so_far(motion, timeline)[-1, 0] < 2e-3 * WAY


def test_slip_counts_from_every_touch_anew():
    time = np.linspace(0, 2, 41)
    active = np.ones(41, dtype=bool)
    active[15:20] = False
    contact = np.tile([0, 0, -RADIUS], (41, 1))
    way = WAY * swing(time)
    motion, timeline = on_the_ground(time, way[:, None] * [1, 0, 0], np.tile(np.eye(3), (41, 1, 1)), contact, active)
    slip = slip_so_far(motion, timeline)[:, 0]
    assert np.isnan(slip).tolist() == (~active).tolist()
    assert slip[14] == pytest.approx(way[14], rel=1e-3)
    assert slip[20] == 0
    assert slip[-1] == pytest.approx(way[-1] - way[20], rel=1e-3)


def test_errors_at_goals_are_those_that_the_motion_was_given():
    design = example_design()
    offset = np.array([0.0, 0.003, 0.004])
    shifted = replace(design.motion, object_position=design.motion.object_position + offset)
    assert goal_errors(design.task, shifted) == [
        (pytest.approx(5.0), pytest.approx(0.0, abs=1e-5)),
        (pytest.approx(5.0), pytest.approx(0.0, abs=1e-5)),
        (pytest.approx(5.0), pytest.approx(0.0, abs=1e-5)),
    ]


def test_each_panel_has_what_its_title_says():
    design = example_design()
    found = {panel.key: panel for panel in panels(design)}
    assert list(found) == [
        *("angles", "speeds", "torques", "commands", "distance", "turn", "forces", "contacts", "slip"),
    ]
    names = [f"{finger}, joint {j}" for finger in ("thumb", "index", "middle") for j in (1, 2)]
    assert [curve.label for curve in found["angles"].curves] == names
    assert np.radians(found["angles"].curves[3].values) == pytest.approx(design.motion.joint_angles[:, 3])
    # Just after a goal the object is as far from the next one as that is away.
    assert found["distance"].curves[0].values[1] == pytest.approx(40 - 40 * (1 - np.cos(0.1 * np.pi)) / 2)
    assert found["turn"].curves[0].values[11] == pytest.approx(30 * (1 - np.cos(1.1 * np.pi)) / 2)
    thumb = np.linalg.norm(design.motion.contact_force[:, 0], axis=1)
    assert found["forces"].curves[0].values == pytest.approx(thumb)
    label, value, k = found["forces"].largest
    assert (label, value) == ("thumb", pytest.approx(thumb.max()))
    assert thumb[k] == thumb.max()


def test_motors_that_share_joints_do_the_joints_work():
    rng = np.random.default_rng(0)
    ratios = rng.normal(size=(6, 2))
    hand = replace(example_hand(), drive=Drive(tuple(map(tuple, ratios)), (0.0,) * 6, 1.0, 1.0))
    torques, speeds = rng.normal(size=6), rng.normal(size=2)
    count = 21
    motion = replace(
        example_motion(),
        joint_torques=np.tile(torques, (count, 1)),
        joint_velocities=np.tile(ratios @ speeds, (count, 1)),
        motor_positions=example_motion().time[:, None] * speeds,
    )
    asked = demands(hand, motion)
    assert [each.name for each in asked] == ["motor 1", "motor 2"]
    signs = np.sign(ratios.T @ torques) * np.sign(speeds)
    power = sum(sign * each.torque[0] * each.speed[0] for sign, each in zip(signs, asked, strict=True))
    assert power == pytest.approx(torques @ ratios @ speeds)


@pytest.mark.parametrize("name", SERVOS)
def test_a_servo_at_what_it_can_hold_is_wholly_used(name):
    servo = SERVOS[name]
    found = fit(name, [Demand("a joint", np.array([servo.continuous]), np.array([servo.speed]))])
    assert (found.torque, found.speed) == (pytest.approx(1.0), pytest.approx(1.0))
    assert found.moment == pytest.approx(servo.continuous / servo.stall)
    easier = fit(name, [Demand("a joint", np.array([0.99 * servo.continuous]), np.array([0.99 * servo.speed]))])
    assert (easier.does, easier.words) == (True, "would do")


def test_words_of_servos_say_what_is_wrong_with_them():
    servo = SERVOS["SG90"]

    def words(torque, speed):
        return fit(
            "SG90", [Demand("a joint", np.array([torque * servo.stall]), np.array([speed * servo.no_load]))]
        ).words

    assert words(0.5, 0.1) == "only for moments"
    assert words(1.5, 0.0) == "too weak"
    assert words(0.1, 0.95) == "too slow"
    assert lightest(Demand("a joint", np.array([0.05]), np.array([1.0]))) == "XL330-M288"
    assert lightest(Demand("a joint", np.array([5.0]), np.array([1.0]))) is None


def test_stretched_fingers_stand_where_the_chain_of_their_turns_does():
    hand = odd_hand()
    poses = chain(hand, np.zeros(6))
    for i, finger in enumerate(hand.fingers):
        for j, (placed, link) in enumerate(zip(stretched(finger), finger.links, strict=True)):
            rotation, position = poses[f"finger{i}_link{j}"]
            np.testing.assert_allclose(placed.joint, position, atol=1e-12)
            np.testing.assert_allclose(placed.end, position + link.length * rotation[:, 2], atol=1e-12)
            np.testing.assert_allclose(placed.axis, rotation @ link.axis, atol=1e-12)


def texts(drawing):
    return [each.text for each in ElementTree.fromstring(drawing).iter("text")]


def test_drawings_tell_every_number_once():
    finger = Finger(
        "<b>&", (0.01, -0.02, 0.008), (Link(0.07, 0.008, (1, 0, 0), (0.1, 0.2), 0.016), Link(0.05, 0.006, (0, 1, 0)))
    )
    hand = Hand(0.06, 0.012, (finger,), -1, 1, 1, 1, 1000)
    for drawing in finger_drawings(hand, 0):
        told = texts(drawing)
        assert [told.count(each) for each in ("70.0 mm", "50.0 mm", "joint 1", "joint 2", "bend 12.8°")] == [1] * 5
        assert told.count("radius 6.0 mm") == 1
        assert not any(each.startswith("bend 0") for each in told)
    assert {"<b>&", "10.0, −20.0"} <= set(texts(palm_drawing(hand)))
    assert texts(palm_drawing(hand, numbers=False)) == []


def test_lengths_are_drawn_in_one_scale():
    hand = replace(
        example_hand(),
        fingers=(*example_hand().fingers, Finger("short", (0, 0, 0.01), (Link(0.02, 0.008, (1, 0, 0)),))),
    )

    def drawn(index):
        lines = ElementTree.fromstring(finger_drawings(hand, index)[0]).findall("line[@class='dimension']")
        return [float(each.get("y1")) - float(each.get("y2")) for each in lines[::3]]

    ratio = drawn(0)[0] / 0.07
    assert drawn(0)[1] == pytest.approx(0.08 * ratio, abs=0.2)
    assert drawn(3)[0] == pytest.approx(0.02 * ratio, abs=0.2)


@pytest.mark.parametrize("index", range(3))
def test_texts_of_a_drawing_are_not_over_each_other(index):
    for drawing in finger_drawings(odd_hand(), index):
        placed = [
            (each.get("text-anchor"), float(each.get("y")), each.text)
            for each in ElementTree.fromstring(drawing).iter("text")
            if re.match(r"joint|bend|radius|[\d.]+ mm", each.text)
        ]
        for anchor in ("start", "end"):
            heights = sorted(y for side, y, _ in placed if side == anchor)
            assert all(b - a >= 12 for a, b in pairwise(heights))
