"""The exported hand, read back."""

import numpy as np
import pytest

from casadi_hands.export.page.robot import Robot
from casadi_hands.export.urdf import hand_urdf, object_urdf
from tests.export.example import BASES, LENGTHS, example_hand, example_motion, example_task
from tests.export.test_urdf import chain, odd_hand


def test_links_hang_in_chains_from_the_palm():
    robot = Robot(hand_urdf(example_hand()))
    assert robot.parents == {
        "palm": None,
        **{f"finger{i}_link0": "palm" for i in range(3)},
        **{f"finger{i}_link1": f"finger{i}_link0" for i in range(3)},
    }
    seen = set()
    for link, parent in robot.parents.items():
        assert parent is None or parent in seen
        seen.add(link)


def test_link_poses_are_those_of_a_planar_arm():
    robot, motion = Robot(hand_urdf(example_hand())), example_motion()
    poses = robot.link_poses(dict(zip(motion.joint_names, motion.joint_angles[5], strict=True)))
    assert poses["palm"] == pytest.approx(np.eye(4))
    for i, base in enumerate(BASES.values()):
        angle = motion.joint_angles[5, 2 * i]
        elbow = np.array(base) + LENGTHS[0] * np.array([0.0, -np.sin(angle), np.cos(angle)])
        assert poses[f"finger{i}_link0"][:3, 3] == pytest.approx(base)
        assert poses[f"finger{i}_link1"][:3, 3] == pytest.approx(elbow, abs=1e-12)


def test_bent_links_stand_where_their_turns_take_them():
    hand, angles = odd_hand(), np.random.default_rng(1).uniform(-1, 1, 6)
    poses = Robot(hand_urdf(hand)).link_poses(dict(zip(hand.joint_names, angles, strict=True)))
    for name, (rotation, position) in chain(hand, angles).items():
        np.testing.assert_allclose(poses[name][:3, :3], rotation, atol=1e-12)
        np.testing.assert_allclose(poses[name][:3, 3], position, atol=1e-12)


def test_shapes_are_those_exported():
    shapes = Robot(hand_urdf(example_hand())).shapes
    (palm,) = (shape for shape in shapes if shape.link == "palm")
    assert (palm.radius, palm.length) == (0.06, pytest.approx(0.012))
    assert palm.placement[:3, 3] == pytest.approx([0, 0, -0.006])
    segment = [shape for shape in shapes if shape.link == "finger2_link1"]
    assert sorted(shape.placement[2, 3] for shape in segment) == pytest.approx([0.0, 0.04, 0.08])
    assert {shape.radius for shape in segment} == {0.008}
    assert len({shape.color for shape in shapes if shape.link.endswith("link0") and shape.length}) == 3
    assert len(Robot(object_urdf(example_task())).shapes) == 3


def test_the_reach_of_a_cylinder_is_to_its_rim():
    (palm,) = (shape for shape in Robot(hand_urdf(example_hand())).shapes if shape.link == "palm")
    assert palm.reach == pytest.approx(np.hypot(0.06, 0.006))
