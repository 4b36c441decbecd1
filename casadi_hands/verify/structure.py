"""Do the files of a result folder agree with each other and with the task?"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.verify.folder import Folder

LONGEST_STEP = 0.1
"""s between samples."""


def structure_problems(folder: Folder) -> list[str]:
    """Return what is wrong with the files themselves, a sentence each."""
    return [
        *_motion_problems(folder),
        *_contact_problems(folder),
        *_external_problems(folder),
        *_object_problems(folder),
        *_hand_problems(folder),
        *_palm_problems(folder),
        *_goal_problems(folder),
    ]


def _same(one: Any, other: Any, tolerance: float = 1e-6) -> bool:
    """Whether two numbers or arrays agree to a share of their size."""
    try:
        a, b = np.asarray(one, dtype=float), np.asarray(other, dtype=float)
    except (TypeError, ValueError):
        return False
    return a.shape == b.shape and bool(np.all(np.abs(a - b) <= tolerance * max(np.max(np.abs(b), initial=0.0), 1e-12)))


def _motion_problems(folder: Folder) -> list[str]:
    motion, problems = folder.motion, []
    step = float(np.max(np.diff(motion.time)))
    if step > LONGEST_STEP + 1e-9:
        problems.append(f"time: samples are up to {step:.3g} s apart; at most {LONGEST_STEP} s is allowed")
    if abs(motion.time[0]) > 1e-9 or abs(motion.time[-1] - folder.task.duration) > 1e-6:
        problems.append(
            f"time: the motion lasts from {motion.time[0]:.4g} s to {motion.time[-1]:.4g} s;"
            f" the task from 0 s to {folder.task.duration:.4g} s"
        )
    for who in ("object", "base"):
        off = np.abs(np.linalg.norm(getattr(motion, f"{who}_orientation"), axis=1) - 1.0)
        if off.max() > 1e-6:
            at = motion.time[int(np.argmax(off))]
            problems.append(f"{who}_orientation: the quaternion at {at:.3g} s is not unit: off by {off.max():.3g}")
    return problems


def _contact_problems(folder: Folder) -> list[str]:
    motion, problems = folder.motion, []
    # A finger of the task whose contact never acts is not built.
    fingers = [name for name in folder.task.fingers if name in motion.contact_names]
    for name, link in zip(motion.contact_names, motion.contact_link, strict=True):
        if link == "ground":
            continue
        if name not in fingers:
            known = ", ".join(folder.task.fingers)
            problems.append(f"contact '{name}': the task has no finger of that name, only {known}")
        elif link.partition("_link")[0] != f"finger{fingers.index(name)}":
            problems.append(f"contact '{name}' is on {folder.call(link)}, not on its own finger")
    idle = np.linalg.norm(motion.contact_force, axis=2) * ~motion.contact_active
    if idle.max(initial=0.0) > 1e-9 * folder.weight:
        k, c = np.unravel_index(np.argmax(idle), idle.shape)
        problems.append(
            f"contact '{motion.contact_names[c]}' bears {idle[k, c]:.3g} N at {motion.time[k]:.3g} s, though not active"
        )
    return problems


def _external_problems(folder: Folder) -> list[str]:
    """An external wrench may only be what the task's perturbations state, never help from nowhere."""
    motion, problems = folder.motion, []
    for kind in ("force", "torque"):
        allowed = np.zeros(len(motion.time))
        for push in folder.task.perturbations:
            near = (motion.time >= push.start - LONGEST_STEP) & (motion.time <= push.end + LONGEST_STEP)
            allowed += near * float(np.linalg.norm(getattr(push, kind)))
        over = np.linalg.norm(getattr(motion, f"external_{kind}"), axis=1) - allowed
        if over.max() > 1e-9 * folder.weight:
            at = motion.time[int(np.argmax(over))]
            problems.append(f"external_{kind}: at {at:.3g} s the object is helped by what the task does not state")
    return problems


def _object_problems(folder: Folder) -> list[str]:
    body, task, stated = folder.object, folder.task, folder.result.get("object", {})
    problems = []
    for source, mass, inertia in (
        ("task.yaml", task.object.mass, task.object.inertia),
        ("result.json", stated.get("mass"), stated.get("inertia")),
    ):
        if not _same(body.mass, mass):
            problems.append(f"mass: object.urdf says {body.mass:.6g} kg, {source} says {mass} kg")
        if not _same(body.inertia, inertia, 1e-5):
            problems.append(f"inertia of the object: object.urdf and {source} disagree")
    if not np.all(np.abs(body.center_of_mass) <= 1e-9 + 1e-6 * folder.length):
        problems.append("object.urdf: the link's frame is not the centre of mass")
    for shape in task.object.shapes:
        start, end = (np.asarray(point) for point in shape.segment)
        if not any(_is_capsule(c.start, c.end, c.radius, start, end, shape.radius) for c in body.capsules):
            problems.append("shapes: object.urdf has not the shapes of task.yaml")
            break
    if len(body.capsules) != len(task.object.shapes):
        problems.append(f"shapes: object.urdf has {len(body.capsules)}, task.yaml has {len(task.object.shapes)}")
    for key, value in (("friction", task.friction), ("gravity", task.gravity)):
        if not _same(folder.result.get(key), value):
            problems.append(f"{key}: result.json says {folder.result.get(key)}, task.yaml says {value}")
    return problems


def _is_capsule(
    start: np.ndarray,
    end: np.ndarray,
    radius: float,
    other_start: np.ndarray,
    other_end: np.ndarray,
    other_radius: float,
) -> bool:
    near = 1e-6 * max(other_radius, float(np.linalg.norm(other_end - other_start)))
    straight = np.linalg.norm(start - other_start) + np.linalg.norm(end - other_end)
    turned = np.linalg.norm(start - other_end) + np.linalg.norm(end - other_start)
    return bool(min(straight, turned) < near and abs(radius - other_radius) < near)


def _hand_problems(folder: Folder) -> list[str]:
    problems = []
    for i, finger in enumerate(folder.result.get("hand", {}).get("fingers", [])):
        for j, link in enumerate(finger.get("links", [])):
            problems += _link_problems(folder, f"finger{i}_link{j}", link, f"finger{i}_link{j + 1}")
    return problems


def _link_problems(folder: Folder, name: str, stated: dict[str, Any], after: str) -> list[str]:
    body = folder.links.get(name)
    if body is None or not body.capsules:
        return [f"{folder.call(name)}: result.json has it, hand.urdf has no such capsule"]
    who, problems = folder.call(name), []
    length, radius = float(stated["length"]), float(stated["radius"])
    capsule = body.capsules[0]
    if not _is_capsule(capsule.start, capsule.end, capsule.radius, np.zeros(3), np.array([0, 0, length]), radius):
        actual = float(np.linalg.norm(capsule.end - capsule.start))
        problems.append(
            f"{who}: hand.urdf has a capsule of {1e3 * actual:.4g} mm × {1e3 * capsule.radius:.4g} mm,"
            f" result.json one of {1e3 * length:.4g} mm × {1e3 * radius:.4g} mm"
        )
    if folder.model.existFrame(after):
        joint = folder.model.getJointId(after.replace("_link", "_joint"))
        offset = folder.model.jointPlacements[joint].translation
        if not np.allclose(offset, [0, 0, length], atol=1e-6 * length):
            problems.append(
                f"{who}: the next joint in hand.urdf is not at its end, {1e3 * length:.4g} mm from its start"
            )
    volume = np.pi * radius**2 * (length + 4 / 3 * radius)
    if not _same(body.mass, folder.task.hand.density * volume, 1e-4):
        problems.append(f"{who}: {body.mass:.4g} kg is not its volume times the task's density")
    return problems


def _palm_problems(folder: Folder) -> list[str]:
    """A palm that may not move stands where the task says, and passes through the waypoints the task gives it."""
    palm, motion = folder.task.palm, folder.motion
    if palm.may_move:
        return []
    where = np.asarray(palm.position, dtype=float)
    problems = []
    turned = Rotation.from_matrix(palm.rotation).inv() * Rotation.from_quat(motion.base_orientation, scalar_first=True)
    moved = np.linalg.norm(motion.base_position - where, axis=1) + folder.length * turned.magnitude()
    checked = moved if palm.motion is None else moved[:1]
    if checked.max() > 1e-6:
        k = int(np.argmax(checked))
        problems.append(f"base_position: the palm is not where the task puts it at {motion.time[k]:.3g} s")
    for point in palm.motion or ():
        at = np.array([np.interp(point.at, motion.time, motion.base_position[:, i]) for i in range(3)])
        off = float(np.linalg.norm(at - np.asarray(point.position)))
        if off > 1e-4:
            problems.append(f"base_position: the palm is {1e3 * off:.3g} mm from its waypoint at {point.at:.3g} s")
    return problems


def _goal_problems(folder: Folder) -> list[str]:
    goals, stated = folder.task.motion, folder.result.get("goals", [])
    if len(goals) != len(stated):
        return [f"goals: result.json has {len(stated)}, task.yaml has {len(goals)}"]
    problems = []
    for number, (goal, other) in enumerate(zip(goals, stated, strict=True), start=1):
        at = other.get("point") if folder.task.tool is not None else other.get("position")
        target = goal.tool_at if folder.task.tool is not None else goal.position
        agree = _same(other.get("time"), goal.at) and _same(at, target)
        if agree and folder.task.tool is None:
            turn = Rotation.from_rotvec(goal.rotation.vector).inv()
            agree = (turn * Rotation.from_quat(other["orientation"], scalar_first=True)).magnitude() < 1e-6
        if not agree:
            problems.append(f"goals: goal {number} of result.json is not that of task.yaml")
    return problems
