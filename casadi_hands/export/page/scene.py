"""The scene of a design, drawn with meshcat from the exported URDF."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from meshcat.commands import SetAnimation
from meshcat.geometry import (
    Box,
    Cylinder,
    Line,
    LineBasicMaterial,
    MeshBasicMaterial,
    MeshLambertMaterial,
    MeshPhongMaterial,
    PointsGeometry,
    Sphere,
    TriangularMeshGeometry,
)

from casadi_hands.export.markup import GROUND_COLOR, finger_color
from casadi_hands.export.page.candidates import draw_candidates
from casadi_hands.export.page.keep_out import draw_keep_out
from casadi_hands.export.page.recorder import recording
from casadi_hands.export.page.robot import Robot, Shape, object_robot
from casadi_hands.export.page.shapes import Color, FineSphere, LayeredMesh, two_toned
from casadi_hands.export.page.timeline import Timeline, design_timeline, goal_poses, poses
from casadi_hands.export.page.tracks import Tracks
from casadi_hands.export.page.unsolved import Label, bare_palm, distinct_goals, goal_labels, steps
from casadi_hands.export.urdf import hand_urdf

if TYPE_CHECKING:
    from casadi_hands.problem.motion import Motion
    from casadi_hands.problem.result import Result
    from casadi_hands.task import Task

FORCE_COLOR: Color = (0.85, 0.12, 0.15)
EXTERNAL_COLOR: Color = (0.45, 0.20, 0.75)
GOAL_COLOR: Color = (0.25, 0.60, 0.35)

# Sizes on the page, where the whole scene fits in a ball of radius 1.
_LONGEST_ARROW = 0.45
_HEAD = 0.07
_SHAFT_RADIUS = 0.012
_MARKER = 0.02


@dataclass(frozen=True)
class Scene:
    """What the page needs.

    Attributes:
        commands: meshcat's drawing commands, msgpack.
        time: (S,) s, the keys of the animation; one entry if nothing moves.
        eye: (3,) direction from the scene's middle to the camera, world axes, unit length.
        legend: what each colour means, in order.
        longest_force: N, the largest force drawn; 0 if there are none.
        labels: names beside what is drawn, of a task that has no hand yet.
    """

    commands: list[bytes]
    time: np.ndarray
    eye: np.ndarray
    legend: list[tuple[str, Color]]
    longest_force: float
    labels: tuple[Label, ...] = ()


def draw_scene(design: Result) -> Scene:
    """Draw a design: hand, object, goals, ground, forces, all moving.

    Args:
        design: whole or partial; without a hand the bare palm is drawn, without a motion the start.
    """
    task = design.task
    hand, item = Robot(hand_urdf(design.hand or bare_palm(design))), object_robot(task)
    timeline = design_timeline(design, hand)
    middle, radius = _bounds(timeline, hand, item, goal_poses(task))
    visualizer, recorder = recording()
    root = visualizer["/design"]
    root.set_transform(np.diag([1 / radius] * 3 + [1.0]) @ _shift(-middle))
    tracks = Tracks(timeline.time)
    _draw_hand(root, tracks, hand, timeline)
    _draw_object(root["object"], item)
    root["object"].set_transform(timeline.object[0])
    tracks.move(root["object"], timeline.object)
    _draw_goals(root["goals"], design, item, radius)
    if task.ground is not None:
        _draw_ground(root["ground"], middle, radius, task.ground.height)
    draw_keep_out(root["keep_out"], task)
    force = _draw_forces(root, tracks, design.motion, radius) if design.motion else 0.0
    labels: tuple[Label, ...] = ()
    if design.hand is None:
        contacts = tuple(_draw_contacts(root["object"], task, radius))
        contacts = (*contacts, *draw_candidates(root["object"], design.placement, radius))
        labels = (*contacts, *goal_labels(root["goals"], task, GOAL_COLOR))
    if len(timeline.time) > 1:
        recorder.send(SetAnimation(tracks.animation, play=False, repetitions=1))
    return Scene(
        recorder.commands, timeline.time, eye_towards(task.palm.rotation[:, 2]), _legend(design), force, labels
    )


def _draw_hand(root: Any, tracks: Tracks, hand: Robot, timeline: Timeline) -> None:
    """Draw the links as a tree, each moving relative to its parent, so that between keys joints still only turn."""
    nodes: dict[str, Any] = {}
    for link, parent in hand.parents.items():
        if parent is None:
            nodes[link], relative = root[link], timeline.palm @ timeline.links[link]
        else:
            nodes[link] = nodes[parent][link]
            relative = np.linalg.inv(timeline.links[parent]) @ timeline.links[link]
        nodes[link].set_transform(relative[0])
        tracks.move(nodes[link], relative)
    for k, shape in enumerate(hand.shapes):
        _draw_shape(nodes[shape.link][f"shape{k}"], shape, MeshPhongMaterial(color=_hex(shape.color), shininess=40))


def _draw_object(node: Any, item: Robot) -> None:
    """Draw the object in two tones."""
    for k, shape in enumerate(item.shapes):
        node[f"shape{k}"].set_object(two_toned(shape), MeshPhongMaterial(vertexColors=True, shininess=40))
        node[f"shape{k}"].set_transform(shape.placement)


def _draw_goals(node: Any, design: Result, item: Robot, radius: float) -> None:
    """Draw each different goal pose as a ghost of the object, or each point as a dot on the path of the tool."""
    task = design.task
    if task.tool is None:
        # First the ghost's depth alone, then its colour: otherwise its spheres show through its cylinders.
        depth = MeshBasicMaterial(transparent=True, colorWrite=False)
        ghost = MeshLambertMaterial(color=_hex(GOAL_COLOR), opacity=0.2, transparent=True)
        places = goal_poses(task)
        for drawn, group in enumerate(distinct_goals(places, 1e-6 * task.object.characteristic_length)):
            goal = node[f"goal{drawn}"]
            goal.set_transform(places[group[0]])
            for k, shape in enumerate(item.shapes):
                _draw_shape(goal[f"shape{k}"]["depth"], shape.thinner, depth, layer=1)
                _draw_shape(goal[f"shape{k}"]["color"], shape.thinner, ghost, layer=2)
        return
    for k, goal in enumerate(task.motion):
        node[f"goal{k}"].set_object(Sphere(_MARKER * radius), MeshLambertMaterial(color=_hex(GOAL_COLOR)))
        node[f"goal{k}"].set_transform(_shift(np.array(goal.tool_at)))
    if design.motion is not None:
        places = poses(design.motion.object_position, design.motion.object_orientation)
        path = places[:, :3, :3] @ np.array(task.tool) + places[:, :3, 3]
        node["path"].set_object(Line(PointsGeometry(path.T), LineBasicMaterial(color=_hex(GOAL_COLOR))))


def _draw_contacts(node: Any, task: Task, radius: float) -> Iterator[Label]:
    """Draw where fingertips shall touch as dots on the object, and name them; those to be placed have no place yet."""
    for i, (name, finger) in enumerate(task.fingers.items()):
        if finger.is_placed:
            dot = node[f"contact_{name}"]
            dot.set_object(Sphere(_MARKER * radius), MeshLambertMaterial(color=_hex(finger_color(i))))
            dot.set_transform(_shift(np.array(finger.point)))
            yield Label(steps(dot), name, finger_color(i))


def _draw_ground(node: Any, middle: np.ndarray, radius: float, height: float) -> None:
    """Draw a disc whose top is the ground."""
    thickness = 0.02 * radius
    node.set_object(Cylinder(thickness, 5 * radius), MeshLambertMaterial(color=_hex(GROUND_COLOR)))
    node.set_transform(_shift(np.array([middle[0], middle[1], height - thickness / 2])) @ _UPRIGHT_CYLINDER)


def _draw_forces(root: Any, tracks: Tracks, motion: Motion, radius: float) -> float:
    """Draw contact and external forces, each arrow's point where the force acts; they ride on the object.

    Returns:
        The largest force, N, whose arrow is the longest; 0 if there are none.
    """
    forces = [
        (f"force_{name}", FORCE_COLOR, motion.contact_point_object[:, c], motion.contact_force[:, c])
        for c, name in enumerate(motion.contact_names)
    ]
    forces.append(("external_force", EXTERNAL_COLOR, np.zeros_like(motion.external_force), motion.external_force))
    largest = max(float(np.linalg.norm(force, axis=1).max()) for *_, force in forces)
    if largest == 0.0:
        return 0.0
    to_world = poses(motion.object_position, motion.object_orientation)[:, :3, :3]
    for name, color, tips, force in forces:
        if not force.any():
            continue
        node = root["object"][name]
        _draw_arrow(node, color, radius)
        local = np.einsum("sji,sj->si", to_world, force) * (_LONGEST_ARROW * radius / largest)
        tracks.arrow(node, _HEAD * radius, tips, local, np.linalg.norm(force, axis=1) > 1e-6 * largest)
    return largest


def _draw_arrow(node: Any, color: Color, radius: float) -> None:
    """Draw an arrow along z with its point at the origin; its shaft is of unit length, to be scaled.

    It shines through whatever is in front of it: most of it lies inside a fingertip.
    """
    paint = MeshBasicMaterial(color=_hex(color), opacity=0.85, transparent=True, depthTest=False, depthWrite=False)
    head, shaft = _HEAD * radius, _SHAFT_RADIUS * radius
    cone = Cylinder(head, radiusTop=0.0, radiusBottom=2.5 * shaft)
    node["head"]["cone"].set_object(LayeredMesh(cone, paint, 3))
    node["head"]["cone"].set_transform(_shift(np.array([0.0, 0.0, -head / 2])) @ _UPRIGHT_CYLINDER)
    node["shaft"]["rod"].set_object(LayeredMesh(Cylinder(1.0, shaft), paint, 3))
    node["shaft"]["rod"].set_transform(_shift(np.array([0.0, 0.0, -0.5])) @ _UPRIGHT_CYLINDER)


def _draw_shape(node: Any, shape: Shape, material: Any, layer: int = 0) -> None:
    """Draw a primitive where its link carries it."""
    if shape.mesh is not None:
        node.set_object(LayeredMesh(TriangularMeshGeometry(*shape.mesh), material, layer))
        node.set_transform(shape.placement)
    elif shape.sides is not None:
        node.set_object(LayeredMesh(Box(shape.sides), material, layer))
        node.set_transform(shape.placement)
    elif shape.length is None:
        node.set_object(LayeredMesh(FineSphere(shape.radius), material, layer))
        node.set_transform(shape.placement)
    else:
        node.set_object(LayeredMesh(Cylinder(shape.length, shape.radius), material, layer))
        node.set_transform(shape.placement @ _UPRIGHT_CYLINDER)


# A three.js cylinder stands along y.
_UPRIGHT_CYLINDER = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


def _bounds(timeline: Timeline, hand: Robot, item: Robot, goals: np.ndarray) -> tuple[np.ndarray, float]:
    """Middle (3,) and radius (m) of a ball that holds everything at all times."""
    centers, reaches = [], []
    for shape in hand.shapes:
        places = timeline.palm @ timeline.links[shape.link] @ shape.placement
        centers.append(places[:, :3, 3])
        reaches.append(np.full(len(places), shape.reach))
    for shape in item.shapes:
        places = np.concatenate([timeline.object, goals]) @ shape.placement
        centers.append(places[:, :3, 3])
        reaches.append(np.full(len(places), shape.reach))
    center, reach = np.concatenate(centers), np.concatenate(reaches)[:, None]
    middle = ((center - reach).min(axis=0) + (center + reach).max(axis=0)) / 2
    return middle, float((np.linalg.norm(center - middle, axis=1) + reach[:, 0]).max())


def eye_towards(facing: np.ndarray) -> np.ndarray:
    """Direction (3,) to the camera: from the side, a little from above and from where the palm is facing (3,)."""
    level = np.array([facing[0], facing[1], 0.0])
    if np.linalg.norm(level) < 0.3:
        level = np.array([1.0, 0.0, 0.0])
    level /= np.linalg.norm(level)
    eye = np.cross(level, [0.0, 0.0, 1.0]) + 0.55 * level + [0.0, 0.0, 0.5]
    return np.asarray(eye / np.linalg.norm(eye))


def _legend(design: Result) -> list[tuple[str, Color]]:
    """Names of what has a colour of its own."""
    names = [finger.name for finger in design.hand.fingers] if design.hand else design.task.fingers
    legend = [(name, finger_color(i)) for i, name in enumerate(names)]
    legend.append(("goal", GOAL_COLOR))
    if design.motion is not None and design.motion.contact_force.any():
        legend.append(("contact force", FORCE_COLOR))
    if design.motion is not None and design.motion.external_force.any():
        legend.append(("external force", EXTERNAL_COLOR))
    return legend


def _shift(offset: np.ndarray) -> np.ndarray:
    """Pose (4, 4) that moves by an offset (3,)."""
    pose = np.eye(4)
    pose[:3, 3] = offset
    return pose


def _hex(color: Color) -> int:
    """A colour as three.js takes it."""
    red, green, blue = (round(255 * part) for part in color)
    return red << 16 | green << 8 | blue
