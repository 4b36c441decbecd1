"""The texts of a ROS 2 package that hardly depend on the hand."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape

import numpy as np

from casadi_hands.export.targets.source import Source
from casadi_hands.problem.motors import Motor

_DEPENDENCIES = (
    "controller_manager",
    "hardware_interface",
    "joint_state_broadcaster",
    "joint_trajectory_controller",
    "launch",
    "launch_ros",
    "robot_state_publisher",
    "trajectory_msgs",
)


def package_xml(package: str, task: str) -> str:
    """The manifest; who maintains the package, and under which licence, is for its owner to say."""
    dependencies = "\n".join(f"  <exec_depend>{name}</exec_depend>" for name in _DEPENDENCIES)
    return f"""<?xml version="1.0"?>
<package format="3">
  <name>{package}</name>
  <version>0.0.0</version>
  <description>A robot hand and its motion, designed by casadi-hands for the task: {escape(task)}</description>
  <maintainer email="user@todo.todo">user</maintainer>
  <license>none stated</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
{dependencies}
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"""


def cmake(package: str) -> str:
    """The build: install the folders."""
    return f"""cmake_minimum_required(VERSION 3.8)
project({package} NONE)
find_package(ament_cmake REQUIRED)
install(DIRECTORY config launch urdf DESTINATION share/${{PROJECT_NAME}})
ament_package()
"""


def launch(package: str) -> str:
    """The launch file: the hand's description, ros2_control and both controllers."""
    return f'''"""Start the hand of {package}: its description, ros2_control and its controllers."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description():
    share = Path(get_package_share_directory("{package}"))
    description = (share / "urdf" / "hand.urdf").read_text(encoding="utf-8")
    robot = {{"robot_description": ParameterValue(description, value_type=str)}}
    return LaunchDescription(
        [
            Node(package="robot_state_publisher", executable="robot_state_publisher", parameters=[robot]),
            Node(
                package="controller_manager",
                executable="ros2_control_node",
                # Older distributions take the description from the parameter, newer ones from the topic.
                parameters=[robot, str(share / "config" / "controllers.yaml")],
                remappings=[("~/robot_description", "/robot_description")],
            ),
            Node(package="controller_manager", executable="spawner", arguments=["joint_state_broadcaster"]),
            Node(package="controller_manager", executable="spawner", arguments=["hand_controller"]),
        ]
    )
'''


def readme(source: Source, package: str, start: float, touch: float, motors: Sequence[Motor]) -> str:
    """How to run the package, and what its files mean.

    Args:
        source: the design.
        package: its name.
        start: when the motion starts, s after the trajectory does.
        touch: when the hand is to be at the motion's first angles, s.
        motors: of the joints, in their order.
    """
    gains = "\n".join(
        f"| `{name}` | {motor.stiffness:.4g} | {motor.damping:.4g} |"
        for name, motor in zip(source.motion.joint_names, motors, strict=True)
    )
    return f"""# {package}

A hand and its motion, designed by casadi-hands for the task: {source.task.name}. Put this folder into `src` of a
workspace, install what it needs (`rosdep install --from-paths src`), then:

```sh
colcon build --packages-select {package} && . install/setup.sh
ros2 launch {package} hand.launch.py
config=$(ros2 pkg prefix --share {package})/config
ros2 topic pub --once /hand_controller/joint_trajectory trajectory_msgs/msg/JointTrajectory "$(cat $config/motion.yaml)"
```

(A shell takes texts of up to 128 KiB. Newer `ros2` reads the file itself: `--yaml-file $config/motion.yaml`. The file
is also the `trajectory` of a goal of `/hand_controller/follow_joint_trajectory`.)

- `config/motion.yaml` holds set points, not angles: each is the planned angle and, on top, what makes an actuator of
  the stiffness and damping below exert the planned torque, so that the fingers press with the planned forces. With
  other gains they press otherwise. Velocities are the set points' slopes. There are no efforts, because the controller
  refuses them on a position interface: torques are in `config/motion.csv`.
- `config/angles.yaml` moves through the planned angles at the same times, without pressing: to look at, or for a hand
  that cannot touch its object.
- The hand has {touch:g} s to come to where it touches the object, and squeezes until {start:g} s, when the motion (and
  the time of `config/motion.csv`) starts. Until then something else holds the object at its start. How the fingers get
  past it is not planned.
- {_palm(source)}
- The plan counts on a hand that carries its own weight.
- `config/controllers.yaml` turns off that ros2_control clamps commands to the joints' limits{_beyond(source)}.
- `urdf/hand.urdf` names `mock_components/GenericSystem`, which does as it is told at once. Put your driver in its
  place; gains are parameters of its joints.

| joint | stiffness, N·m/rad | damping, N·m·s/rad |
|---|---|---|
{gains}
"""


def _palm(source: Source) -> str:
    """What the link ``world`` means for this hand."""
    motion = source.motion
    # q and -q are one orientation.
    turned = np.abs(motion.base_orientation @ motion.base_orientation[0]).min() < 1 - 1e-9
    if turned or np.ptp(motion.base_position, axis=0).max() > 1e-9 * source.hand.palm_radius:
        return (
            "The palm moves. The URDF fixes it to `world` where it starts; its path is in `config/motion.csv` (columns "
            "`base_position`, `base_orientation`), for the arm that carries it."
        )
    return "The palm stands still, fixed to `world`."


def _beyond(source: Source) -> str:
    """How far set points lie beyond the joints' limits, where they do."""
    hand, commands = source.hand, source.commands
    beyond = max(
        float(commands.max(initial=0.0)) - hand.joint_upper, hand.joint_lower - float(commands.min(initial=0.0))
    )
    return f": set points lie up to {beyond:.2g} rad beyond them, to press there" if beyond > 0.0 else ""
