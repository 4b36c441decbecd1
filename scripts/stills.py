"""Pictures of a design at several moments of its motion."""

from __future__ import annotations

from itertools import chain, pairwise
from pathlib import Path

import numpy as np
from camera import Camera, look, png
from raycast import Capsule, Disc, draw, overlay
from scipy.spatial.transform import Rotation

from casadi_hands.export.design import Design
from casadi_hands.export.markup import OBJECT_COLOR, PALM_COLOR, Color, finger_color, joint_color
from casadi_hands.export.page.robot import Robot
from casadi_hands.export.page.scene import EXTERNAL_COLOR, FORCE_COLOR, GOAL_COLOR, eye_towards
from casadi_hands.export.page.timeline import Timeline, design_timeline, goal_poses
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.problem.hand import Hand

MOMENTS = 5
"""Pictures of a motion, evenly in time, start and end among them."""
SIZE = (528, 396)
"""Width and height, pixels."""
_JOINT = 1.12  # radius of a joint's ball over its link's: so that joints can be counted
_TONGUE = 0.6  # radius of what reaches from a link's body to its joint, over its link's
_DOT = 0.07  # radius of a goal point over the object's characteristic length
_ARROW = 1.3  # length of the longest force arrow over the object's characteristic length


def kept_stills(design: Design, folder: Path) -> list[tuple[float, bytes]]:
    """The pictures of a design, read from its folder if they are not older than its result.

    Args:
        design: whole or partial.
        folder: its folder; pictures are kept there as ``still0.png`` and so on.

    Returns:
        Time (s) and PNG of every moment.
    """
    times = moments(design)
    files = [folder / f"still{k}.png" for k in range(len(times))]
    made = (folder / "result.json").stat().st_mtime
    if not all(file.is_file() and file.stat().st_mtime >= made for file in files):
        for file, picture in zip(files, stills(design, times), strict=True):
            file.write_bytes(picture)
    return [(time, file.read_bytes()) for time, file in zip(times, files, strict=True)]


def moments(design: Design) -> list[float]:
    """Times that are drawn, s; the start alone where there is no motion."""
    if design.motion is None:
        return [0.0]
    times: list[float] = np.linspace(design.motion.time[0], design.motion.time[-1], MOMENTS).tolist()
    return times


def stills(design: Design, times: list[float]) -> list[bytes]:
    """Draw a design at some times, all seen by one camera.

    Args:
        design: whole or partial; without a hand there is the bare palm, without a motion the start.
        times: s; the nearest sample is drawn.

    Returns:
        A PNG with a clear background for each time.
    """
    hand = Robot(hand_urdf(design.hand or _bare_palm(design)))
    timeline = design_timeline(design, hand)
    samples = [int(np.abs(timeline.time - time).argmin()) for time in times]
    scenes = [_bodies(design, timeline, k) for k in samples]
    arrows = [_arrows(design, timeline, k) for k in samples]
    everything = [*_goals(design), *chain.from_iterable(scenes), *chain.from_iterable(arrows)]
    camera = look(eye_towards(design.task.palm.rotation[:, 2]), _extent(everything), SIZE)
    ground = design.task.ground
    pictures = []
    for bodies, pieces in zip(scenes, arrows, strict=True):
        picture, distance = draw(camera, bodies, None if ground is None else ground.height)
        _draw_goals(picture, distance, camera, design, timeline)
        overlay(picture, distance, camera, pieces, 0.85, True)
        pictures.append(png(picture))
    return pictures


def _bare_palm(design: Design) -> Hand:
    palm = design.task.palm
    return Hand(palm.radius, palm.thickness, (), 0.0, 0.0, 0.0, 0.0, design.task.hand.density)


def _bodies(design: Design, timeline: Timeline, sample: int) -> list[Capsule | Disc]:
    """The palm, the fingers and the object at one sample, in the world."""
    palm, hand = timeline.palm[sample], design.hand or _bare_palm(design)
    bodies: list[Capsule | Disc] = [Disc(palm, hand.palm_radius, hand.palm_thickness, PALM_COLOR)]
    for ball in hand.palm_balls:
        at = _placed(palm, ball.start)
        bodies.append(Capsule(at, at, ball.radius, PALM_COLOR))
    for i, finger in enumerate(hand.fingers):
        for j, link in enumerate(finger.links):
            pose = palm @ timeline.links[f"finger{i}_link{j}"][sample]
            solid, last = link.solid, joint_color(i) if j == len(finger.links) - 1 else None
            start, end = _placed(pose, solid.start), _placed(pose, solid.end)
            bodies.append(Capsule(start, end, solid.radius, finger_color(i), last))
            if link.hinge:
                bodies.append(Capsule(pose[:3, 3], start, _TONGUE * link.radius, joint_color(i), shades=False))
            bodies.append(Capsule(pose[:3, 3], pose[:3, 3], _JOINT * link.radius, joint_color(i), shades=False))
    bodies.extend(_object_at(design, timeline.object[sample], OBJECT_COLOR, checked=True))
    return bodies


def _placed(pose: np.ndarray, point: np.ndarray) -> np.ndarray:
    """A point (3,) of a frame, where the frame's pose (4, 4) has it."""
    return np.asarray(pose[:3, :3] @ point + pose[:3, 3])


def _object_at(design: Design, pose: np.ndarray, color: Color, checked: bool) -> list[Capsule | Disc]:
    """The object's primitives at a pose (4, 4)."""
    checks = pose if checked else None
    bodies: list[Capsule | Disc] = []
    for solid in (solid for shape in design.task.object.shapes for solid in shape.body.solids()):
        start, end = _placed(pose, solid.start), _placed(pose, solid.end)
        if solid.kind == "cylinder":
            bodies.append(_disc(start, end, solid.radius, color))
        else:
            bodies.append(Capsule(start, end, solid.radius, color, checks=checks))
    return bodies


def _disc(start: np.ndarray, end: np.ndarray, radius: float, color: Color) -> Disc:
    """A cylinder between the middles (3,) of its faces."""
    length, pose = float(np.linalg.norm(end - start)), np.eye(4)
    turn, _ = Rotation.align_vectors([(end - start) / length], [[0, 0, 1]])
    pose[:3] = np.column_stack([turn.as_matrix(), end])
    return Disc(pose, radius, length, color)


def _extent(bodies: list[Capsule | Disc]) -> np.ndarray:
    """Points (P, 3) whose pictures bound those of the bodies."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / np.sqrt(2)
    points = []
    for body in bodies:
        if isinstance(body, Capsule):
            points.extend([body.start + body.radius * corners, body.end + body.radius * corners])
        else:
            angles = np.linspace(0, 2 * np.pi, 16)
            rim = body.radius * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
            points.extend([(rim - [0, 0, z]) @ body.pose[:3, :3].T + body.pose[:3, 3] for z in (0.0, body.thickness)])
    return np.vstack(points)


def _goals(design: Design) -> list[Capsule | Disc]:
    """The object at each goal pose; for a drawing task a dot at each goal point."""
    task = design.task
    if task.tool is None:
        return [body for pose in goal_poses(task) for body in _object_at(design, pose, GOAL_COLOR, checked=False)]
    points = [np.array(goal.tool_at) for goal in task.motion]
    return [Capsule(point, point, _DOT * task.object.characteristic_length, GOAL_COLOR) for point in points]


def _draw_goals(picture: np.ndarray, distance: np.ndarray, camera: Camera, design: Design, timeline: Timeline) -> None:
    """Draw each goal pose as a ghost of the object; for a drawing task the goals' points and the tool's path."""
    goals, tool = _goals(design), design.task.tool
    if tool is None:
        pieces = len(goals) // len(goal_poses(design.task))
        for k in range(0, len(goals), pieces):
            overlay(picture, distance, camera, goals[k : k + pieces], 0.13, False)
        return
    path = timeline.object[:, :3, :3] @ np.array(tool) + timeline.object[:, :3, 3]
    width = _DOT / 3 * design.task.object.characteristic_length
    line = [Capsule(a, b, width, GOAL_COLOR) for a, b in pairwise(path)]
    overlay(picture, distance, camera, [*goals, *line], 0.9, False)


def _arrows(design: Design, timeline: Timeline, sample: int) -> list[Capsule]:
    """Contact and external forces as arrows that end where the force acts."""
    motion = design.motion
    if motion is None:
        return []
    size = design.task.object.characteristic_length
    pose = timeline.object[sample]
    forces = [(motion.contact_point_object[sample, c], motion.contact_force[sample, c], FORCE_COLOR)
              for c in range(len(motion.contact_names))]  # fmt: skip
    forces.append((np.zeros(3), motion.external_force[sample], EXTERNAL_COLOR))
    largest = max(float(np.linalg.norm(motion.contact_force, axis=2).max()), float(np.abs(motion.external_force).max()))
    pieces = []
    for point, force, color in forces:
        strength = float(np.linalg.norm(force))
        if strength <= 1e-3 * largest:
            continue
        tip = pose[:3, :3] @ point + pose[:3, 3]
        along, width = force / strength, 0.022 * size
        length = _ARROW * size * strength / largest
        head = min(0.26 * size, 0.6 * length)
        pieces.append(Capsule(tip - length * along, tip - head * along, width, color))
        # A cone is a row of balls that shrink towards the tip.
        for share in np.linspace(0.02, 1.0, 24):
            ball = tip - share * head * along
            pieces.append(Capsule(ball, ball, 3.2 * width * share, color))
    return pieces
