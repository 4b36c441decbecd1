"""Exports of one file, and what all exports share."""

import csv
import io
from dataclasses import fields, replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from casadi_hands.errors import DesignError, HandsError
from casadi_hands.export.arrays import save_motion
from casadi_hands.export.design import Design
from casadi_hands.export.mjcf import scene_mjcf
from casadi_hands.export.table import motion_table
from casadi_hands.export.targets import TARGETS, export_design
from casadi_hands.export.targets.source import Source
from casadi_hands.problem.motion import Motion
from tests.export.example import example_design, example_motion
from tests.export.test_shared_motors import shared, shared_motion


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A design whose palm moves."""
    directory = tmp_path_factory.mktemp("design")
    replace(example_design(), motion=example_motion(palm_shift=(0.0, 0.02, 0.05))).save(directory)
    return directory


def contents(path):
    files = [path] if path.is_file() else sorted(item for item in path.rglob("*") if item.is_file())
    return {str(file.relative_to(path.parent)): file.read_bytes() for file in files}


def test_drives_of_joints_that_share_motors_press_as_planned(tmp_path):
    """Each with a damper of its own, as MuJoCo's position actuators have, by whose gains torques are computed."""
    replace(example_design(), hand=shared(), motion=shared_motion()).save(tmp_path)
    source = Source.read(tmp_path)
    scene = scene_mjcf(source.task, replace(source.hand, drive=None), replace(source.motion, motor_positions=None))
    model = mujoco.MjModel.from_xml_string(scene)
    stiffness, damping = model.actuator_gainprm[:, 0], -model.actuator_biasprm[:, 2]
    assert np.abs(damping * source.velocities).max() > 1e-3
    exerted = stiffness * (source.commands - source.motion.joint_angles) - damping * source.velocities
    np.testing.assert_allclose(exerted, source.motion.joint_torques, atol=1e-9)
    np.testing.assert_array_equal(source.motion.joint_commands, shared_motion().joint_commands)


def test_a_table_holds_every_number_of_the_motion_exactly(folder):
    motion = Design.load(folder).motion
    path = export_design(folder, "csv")
    assert path == folder / "export" / "motion.csv"
    names, *rows = csv.reader(io.StringIO(path.read_text()))
    values = dict(zip(names, np.array(rows, dtype=float).T, strict=True))
    assert len(values) == len(names)

    np.testing.assert_array_equal(values["time [s]"], motion.time)
    np.testing.assert_array_equal(values["object_position/y [m]"], motion.object_position[:, 1])
    np.testing.assert_array_equal(values["base_orientation/w"], motion.base_orientation[:, 0])
    np.testing.assert_array_equal(values["joint_angles/finger1_joint0 [rad]"], motion.joint_angles[:, 2])
    np.testing.assert_array_equal(values["joint_velocities/finger2_joint1 [rad/s]"], motion.joint_velocities[:, 5])
    np.testing.assert_array_equal(values["joint_torques/finger0_joint1 [N m]"], motion.joint_torques[:, 1])
    np.testing.assert_array_equal(values["contact_active/middle"], motion.contact_active[:, 2])
    np.testing.assert_array_equal(values["contact_force/thumb/x [N]"], motion.contact_force[:, 0, 0])
    np.testing.assert_array_equal(values["contact_point_link/index/z [m]"], motion.contact_point_link[:, 1, 2])
    arrays = [getattr(motion, item.name) for item in fields(motion)]
    assert len(names) == sum(a[0].size for a in arrays if isinstance(a, np.ndarray))


def test_a_table_reads_as_numbers_below_one_line_of_names(folder):
    text = motion_table(Design.load(folder).motion)
    table = np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1)
    assert table.shape == (21, text.partition("\n")[0].count(",") + 1)
    assert text.isascii()


def test_a_table_of_a_motion_without_commands_has_no_columns_of_them():
    names = motion_table(example_motion()).partition("\n")[0]
    assert "joint_angles/finger0_joint0 [rad]" in names
    assert "joint_commands" not in names


def test_the_urdf_stands_in_the_world_where_the_motion_starts(folder):
    motion = Design.load(folder).motion
    model = pin.buildModelFromXML(export_design(folder, "urdf").read_text())
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    pose = data.oMf[model.getFrameId("palm")]
    w, x, y, z = motion.base_orientation[0]
    np.testing.assert_allclose(pose.translation, motion.base_position[0], atol=1e-12)
    np.testing.assert_allclose(pose.rotation, pin.Quaternion(w, x, y, z).matrix(), atol=1e-9)


@pytest.mark.parametrize("target", TARGETS)
def test_an_export_is_the_same_when_made_again_and_replaces_the_last(folder, tmp_path, target):
    first = contents(export_design(folder, target, tmp_path / "out"))
    assert contents(export_design(folder, target, tmp_path / "out")) == first
    assert all(b"/tmp" not in content and str(folder).encode() not in content for content in first.values())


@pytest.mark.parametrize(("target", "name"), [("csv", "motion.csv"), ("urdf", "hand.urdf")])
def test_a_file_goes_into_a_folder_that_is_given(folder, tmp_path, target, name):
    assert export_design(folder, target, tmp_path) == tmp_path / name


@pytest.mark.parametrize("target", ["ros2", "usd"])
def test_a_folder_of_other_things_is_refused_and_left_alone(folder, tmp_path, target):
    (tmp_path / "package.xml").write_text("<package/>")
    with pytest.raises(HandsError, match="holds other things"):
        export_design(folder, target, tmp_path)
    assert contents(tmp_path) == {f"{tmp_path.name}/package.xml": b"<package/>"}


@pytest.mark.parametrize("target", TARGETS)
def test_a_place_that_cannot_be_written_is_an_error_in_words(folder, tmp_path, target):
    (tmp_path / "file").touch()
    with pytest.raises(HandsError, match="cannot write the export here"):
        export_design(folder, target, tmp_path / "file" / "below")


def test_an_unknown_target_is_answered_with_those_there_are(folder):
    with pytest.raises(HandsError, match="'sdf'; give one of csv, ros2, urdf, usd"):
        export_design(folder, "sdf")


def test_a_design_without_motion_has_nothing_to_export(tmp_path):
    replace(example_design(), motion=None).save(tmp_path)
    with pytest.raises(DesignError, match="nothing to export"):
        export_design(tmp_path, "csv")


def test_a_motion_of_an_earlier_version_is_answered_with_what_to_run(tmp_path):
    example_design().save(tmp_path)
    motion = Design.load(tmp_path).motion
    assert isinstance(motion, Motion)
    save_motion(replace(motion, joint_commands=None), tmp_path / "motion.npz")
    with pytest.raises(DesignError, match=r"has no joint_commands; it was made by an earlier version; .*--from"):
        export_design(tmp_path, "urdf")
