"""A ROS 2 package: the hand with ros2_control's tags, its controllers, and the motion as trajectories.

A package of files only, hence of ament_cmake, whose build is three lines; ament_python would want a Python module.

The trajectories are for ``joint_trajectory_controller`` with a position interface, as it is in all ROS 2
distributions so far:

- It joins points by cubics when they carry velocities. Those of the set points are therefore slopes of the set points,
  not the joints' velocities: monotone ones (Fritsch and Carlson), so that nothing presses harder between two
  samples than at both, not even where a contact begins or ends and the set points jump.
- It refuses points with efforts, which is why they have none, and a motion that does not end at rest.
- A point at time zero is a step. So the hand first goes to its start, then has time to squeeze.
"""

from __future__ import annotations

import io
import re
from math import ceil
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from scipy.interpolate import PchipInterpolator

from casadi_hands.export.markup import document, number
from casadi_hands.export.table import motion_table
from casadi_hands.export.targets import ros2_texts
from casadi_hands.export.targets.source import Source, write_texts
from casadi_hands.export.targets.target import Target
from casadi_hands.problem.motors import Motor, joint_motors

_APPROACH_SHARE = 0.5  # of the joints' speed limit, on the mean, from zero angles to the start
_SHORTEST_APPROACH = 1.0  # s
_SQUEEZE = 0.5  # s from touching to pressing as planned
_DECIMALS = 9  # of rad and rad/s: far below what an encoder tells apart, and half as long as every digit
_UPDATE_RATE = 500  # Hz


def write_ros2(source: Source, out: Path) -> Path:
    """Write the package.

    Args:
        source: the design.
        out: the package's folder.

    Returns:
        the folder.

    Raises:
        HandsError: the folder holds something else, or cannot be written.
    """
    motion, package = source.motion, package_name(source.task.name)
    motors = joint_motors(source.task, source.hand)
    start = _start_time(source)
    times = start + motion.time - motion.time[0]
    # By the first point the hand touches the object, by the second it presses.
    touch = start - _SQUEEZE
    set_points = _trajectory(source, touch, times, source.commands, _slopes(motion.time, source.commands))
    angles = _trajectory(source, touch, times, motion.joint_angles, source.velocities)
    texts = {
        "package.xml": ros2_texts.package_xml(package, source.task.name),
        "CMakeLists.txt": ros2_texts.cmake(package),
        "README.md": ros2_texts.readme(source, package, start, touch, motors),
        "urdf/hand.urdf": control_urdf(source, motors),
        "config/controllers.yaml": _yaml(_controllers(source)),
        "config/motion.yaml": _yaml(set_points),
        "config/angles.yaml": _yaml(angles),
        "config/motion.csv": motion_table(motion),
        "launch/hand.launch.py": ros2_texts.launch(package),
    }
    write_texts(out, texts, mark="package.xml")
    return out


def package_name(task: str) -> str:
    """A name that ROS accepts for a package, from the task's: small letters, digits and single underscores."""
    words = re.findall("[a-z0-9]+", task.lower())
    name = "_".join([*words, "hand"])
    return name if name[0].isalpha() else f"task_{name}"


def control_urdf(source: Source, motors: tuple[Motor, ...]) -> str:
    """The hand fixed to ``world``, with the tags by which ros2_control drives it.

    Args:
        source: the design; joints start at its first sample.
        motors: of the joints; their gains are parameters that the hardware's driver may read.
    """
    robot = ElementTree.fromstring(source.welded_urdf())
    control = SubElement(robot, "ros2_control", name="hand", type="system")
    plugin = SubElement(SubElement(control, "hardware"), "plugin")
    plugin.text = "mock_components/GenericSystem"
    start = source.motion.joint_angles[0]
    for name, angle, motor in zip(source.motion.joint_names, start, motors, strict=True):
        joint = SubElement(control, "joint", name=name)
        SubElement(joint, "command_interface", name="position")
        for state, value in (("position", angle), ("velocity", 0.0), ("effort", 0.0)):
            _parameter(SubElement(joint, "state_interface", name=state), "initial_value", value)
        _parameter(joint, "stiffness", motor.stiffness)
        _parameter(joint, "damping", motor.damping)
    return document(robot)


def _parameter(parent: Element, name: str, value: float) -> None:
    SubElement(parent, "param", name=name).text = number(value)


def _controllers(source: Source) -> dict[str, Any]:
    """Parameters of the controller manager and of the hand's controller."""
    return {
        "controller_manager": {
            "ros__parameters": {
                "update_rate": _UPDATE_RATE,
                # Set points press, so they may lie beyond what the joints reach.
                "enforce_command_limits": False,
                "joint_state_broadcaster": {"type": "joint_state_broadcaster/JointStateBroadcaster"},
                "hand_controller": {"type": "joint_trajectory_controller/JointTrajectoryController"},
            }
        },
        "hand_controller": {
            "ros__parameters": {
                "joints": list(source.motion.joint_names),
                "command_interfaces": _flow(["position"]),
                "state_interfaces": _flow(["position", "velocity"]),
            }
        },
    }


def _start_time(source: Source) -> float:
    """When the motion starts, s after the trajectory does: time to come to the start, and to squeeze there."""
    farthest = float(np.abs(source.motion.joint_angles[0]).max(initial=0.0))
    approach = ceil(10 * farthest / (_APPROACH_SHARE * source.hand.velocity)) / 10
    return max(approach, _SHORTEST_APPROACH) + _SQUEEZE


def _slopes(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Slopes (S, J) of monotone cubics through the values, at rest at either end."""
    slopes: np.ndarray = PchipInterpolator(time, values).derivative()(time)
    slopes[[0, -1]] = 0.0
    return slopes


def _trajectory(
    source: Source, touch: float, times: np.ndarray, positions: np.ndarray, velocities: np.ndarray
) -> dict[str, Any]:
    """The fields of a ``trajectory_msgs/msg/JointTrajectory``.

    Args:
        source: the design.
        touch: when the hand is to be at the motion's first angles, s.
        times: (S,) of the samples, s.
        positions: (S, J), rad.
        velocities: (S, J), rad/s.
    """
    start = source.motion.joint_angles[0]
    return {
        "header": {"stamp": _flow({"sec": 0, "nanosec": 0}), "frame_id": "world"},  # time zero: as soon as it comes
        "joint_names": _flow(list(source.motion.joint_names)),
        "points": [
            _point(touch, start, np.zeros_like(start)),
            *(_point(*moment) for moment in zip(times, positions, velocities, strict=True)),
        ],
    }


def _point(time: float, positions: np.ndarray, velocities: np.ndarray) -> dict[str, Any]:
    seconds, nanoseconds = divmod(round(time * 1e9), 10**9)
    return {
        "positions": _flow(_rounded(positions)),
        "velocities": _flow(_rounded(velocities)),
        "accelerations": _flow([]),
        "effort": _flow([]),
        "time_from_start": _flow({"sec": seconds, "nanosec": nanoseconds}),
    }


def _rounded(values: np.ndarray) -> list[float]:
    rounded: list[float] = (np.round(values, _DECIMALS) + 0.0).tolist()  # the sum has no minus zero
    return rounded


def _flow(value: Any) -> Any:
    """The list or mapping, to be written on one line."""
    styled = CommentedMap(value) if isinstance(value, dict) else CommentedSeq(value)
    styled.fa.set_flow_style()
    return styled


def _yaml(value: dict[str, Any]) -> str:
    yaml = YAML(typ="rt")
    yaml.width = 1_000_000
    stream = io.StringIO()
    yaml.dump(value, stream)
    return stream.getvalue()


TARGETS = {"ros2": Target(write_ros2, "ros2")}
