"""The page: what is embedded in it moves as the motion says, and it needs nothing else."""

import json
import re
from base64 import b64decode
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
import umsgpack

from casadi_hands.export.design import Design
from casadi_hands.export.page.page import MenuEntry, write_page
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.task import parse_task
from tests.export.example import TASK, example_design, example_hand, example_motion, example_task


def embedded(path):
    """The page's data and its drawing commands."""
    data = json.loads(re.search(r'<script id="design"[^>]*>(.*?)</script>', path.read_text(), re.S)[1])
    return data, [umsgpack.unpackb(b64decode(command)) for command in data["commands"]]


def tracks(commands):
    """Node path -> property -> (times, values)."""
    (animation,) = (command for command in commands if command["type"] == "set_animation")
    return {
        item["path"]: {
            track["name"][1:]: (
                np.array([key["time"] for key in track["keys"]]),
                np.array([key["value"] for key in track["keys"]]),
            )
            for track in item["clip"]["tracks"]
        }
        for item in animation["animations"]
    }


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "viewer.html"
    write_page(example_design(), path)
    return path


def matrix(track, k):
    """Pose (4, 4) of a node at its key k, relative to its parent."""
    x, y, z, w = track["quaternion"][1][k]
    pose = np.eye(4)
    pose[:3, :3] = pin.Quaternion(w, x, y, z).matrix()
    pose[:3, 3] = track["position"][1][k]
    return pose


def test_every_link_moves_as_the_exported_hand_does(page):
    _, commands = embedded(page)
    moving, motion = tracks(commands), example_motion()
    model = pin.buildModelFromXML(hand_urdf(example_hand()))
    data = model.createData()
    names = [finger.name for finger in example_hand().fingers]
    for k in (0, 7, 20):
        configuration = pin.neutral(model)
        for name, angle in zip(motion.joint_names, motion.joint_angles[k], strict=True):
            configuration[model.joints[model.getJointId(name)].idx_q] = angle
        pin.framesForwardKinematics(model, data, configuration)
        palm = matrix(moving["/design/palm"], k)
        assert palm[:3, 3] == pytest.approx(motion.base_position[k])
        for i in range(3):
            first = palm @ matrix(moving[f"/design/palm/{names[i]} link 1"], k)
            second = first @ matrix(moving[f"/design/palm/{names[i]} link 1/{names[i]} link 2"], k)
            for j, pose in enumerate((first, second)):
                expected = data.oMf[model.getFrameId(f"finger{i}_link{j}")].homogeneous
                assert pose == pytest.approx(palm @ expected, abs=1e-12)


def test_the_object_moves_as_the_motion_says_with_a_key_at_every_sample(page):
    _, commands = embedded(page)
    motion, item = example_motion(), tracks(commands)["/design/object"]
    assert item["position"][0] == pytest.approx(motion.time)
    assert item["position"][1] == pytest.approx(motion.object_position)
    assert item["quaternion"][1] == pytest.approx(motion.object_orientation[:, [1, 2, 3, 0]])


def test_arrows_end_at_contacts_point_along_forces_and_hide_without_one(tmp_path):
    motion = example_motion()
    active = np.ones((21, 3), dtype=bool)
    active[8:12, 1] = False
    force = motion.contact_force * active[:, :, None]
    path = tmp_path / "viewer.html"
    write_page(replace(example_design(), motion=replace(motion, contact_active=active, contact_force=force)), path)
    moving = tracks(embedded(path)[1])
    arrow = moving["/design/object/forces/at index"]
    assert arrow["visible"][1].tolist() == active[:, 1].tolist()
    assert arrow["position"][1][5] == pytest.approx(motion.contact_point_object[5, 1])
    lengths = {}
    for name, c in (("thumb", 0), ("index", 1)):
        node = f"/design/object/forces/at {name}"
        world = matrix(moving["/design/object"], 5) @ matrix(moving[node], 5)
        assert world[:3, 2] == pytest.approx(force[5, c] / np.linalg.norm(force[5, c]), abs=1e-9)
        shaft, position = moving[f"{node}/shaft"]["scale"][1][5], moving[f"{node}/shaft"]["position"][1][5]
        lengths[name] = shaft[2] - position[2]
    ratio = np.linalg.norm(force[5, 0]) / np.linalg.norm(force[5, 1])
    assert lengths["thumb"] / lengths["index"] == pytest.approx(ratio)


def test_each_goal_pose_has_one_ghost(page):
    _, commands = embedded(page)
    placed = {
        command["path"]: np.reshape(command["matrix"], (4, 4)).T
        for command in commands
        if command["type"] == "set_transform" and re.fullmatch(r"/design/goals/goal \d", command["path"])
    }
    assert [placed[f"/design/goals/goal {k}"][0, 3] for k in (1, 2)] == [0.075, 0.115]
    assert len(placed) == 2


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_any_scene_fits_a_ball_of_radius_one(tmp_path, size):
    hand, motion, task = example_hand(), example_motion(), example_task()
    large = replace(hand, palm_radius=hand.palm_radius * size)  # the largest thing, or of no size
    path = tmp_path / "viewer.html"
    write_page(Design(task=task, status="failed", hand=large, motion=motion), path)
    (root,) = (c for c in embedded(path)[1] if c["type"] == "set_transform" and c["path"] == "/design")
    transform = np.reshape(root["matrix"], (4, 4)).T
    rim = motion.base_position[0] + large.palm_radius * np.array([[0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    points = np.vstack([rim, motion.object_position])
    distances = np.linalg.norm(points @ transform[:3, :3].T + transform[:3, 3], axis=1)
    assert 0.5 < distances.max() <= 1.0


def test_the_page_needs_no_network(page):
    text = page.read_text()
    # A name space, which no browser fetches, and the socket of a connect() that the page never calls.
    addresses = set(re.findall(r"\b(?:https?|wss?|ftp)://[^\s\"'`)]*", text))
    assert addresses <= {"http://www.w3.org/1999/xhtml", "ws://${location.host}"}
    # The browser itself is told to load nothing.
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    assert policy.startswith("default-src 'none';")
    assert "http" not in policy
    assert "*" not in policy
    assert "viewer.connect" not in text
    assert not re.search(r"<(?:script|img|link|iframe)[^>]*\b(?:src|href)=", text)
    assert len(text) < 3e6


def test_a_menu_links_to_other_pages_and_marks_its_own(page, tmp_path):
    entries = [MenuEntry("seed 1 <best>", None), MenuEntry('seed "2"', 'alternatives/a&b"c/viewer.html')]
    write_page(example_design(), tmp_path / "viewer.html", menu=entries)
    text = (tmp_path / "viewer.html").read_text()
    links = re.search(r'<nav id="menu".*?</nav>', text)[0]
    own, other = ElementTree.fromstring(links)
    assert (own.text, own.attrib) == ("seed 1 <best>", {"aria-current": "page"})
    assert (other.text, other.attrib) == ('seed "2"', {"href": 'alternatives/a&b"c/viewer.html'})
    # Nothing else is changed, and without entries there is no menu.
    assert text.replace(links, "") == page.read_text()


def test_equal_designs_give_equal_pages(page, tmp_path):
    write_page(example_design(), tmp_path / "again.html")
    assert (tmp_path / "again.html").read_bytes() == page.read_bytes()


def test_names_cannot_break_the_page(tmp_path):
    task = parse_task(TASK.replace("move a capsule & back", "'</script><b>{{meshcat}}'"))
    write_page(Design(task=task, status="failed"), tmp_path / "viewer.html")
    text = (tmp_path / "viewer.html").read_text()
    assert "<title>&lt;/script&gt;&lt;b&gt;{{meshcat}}</title>" in text
    assert embedded(tmp_path / "viewer.html")[0]["span"] == [0, 0]


def test_a_design_without_motion_stands_still(tmp_path):
    write_page(Design(task=example_task(), status="failed", hand=example_hand()), tmp_path / "viewer.html")
    data, commands = embedded(tmp_path / "viewer.html")
    assert data["span"] == [0, 0]
    assert {command["type"] for command in commands} == {"set_object", "set_transform"}
    drawn = {command["path"] for command in commands if command["type"] == "set_object"}
    assert any(path.startswith("/design/palm/middle link 1/middle link 2/") for path in drawn)


def test_a_page_can_open_at_a_time(tmp_path):
    write_page(example_design(), tmp_path / "viewer.html", time=1.5)
    assert embedded(tmp_path / "viewer.html")[0]["start"] == 1.5
