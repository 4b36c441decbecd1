"""The ROS 2 package: as its messages, its controller and three readers of URDF take it."""

import re
import sys
from dataclasses import replace
from types import ModuleType
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import yaml  # which is what ros2 reads with
import yourdfpy
from rosbags.typesys import Stores, get_typestore
from scipy.interpolate import CubicHermiteSpline

from casadi_hands.export.design import Design
from casadi_hands.export.targets import export_design
from casadi_hands.export.targets.ros2 import package_name
from casadi_hands.problem.motors import joint_motors
from tests.export.example import example_design, example_motion

STORE = get_typestore(Stores.ROS2_HUMBLE)
BASE, NAME, SEQUENCE = 1, 2, 4
RANGES = {"int32": (-(2**31), 2**31 - 1), "uint32": (0, 2**32 - 1)}
START = 1.5  # s, when the example's motion starts: a second to come there, half a one to squeeze


@pytest.fixture(scope="module")
def design(tmp_path_factory):
    directory = tmp_path_factory.mktemp("design")
    example_design().save(directory)
    return Design.load(directory)


@pytest.fixture(scope="module")
def package(design, tmp_path_factory):
    directory = tmp_path_factory.mktemp("solved")
    design.save(directory)
    return export_design(directory, "ros2")


def message(kind, value):
    """The message of a type, from what YAML gave; every field must be there, and of its type."""
    definitions = STORE.fielddefs[kind][1]
    assert list(value) == [name for name, _ in definitions]
    return STORE.types[kind](**{name: field(node, value[name]) for name, node in definitions})


def field(node, value):
    kind, detail = int(node[0]), node[1]
    if kind == NAME:
        return message(detail, value)
    if kind == SEQUENCE:
        element = detail[0]
        items = [field(element, item) for item in value]
        return np.array(items, dtype=np.float64) if element[1][0] == "float64" else items
    name = detail[0]
    assert type(value) is {"string": str, "float64": float}.get(name, int)
    if name in RANGES:
        assert RANGES[name][0] <= value <= RANGES[name][1]
    return value


def trajectory(package, name):
    return yaml.safe_load((package / "config" / name).read_text())


def points(package, name):
    """Times (P,), positions and velocities (P, J) of a trajectory."""
    found = trajectory(package, name)["points"]
    times = [point["time_from_start"]["sec"] + 1e-9 * point["time_from_start"]["nanosec"] for point in found]
    positions, velocities = ([point[key] for point in found] for key in ("positions", "velocities"))
    return np.array(times), np.array(positions), np.array(velocities)


@pytest.mark.parametrize("name", ["motion.yaml", "angles.yaml"])
def test_a_trajectory_is_a_message(package, design, name):
    kind = "trajectory_msgs/msg/JointTrajectory"
    made = message(kind, trajectory(package, name))
    again = STORE.deserialize_cdr(STORE.serialize_cdr(made, kind), kind)
    assert again.joint_names == list(design.hand.joint_names)
    assert len(again.points) == len(design.motion.time) + 1


@pytest.mark.parametrize("name", ["motion.yaml", "angles.yaml"])
def test_the_controller_takes_a_trajectory(package, design, name):
    """What joint_trajectory_controller checks, and what it does not but steps or jerks at."""
    times, positions, velocities = points(package, name)
    assert times[0] >= 1.0
    assert (np.diff(times) > 0).all()
    np.testing.assert_array_equal(velocities[[0, -1]], 0.0)
    assert all(point["effort"] == [] for point in trajectory(package, name)["points"])
    np.testing.assert_allclose(positions[0], design.motion.joint_angles[0], atol=1e-9)
    np.testing.assert_allclose(times[1:], START + design.motion.time, atol=1e-9)


def test_the_hand_moves_as_planned_and_is_told_to_press(package, design):
    _, angles, speeds = points(package, "angles.yaml")
    np.testing.assert_allclose(angles[1:], design.motion.joint_angles, atol=1e-9)
    np.testing.assert_allclose(speeds[1:], design.motion.joint_velocities, atol=1e-9)
    _, set_points, _ = points(package, "motion.yaml")
    np.testing.assert_allclose(set_points[1:], design.motion.joint_commands, atol=1e-9)
    motors = joint_motors(design.task, design.hand)
    stiffness = np.array([motor.stiffness for motor in motors])
    damping = np.array([motor.damping for motor in motors])
    exerted = stiffness * (set_points - angles)[1:] - damping * speeds[1:]
    np.testing.assert_allclose(exerted, design.motion.joint_torques, atol=1e-6)


def test_between_points_nothing_presses_harder_than_at_them(package):
    times, positions, velocities = points(package, "motion.yaml")
    dense = np.linspace(times[:-1], times[1:], 20)
    between = CubicHermiteSpline(times, positions, velocities)(dense)
    lower, upper = np.minimum(positions[:-1], positions[1:]), np.maximum(positions[:-1], positions[1:])
    assert (between >= lower - 1e-8).all()
    assert (between <= upper + 1e-8).all()


def test_three_readers_read_the_urdf(package, design):
    file = package / "urdf" / "hand.urdf"
    model = pin.buildModelFromUrdf(str(file))
    assert set(model.names) - {"universe"} == set(design.hand.joint_names)
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    np.testing.assert_allclose(data.oMf[model.getFrameId("palm")].translation, design.motion.base_position[0])
    assert set(yourdfpy.URDF.load(str(file)).actuated_joint_names) == set(design.hand.joint_names)
    assert mujoco.MjModel.from_xml_path(str(file)).njnt == design.hand.degrees_of_freedom


def test_ros2_control_drives_every_joint_from_its_start(package, design):
    robot = ElementTree.parse(package / "urdf" / "hand.urdf").getroot()
    (control,) = robot.findall("ros2_control")
    assert control.get("type") == "system"
    assert control.findtext("hardware/plugin") == "mock_components/GenericSystem"
    joints = control.findall("joint")
    assert [joint.get("name") for joint in joints] == list(design.hand.joint_names)
    for joint, angle in zip(joints, design.motion.joint_angles[0], strict=True):
        assert [item.get("name") for item in joint.findall("command_interface")] == ["position"]
        states = {item.get("name"): float(item.findtext("param")) for item in joint.findall("state_interface")}
        assert states == {"position": angle, "velocity": 0.0, "effort": 0.0}


def test_controllers_are_those_of_the_hand(package, design):
    parameters = yaml.safe_load((package / "config" / "controllers.yaml").read_text())
    manager = parameters["controller_manager"]["ros__parameters"]
    assert manager["hand_controller"]["type"] == "joint_trajectory_controller/JointTrajectoryController"
    hand = parameters["hand_controller"]["ros__parameters"]
    assert hand["joints"] == list(design.hand.joint_names)
    assert hand["command_interfaces"] == ["position"]


def test_the_manifest_depends_on_what_the_launch_file_starts(package, monkeypatch):
    manifest = ElementTree.parse(package / "package.xml").getroot()
    name = manifest.findtext("name")
    assert name == "move_a_capsule_back_hand"
    assert "capsule & back" in manifest.findtext("description")
    assert f"project({name} " in (package / "CMakeLists.txt").read_text()

    started = []

    def module(path, **members):
        monkeypatch.setitem(sys.modules, path, ModuleType(path))
        for member, value in members.items():
            setattr(sys.modules[path], member, value)

    module("ament_index_python")
    module("ament_index_python.packages", get_package_share_directory=lambda wanted: {name: package}[wanted])
    module("launch", LaunchDescription=lambda actions: actions)
    module("launch_ros")
    module("launch_ros.actions", Node=lambda **options: started.append(options))
    module("launch_ros.parameter_descriptions", ParameterValue=lambda value, value_type: value)
    space = {}
    exec(compile((package / "launch" / "hand.launch.py").read_text(), "hand.launch.py", "exec"), space)
    space["generate_launch_description"]()
    assert {options["package"] for options in started} <= {item.text for item in manifest.findall("exec_depend")}
    assert started[0]["parameters"][0]["robot_description"].startswith("<?xml")


def test_the_readme_says_what_becomes_of_the_palm(package, design, tmp_path):
    assert "The palm stands still" in (package / "README.md").read_text()
    replace(design, motion=example_motion(palm_shift=(0.0, 0.0, 0.05))).save(tmp_path)
    assert "The palm moves" in (export_design(tmp_path, "ros2") / "README.md").read_text()


@pytest.mark.parametrize("task", ["thick capsule lift", "3 balls", "Größe  &", "_", ""])
def test_any_task_gives_a_name_ros_accepts(task):
    assert re.fullmatch("[a-z](_?[a-z0-9]+)*", package_name(task))
