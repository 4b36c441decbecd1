"""Is the hand one that the task allows, and can it do what the motion asks of it?"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.verify.checks.sizes import radius_of, shortest_of
from casadi_hands.verify.figures.wrench import planned_torques
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.trajectory import Trajectory

STAND = 1.05
"""Radii of its first link above the palm's face that a finger's first joint stands: that link just clears the palm."""
ROUNDED = 1e-6
"""Share by which a size may be off."""
ROUNDED_ANGLE = 5e-3
"""Degrees by which an angle may be off: a solve's constraints hold within 1e-7, and those on angles are on their
squares or their cosines' squares, which near 0 and 90° change little with the angle."""


def hand_task_problems(folder: Folder, path: Trajectory) -> list[str]:
    """Return where the hand is not one that the task allows, or its joints cannot do the motion, a sentence each."""
    return [
        *_joint_problems(folder),
        *_hinge_problems(folder),
        *_size_problems(folder),
        *_motor_problems(folder, path),
    ]


def _joint_problems(folder: Folder) -> list[str]:
    lower, upper = np.deg2rad(folder.task.hand.joint_limits)
    problems = []
    for name, joint in folder.joints.items():
        if abs(joint.lower - lower) > 1e-6 or abs(joint.upper - upper) > 1e-6:
            problems.append(
                f"joint {name}: its limits in hand.urdf are {joint.lower:.4g} and {joint.upper:.4g} rad,"
                f" the task's {lower:.4g} and {upper:.4g} rad"
            )
        if abs(float(np.linalg.norm(joint.axis)) - 1.0) > 1e-6:
            problems.append(f"joint {name}: its axis in hand.urdf is not a unit vector")
    most, counts = folder.task.search.max_joints, dict.fromkeys(folder.fingers, 0)
    for name in folder.joints:
        finger = folder.call(name.replace("_joint", "_link")).partition("'")[2].partition("'")[0]
        counts[finger] = counts.get(finger, 0) + 1
    for finger, count in counts.items():
        if count > most:
            problems.append(f"finger '{finger}' has {count} joints; the task allows {most} (search.max_joints)")
    return problems


def _hinge_problems(folder: Folder) -> list[str]:
    """Return which links are bent farther than the task allows, and which axes stand too near to a link."""
    hand, problems = folder.task.hand, []
    least, largest = hand.axes.from_link
    for name, joint in folder.joints.items():
        who, turn = folder.call(name.replace("_joint", "_link")), Rotation.from_euler("xyz", joint.turn)
        own = np.array([0.0, 0.0, 1.0])
        before = turn.inv().apply(own)
        bend = float(np.rad2deg(np.arccos(np.clip(before[2], -1.0, 1.0))))
        if bend > hand.bend + ROUNDED_ANGLE:
            problems.append(f"{who} is bent by {bend:.4g}° from the link before; the task allows {hand.bend:g}°")
        beside = {"it": own} if joint.parent == "palm" else {"it": own, "the link before": before}
        for what, link in beside.items():
            cosine = abs(float(link @ joint.axis)) / float(np.linalg.norm(joint.axis))
            angle = float(np.rad2deg(np.arccos(min(cosine, 1.0))))
            if not least - ROUNDED_ANGLE <= angle <= largest + ROUNDED_ANGLE:
                allowed = f"{least:g}° to {largest:g}°"
                problems.append(f"{who}: its joint's axis stands {angle:.4g}° from {what}; the task allows {allowed}")
    return problems


def _size_problems(folder: Folder) -> list[str]:
    task, problems = folder.task, []
    longest = task.hand.link_length[1]
    for name, body in folder.links.items():
        who = folder.call(name)
        if name == "palm":
            continue
        for capsule in body.capsules:
            length, shortest = float(capsule.end[2]), shortest_of(folder, name)
            if not shortest * (1 - ROUNDED) <= length <= longest * (1 + ROUNDED):
                allowed = f"{1e3 * shortest:.4g} to {1e3 * longest:.4g} mm"
                problems.append(f"{who} is {1e3 * length:.4g} mm long; the task allows {allowed}")
            due = radius_of(folder, name)
            if abs(capsule.radius - due) > ROUNDED * due:
                problems.append(f"{who} has a radius of {1e3 * capsule.radius:.4g} mm, the task {1e3 * due:.4g} mm")
    for name, joint in folder.joints.items():
        if joint.parent != "palm":
            continue
        who, out = folder.call(name.replace("_joint", "_link")), float(np.linalg.norm(joint.position[:2]))
        if out > task.palm.radius * (1 + ROUNDED):
            problems.append(f"{who} stands {1e3 * out:.4g} mm out, off the palm of {1e3 * task.palm.radius:.4g} mm")
        high = STAND * radius_of(folder, joint.child)
        if not -ROUNDED * high <= joint.position[2] <= high * (1 + ROUNDED):
            problems.append(f"{who} stands {1e3 * joint.position[2]:.4g} mm above the palm's face, not on it")
    return problems


def _motor_problems(folder: Folder, path: Trajectory) -> list[str]:
    """Return which joints' effort or speed in ``hand.urdf`` is too small for the motion, or not the task's motor's."""
    motion, motor, problems = folder.motion, folder.task.actuator, []
    torques = np.max([np.abs(planned_torques(folder, force)).max(axis=0) for _, force, _ in folder.scenarios()], axis=0)
    speeds = np.abs(path.speeds).max(axis=0)
    # A motor that joints share has other limits than they.
    named = (motor.torque, motor.speed) if folder.drive is None else (None, None)
    for column, name in enumerate(motion.joint_names):
        joint = folder.joints[name]
        for word, has, needs, unit, of_motor in (
            ("effort", joint.effort, torques[column], "N·m", named[0]),
            ("velocity", joint.velocity, speeds[column], "rad/s", named[1]),
        ):
            if of_motor is not None and abs(has - of_motor) > ROUNDED * of_motor:
                theirs = f"the task's motor's {of_motor:.4g}"
                problems.append(f"joint {name}: its {word} limit in hand.urdf is {has:.4g} {unit}, {theirs}")
            elif of_motor is None and needs > has * (1 + ROUNDED):
                problems.append(f"joint {name}: its {word} limit of {has:.4g} {unit} is below the {needs:.4g} it needs")
    return problems
