"""A design on disk and back."""

import hashlib
import json
from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.errors import DesignError
from casadi_hands.export.commands import commanded
from casadi_hands.export.design import Design
from casadi_hands.export.folder import save_design
from casadi_hands.task import parse_task
from tests.export.example import TASK, example_design

FOR_PEOPLE = {"motion.csv", "viewer.html", "report.html"}
KEPT = {"joint_angles", "joint_names"}
FILES = FOR_PEOPLE | {"task.yaml", "hand.urdf", "object.urdf", "scene.xml", "motion.npz", "result.json"}

DRAWING = """
name: draw
object:
  mass: 0.05
  shapes: [{capsule: {start: [0, 0, -0.06], end: [0, 0, 0.06], radius: 0.01}}]
tool: [0, 0, -0.07]
palm: {radius: 0.06, position: [0, 0, 0.3], facing: [0, 0, -1]}
motion: [{at: 0, tool_at: [0, 0, 0]}, {at: 1, tool_at: [0.02, 0, 0]}]
fingers:
  thumb: {touches: [0.01, 0, 0.03]}
  index: {touches: [-0.01, 0, 0.04]}
  middle: {touches: [0, 0.01, 0.02]}
"""


@pytest.fixture
def saved(tmp_path):
    example_design().save(tmp_path / "out")
    return tmp_path / "out"


def record(folder):
    def refuse(constant):
        raise AssertionError(f"{constant} is not JSON")

    return json.loads((folder / "result.json").read_text(), parse_constant=refuse)


def test_a_folder_holds_every_file(saved):
    assert {path.name for path in saved.iterdir()} == FILES


def test_what_is_for_people_is_left_out_where_nobody_looks_at_it(saved):
    save_design(example_design(), saved, page=False)
    assert {path.name for path in saved.iterdir()} == FILES - FOR_PEOPLE


def test_a_design_comes_back_as_it_was(saved):
    design, loaded = example_design(), Design.load(saved)
    for item in fields(Design):
        if item.name != "motion":
            assert getattr(loaded, item.name) == getattr(design, item.name), item.name
    # The joints' velocities, torques and commands are added; nothing is made up of what no task asked for.
    motion = commanded(design.task, design.hand, design.motion)
    for item in fields(motion):
        assert np.array_equal(getattr(loaded.motion, item.name), getattr(motion, item.name)), item.name
    assert loaded.motion.contact_force_disturbed is None


def test_bent_links_come_back_as_they_were_and_straight_ones_of_earlier_folders(tmp_path):
    design, bends = example_design(), iter([(0.1, -0.2), (1.2, 0.7), (-1e-17, np.pi / 2), (0.0, 0.0), (0.3, 0), (0, 1)])
    fingers = tuple(
        replace(finger, links=tuple(replace(link, bend=tuple(map(float, next(bends)))) for link in finger.links))
        for finger in design.hand.fingers
    )
    replace(design, hand=replace(design.hand, fingers=fingers)).save(tmp_path)
    content = record(tmp_path)
    for finger, built, read in zip(
        content["hand"]["fingers"], fingers, Design.load(tmp_path).hand.fingers, strict=True
    ):
        for link, made, loaded in zip(finger["links"], built.links, read.links, strict=True):
            assert replace(loaded, axis=made.axis) == made
            assert loaded.axis == pytest.approx(made.axis, abs=1e-15)
            assert tuple(link.pop("bend")) == made.bend
            # As ever, in the parent's frame.
            assert link["axis"] == pytest.approx(Rotation.from_rotvec([*made.bend, 0]).apply(made.axis), abs=1e-15)
            link["axis"] = list(made.axis)
    (tmp_path / "result.json").write_text(json.dumps(content))
    assert Design.load(tmp_path).hand.fingers == design.hand.fingers


def test_disturbed_forces_come_back_as_they_were(tmp_path):
    design, rng = example_design(), np.random.default_rng(0)
    disturbed = {
        "contact_force_disturbed": rng.normal(size=(21, 3, 3)),
        "external_force_disturbed": rng.normal(size=(21, 3)),
        "external_torque_disturbed": rng.normal(size=(21, 3)),
    }
    replace(design, motion=replace(design.motion, **disturbed)).save(tmp_path)
    loaded = Design.load(tmp_path)
    for name, value in disturbed.items():
        assert np.array_equal(getattr(loaded.motion, name), value), name


def test_replays_come_back_as_they_were_and_earlier_folders_have_none(saved):
    entry = {"engine": "mujoco", "mean": {"mm": 0.5, "degrees": 1.0}, "dropped_as_planned": False, "dropped": 1}
    replays = [{**entry, "of": 12}]
    replace(example_design(), replays=replays).save(saved)
    assert record(saved)["replays"] == replays
    assert Design.load(saved).replays == replays
    earlier = {name: value for name, value in record(saved).items() if name not in ("replays", "task_hash")}
    (saved / "result.json").write_text(json.dumps(earlier))
    assert Design.load(saved).replays == []


def test_a_motion_of_an_earlier_version_has_no_commands(saved):
    with np.load(saved / "motion.npz") as file:
        earlier = {name: file[name] for name in file.files if not name.startswith("joint_") or name in KEPT}
    np.savez(saved / "motion.npz", **earlier)
    motion = Design.load(saved).motion
    assert (motion.joint_velocities, motion.joint_torques, motion.joint_commands) == (None, None, None)
    assert np.array_equal(motion.joint_angles, example_design().motion.joint_angles)


def test_saving_again_gives_the_same_bytes(saved, tmp_path):
    Design.load(saved).save(tmp_path / "again")
    for name in FILES:
        assert (saved / name).read_bytes() == (tmp_path / "again" / name).read_bytes(), name


def test_the_record_says_what_the_format_says(saved):
    result = record(saved)
    assert result["format"] == 1
    assert result["task_hash"] == hashlib.sha256((saved / "task.yaml").read_bytes()).hexdigest()
    assert result["replays"] == []
    assert (result["status"], result["task"], result["degrees_of_freedom"]) == ("feasible", "move a capsule & back", 6)
    assert result["object"]["shapes"] == [
        {"type": "capsule", "start": [0, 0, -0.04], "end": [0, 0, 0.04], "radius": 0.02}
    ]
    assert (result["friction"], result["gravity"]) == (0.5, [0, 0, -9.81])
    assert (result["ground_height"], result["ground_friction"]) == (0.2, 0.8)
    assert result["hand"]["palm"] == {"radius": 0.06, "thickness": 0.012}
    index = result["hand"]["fingers"][1]
    assert (index["name"], index["base"]) == ("index", [0.02, 0.045, 1.05 * 0.008])
    assert index["links"][1] == {
        "length": 0.08,
        "radius": 0.008,
        "axis": [1, 0, 0],
        "bend": [0, 0],
        "hinge": 0,
    }
    assert {"casadi-hands", "casadi", "pin", "numpy"} <= set(result["versions"])
    assert result["certificate"]["slip"]["holds"] is False
    assert result["costs"]["whole_hand"]["torque"] == {"weight": 0.05, "value": 1.25}


def test_goals_are_poses_of_the_centre_of_mass(saved):
    goals = record(saved)["goals"]
    assert [goal["time"] for goal in goals] == [0, 1, 2]
    assert goals[1]["position"] == [0.115, 0, 0.3]
    assert goals[1]["orientation"] == pytest.approx([np.cos(np.pi / 12), 0, 0, np.sin(np.pi / 12)])
    assert goals[0]["orientation"] == [1, 0, 0, 0]


def test_goals_of_a_drawing_are_points_of_its_tool(tmp_path):
    Design(task=parse_task(DRAWING), status="failed", reason="nothing tried").save(tmp_path)
    assert record(tmp_path)["goals"] == [
        {"time": 0, "point": [0, 0, 0], "tool_point": [0, 0, -0.07]},
        {"time": 1, "point": [0.02, 0, 0], "tool_point": [0, 0, -0.07]},
    ]
    assert record(tmp_path)["ground_height"] is None


def test_a_failed_design_keeps_what_exists(tmp_path):
    whole = example_design()
    free = replace(whole.motion, joint_angles=np.zeros((21, 0)), joint_names=())
    Design(task=whole.task, status="failed", reason="stopped", motion=free).save(tmp_path / "floating")
    assert {path.name for path in (tmp_path / "floating").iterdir()} == FILES - {"hand.urdf", "scene.xml"}
    Design(task=whole.task, status="failed", reason="stopped", hand=whole.hand).save(tmp_path / "synthesis")
    assert {path.name for path in (tmp_path / "synthesis").iterdir()} == FILES - {
        "motion.npz",
        "motion.csv",
        "scene.xml",
    }
    assert Design.load(tmp_path / "floating").hand is None
    assert Design.load(tmp_path / "synthesis").motion is None
    assert Design.load(tmp_path / "synthesis").hand == whole.hand


def test_a_smaller_design_leaves_nothing_of_the_one_before(saved):
    Design(task=parse_task(TASK), status="failed", reason="nothing tried").save(saved)
    pages = {"viewer.html", "report.html"}
    assert {path.name for path in saved.iterdir()} == {"task.yaml", "object.urdf", "result.json", *pages}


def test_numbers_that_are_not_finite_are_null(tmp_path):
    stages = [{"objective": float("nan"), "seconds": np.float64(2.5), "iterations": np.int64(3), "inf": float("inf")}]
    replace(example_design(), stages=stages).save(tmp_path)
    assert record(tmp_path)["stages"] == [{"objective": None, "seconds": 2.5, "iterations": 3, "inf": None}]


def test_an_unknown_status_is_refused(tmp_path):
    with pytest.raises(DesignError, match="certified, feasible, failed, not 'good'"):
        replace(example_design(), status="good").save(tmp_path)


def test_a_file_in_the_way_is_reported(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(DesignError, match="cannot write the design here"):
        example_design().save(tmp_path / "out")


def edit(folder, **changes):
    (folder / "result.json").write_text(json.dumps({**record(folder), **changes}))


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda folder: (folder / "result.json").unlink(), "no result.json"),
        (lambda folder: (folder / "motion.npz").unlink(), "motion.npz: missing"),
        (lambda folder: (folder / "task.yaml").unlink(), "task cannot be read"),
        (lambda folder: (folder / "result.json").write_text("{"), "cannot be read"),
        (lambda folder: edit(folder, format=2), "its format is 2; this version reads format 1"),
        (lambda folder: edit(folder, hand={"palm": {}}), "result.json: lacks hand.palm.radius"),
    ],
)
def test_a_spoilt_folder_is_refused(saved, spoil, message):
    spoil(saved)
    with pytest.raises(DesignError, match=message):
        Design.load(saved)


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(DesignError, match="there is no such folder"):
        Design.load(tmp_path / "nowhere")


def test_a_motion_of_another_hand_is_refused(saved):
    result = record(saved)
    result["hand"]["fingers"].pop()
    edit(saved, hand=result["hand"])
    with pytest.raises(DesignError, match="moves other joints"):
        Design.load(saved)


def test_a_motion_of_joints_without_a_hand_is_refused(saved):
    edit(saved, hand=None)
    with pytest.raises(DesignError, match=r"moves joints, and result\.json has no hand"):
        Design.load(saved)
