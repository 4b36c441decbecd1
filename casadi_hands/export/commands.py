"""What the joints of a plan do and are told: velocities, torques, and set points that press as planned.

A joint's set point is ``angle + (torque + damping × velocity) / stiffness``: position actuators (see `motors`) exert
``stiffness × (set point − angle) − damping × velocity``, which is the planned torque on the planned motion.
Where joints share motors, spring and damper are between the joint and what its motors turn, and nothing drags: the
commands are where the motors turn it, ``angle + torque / stiffness``.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from casadi_hands.problem.hand import Hand
from casadi_hands.problem.motion import Motion
from casadi_hands.problem.motors import joint_motors
from casadi_hands.task import Task


def commanded(task: Task, hand: Hand, motion: Motion) -> Motion:
    """The motion with the velocities, torques and commands of its joints.

    Args:
        task: names the motors.
        hand: whose joints the motion moves.
        motion: of that hand.
    """
    motors = joint_motors(task, hand)
    stiffness = np.array([motor.stiffness for motor in motors])
    damping = np.array([motor.damping for motor in motors])
    velocities, torques = joint_velocities(motion), joint_torques(hand, motion)
    if hand.drive is not None and motion.motor_positions is not None:
        commands = hand.drive.commands(motion.motor_positions)
        return replace(motion, joint_velocities=velocities, joint_torques=torques, joint_commands=commands)
    commands = motion.joint_angles + (torques + damping * velocities) / stiffness
    return replace(motion, joint_velocities=velocities, joint_torques=torques, joint_commands=commands)


def joint_velocities(motion: Motion) -> np.ndarray:
    """Velocities (S, J), rad/s, of cubic splines through the angles, at rest at the motion's start and end.

    Where a contact of its finger begins or ends a joint may turn abruptly: one spline ends there and another begins,
    and the velocity is that of the one that begins.
    """
    velocities = np.zeros_like(motion.joint_angles)
    for column, name in enumerate(motion.joint_names):
        finger = name.partition("_joint")[0]
        own = [c for c, link in enumerate(motion.contact_link) if link.startswith(f"{finger}_link")]
        switches = np.flatnonzero((motion.contact_active[1:, own] != motion.contact_active[:-1, own]).any(axis=1)) + 1
        last = len(motion.time) - 1
        for first, end in pairwise([0, *[k for k in switches.tolist() if k < last], last]):
            rest: tuple[int, float] = (1, 0.0)
            spline = CubicSpline(
                motion.time[first : end + 1],
                motion.joint_angles[first : end + 1, column],
                bc_type=(rest if first == 0 else "not-a-knot", rest if end == last else "not-a-knot"),
            )
            velocities[first : end + 1, column] = spline(motion.time[first : end + 1], 1)
    return velocities


def joint_torques(hand: Hand, motion: Motion) -> np.ndarray:
    """Torques (S, J), N·m, with which the joints exert the contact forces of the plan; links weigh nothing."""
    torques = np.zeros_like(motion.joint_angles)
    to_palm = Rotation.from_quat(motion.base_orientation, scalar_first=True).inv()
    for i, finger in enumerate(hand.fingers):
        columns = [motion.joint_names.index(f"finger{i}_joint{j}") for j in range(len(finger.links))]
        turned, origin = Rotation.identity(len(motion.time)), np.tile(np.asarray(finger.base), (len(motion.time), 1))
        origins, axes = [], []
        for j, link in enumerate(finger.links):
            turned = turned * link.turn
            axes.append(turned.apply(link.axis))
            origins.append(origin)
            turned = turned * Rotation.from_rotvec(motion.joint_angles[:, [columns[j]]] * np.asarray(link.axis))
            for c, name in enumerate(motion.contact_link):
                if name != f"finger{i}_link{j}":
                    continue
                point = origin + turned.apply(motion.contact_point_link[:, c])
                force = to_palm.apply(motion.contact_force[:, c])
                moment = 0.0 if motion.contact_moment is None else to_palm.apply(motion.contact_moment[:, c])
                for column, at, axis in zip(columns, origins, axes, strict=False):
                    torques[:, column] += np.sum(axis * (np.cross(point - at, force) + moment), axis=1)
            origin = origin + turned.apply([0.0, 0.0, link.length])
    return torques
