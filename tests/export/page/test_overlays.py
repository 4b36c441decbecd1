"""Axes, paths and names in the scene, against the motion and Pinocchio's own model."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest

from casadi_hands.export.page.names import link_name, named
from casadi_hands.export.page.overlays import thinned, tube
from casadi_hands.export.page.page import write_page
from casadi_hands.export.page.robot import Robot, object_robot
from casadi_hands.export.page.scene import draw_scene, views
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.task import parse_task
from tests.export.example import TASK, example_design, example_hand, example_motion
from tests.export.page.test_page import embedded
from tests.export.test_urdf import odd_hand


@pytest.mark.parametrize("hand", [example_hand(), odd_hand()])
def test_axes_are_those_that_links_turn_about(hand):
    urdf = hand_urdf(hand)
    axes, model = Robot(urdf).axes, pin.buildModelFromXML(urdf)
    data = model.createData()
    assert len(axes) == model.nv
    for name, axis in axes.items():
        frame = model.getFrameId(name)
        joint = model.frames[frame].parentJoint
        rate = np.zeros(model.nv)
        rate[model.joints[joint].idx_v] = 1.0
        pin.forwardKinematics(model, data, pin.neutral(model), rate)
        pin.updateFramePlacements(model, data)
        # The link's own joint turning alone: its angular velocity in its own frame.
        assert pin.getFrameVelocity(model, data, frame).angular == pytest.approx(axis, abs=1e-9)


def test_a_line_is_thinned_to_where_it_turns(rng):
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 2]], float)
    line = np.vstack([np.linspace(a, b, 50) for a, b in pairwise(corners)])
    assert thinned(line, 1e-3) == pytest.approx(corners)
    curve = np.cumsum(rng.normal(size=(200, 3)), axis=0)
    few = thinned(curve, 0.5)
    assert 2 < len(few) < 200
    # Every point is within the tolerance of the line through those that are kept.
    starts, ways = few[:-1], np.diff(few, axis=0)
    share = np.clip(np.einsum("psi,si->ps", curve[:, None] - starts, ways) / (ways**2).sum(axis=1), 0, 1)
    off = np.linalg.norm(curve[:, None] - starts - share[..., None] * ways, axis=2)
    assert off.min(axis=1).max() <= 0.5 + 1e-9


def test_a_tube_is_as_thick_as_said_and_closed_around():
    points = np.array([[0, 0, 0], [0, 0, 1], [0, 0, 3]], float)
    vertices, triangles = tube(points, 0.1)
    assert np.hypot(vertices[:, 0], vertices[:, 1]) == pytest.approx(0.1)
    corners = vertices[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # A prism of five sides, seen from outside.
    assert np.linalg.norm(across, axis=1).sum() / 2 == pytest.approx(3 * 5 * 0.2 * np.sin(np.pi / 5))
    assert (np.einsum("ti,ti->t", across[:, :2], corners.mean(axis=1)[:, :2]) > 0).all()


def test_a_path_has_gaps_where_a_finger_is_off(tmp_path):
    motion = example_motion()
    active = motion.contact_active.copy()
    active[8:12, 1] = False
    design = replace(example_design(), motion=replace(motion, contact_active=active))
    write_page(design, tmp_path / "viewer.html")
    drawn = [each["path"] for each in embedded(tmp_path / "viewer.html")[1] if each["type"] == "set_object"]
    parts = [path.removeprefix("/design/contact paths/") for path in drawn if "/contact paths/" in path]
    assert parts == ["thumb/part 1", "index/part 1", "index/part 2", "middle/part 1"]


def test_names_are_peoples(tmp_path):
    assert link_name("finger1_link0", ["thumb", "index"]) == "index link 1"
    assert link_name("palm", []) == "palm"
    # A slash would begin another level of the tree.
    assert link_name("finger0_link2", ["left/right"]) == "left\u2215right link 3"
    many = TASK.replace(
        "- capsule: {start: [0, 0, -0.04], end: [0, 0, 0.04], radius: 0.02}",
        "[box: {center: [0, 0, 0], size: [0.04, 0.04, 0.08]}, box: {center: [0, 0, 0.02], size: [0.04, 0.04, 0.08]}]",
    )
    shapes = object_robot(parse_task(many)).shapes
    assert [name for name, _ in named(shapes)] == ["box 1", "box 2"]
    kinds = [name for name, _ in named(object_robot(example_design().task).shapes)]
    assert sorted(kinds) == ["cylinder 1", "sphere 1", "sphere 2"]


@pytest.mark.parametrize("facing", [(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, -0.6, 0.8)])
def test_views_are_of_unit_length_and_apart(facing):
    found = np.array(list(views(np.array(facing)).values()))
    assert np.linalg.norm(found, axis=1) == pytest.approx(1)
    assert np.triu(found @ found.T, 1).max() < 0.9


def test_what_has_no_motion_has_no_buttons_for_it():
    names = [layer.name for layer in draw_scene(replace(example_design(), motion=None)).layers]
    assert names == ["Goals", "Joint axes"]
    assert [layer.name for layer in draw_scene(example_design()).layers] == [
        "Forces",
        "Goals",
        "Contact paths",
        "Joint axes",
    ]
