"""Are the keyframes of ``scene.xml`` the motion's start and goals?"""

from __future__ import annotations

import numpy as np

from casadi_hands.verify.held import course, held
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.reading.scene_file import Scene


def keyframe_problems(folder: Folder, scene: Scene) -> list[str]:
    """Return which keyframes are not the motion at their time, a sentence each."""
    motion, task = folder.motion, folder.task
    moments = {"start": 0.0, **{f"goal{n}": goal.at for n, goal in enumerate(task.motion, start=1)}}
    problems = [f"keyframe {name} is not one of the task's" for name in scene.keys if name not in moments]
    for name, time in moments.items():
        key = scene.keys.get(name)
        if key is None:
            problems.append(f"has no keyframe {name}")
            continue
        k = int(np.argmin(np.abs(motion.time - time)))
        due = {"time": motion.time[[k]], "qpos": _coordinates(folder, scene, k)}
        if motion.joint_commands is not None:
            told = motion.joint_commands if motion.motor_positions is None else motion.motor_positions
            due["ctrl"] = _in_order(folder, [servo.joint for servo in scene.servos], told[k])
        if any(body.mocap for body in scene.bodies.values()):
            due["mpos"], due["mquat"] = motion.base_position[k], motion.base_orientation[k]
        for attribute, values in due.items():
            stated = key.get(attribute)
            if stated is None or stated.shape != values.shape or np.max(np.abs(stated - values), initial=0.0) > 1e-6:
                problems.append(f"keyframe {name}: {attribute} is not that of the motion at {motion.time[k]:.3g} s")
        problems += [f"keyframe {name}: {extra} moves what the motion does not" for extra in key if extra not in due]
    return problems


def _in_order(folder: Folder, joints: list[str], values: np.ndarray) -> np.ndarray:
    """Return values of joints, or of motors that share them, in the order of names; unknown ones are passed over."""
    drive = folder.drive
    own = list(folder.motion.joint_names) if drive is None or len(values) > len(drive.names) else drive.names
    return values[[own.index(name) for name in joints if name in own]]


def _coordinates(folder: Folder, scene: Scene, k: int) -> np.ndarray:
    """Return MuJoCo's coordinates at a sample: those of every body in the file's order."""
    motion, parts = folder.motion, []
    for name, body in scene.bodies.items():
        if body.free and name == "palm":
            parts.append(np.concatenate([motion.base_position[k], motion.base_orientation[k]]))
        elif name == "object" and (joint := held(folder)) is not None:
            turned = course(folder, joint).position[k]
            scale = {"object_along": joint.advance, "object": 1.0}
            parts.append(np.array([scale.get(mount.name, np.nan) * turned for mount in body.mounts]))
        elif body.free:
            parts.append(np.concatenate([motion.object_position[k], motion.object_orientation[k]]))
        hinges = [hinge.name for hinge in body.hinges]
        parts.append(_in_order(folder, hinges, motion.joint_angles[k]))
        if motion.motor_positions is not None:
            parts.append(_in_order(folder, hinges, motion.motor_positions[k]))
    return np.concatenate(parts) if parts else np.zeros(0)
