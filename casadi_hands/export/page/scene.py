"""The scene of a design, drawn with meshcat from the exported URDF."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
from casadi_hands.export.page.names import link_name, named, node_name
from casadi_hands.export.page.overlays import (
    AXIS_COLOR,
    EXTERNAL_COLOR,
    FORCE_COLOR,
    Layer,
    draw_axis,
    draw_forces,
    draw_paths,
)
from casadi_hands.export.page.recorder import recording
from casadi_hands.export.page.robot import Robot, Shape, object_robot
from casadi_hands.export.page.shapes import UPRIGHT_CYLINDER, Color, FineSphere, LayeredMesh, paint, shift, two_toned
from casadi_hands.export.page.timeline import Timeline, design_timeline, goal_poses, poses
from casadi_hands.export.page.tracks import Tracks
from casadi_hands.export.page.unsolved import Label, bare_palm, distinct_goals, goal_labels, steps
from casadi_hands.export.urdf import hand_urdf

if TYPE_CHECKING:
    from casadi_hands.problem.result import Result
    from casadi_hands.task import Task

GOAL_COLOR: Color = (0.25, 0.60, 0.35)
_MARKER = 0.02  # radius on the page, where the whole scene fits in a ball of radius 1


@dataclass(frozen=True)
class Scene:
    """What the page needs.

    Attributes:
        commands: meshcat's drawing commands, msgpack.
        time: (S,) s, the keys of the animation; one entry if nothing moves.
        views: name -> (3,) direction from the scene's middle to the camera, world axes, unit length; the first is where
            the page begins.
        radius: m, of the ball that the scene is in.
        hand, ground: where they are in meshcat's tree; no ground, None.
        layers: what can be shown and hidden.
        legend: what each colour means, in order.
        longest_force: N, the largest force drawn; 0 if there are none.
        labels: names beside what is drawn, of a task that has no hand yet.
    """

    commands: list[bytes]
    time: np.ndarray
    views: dict[str, np.ndarray]
    radius: float
    hand: tuple[str, ...]
    ground: tuple[str, ...] | None
    layers: tuple[Layer, ...]
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
    root.set_transform(np.diag([1 / radius] * 3 + [1.0]) @ shift(-middle))
    tracks = Tracks(timeline.time)
    names = [] if design.hand is None else [finger.name for finger in design.hand.fingers]
    nodes = _draw_hand(root, tracks, hand, timeline, names)
    _draw_object(root["object"], item)
    root["object"].set_transform(timeline.object[0])
    tracks.move(root["object"], timeline.object)
    _draw_goals(root["goals"], design, item, radius)
    if task.ground is not None:
        _draw_ground(root["ground"], middle, radius, task.ground.height)
    draw_keep_out(root["keep out"], task)
    force, layers = 0.0, [Layer("Goals", True, GOAL_COLOR, (steps(root["goals"]),))]
    if design.motion is not None:
        force = draw_forces(root["object"]["forces"], tracks, design.motion, radius)
        draw_paths(root["contact paths"], design.motion, [finger_color(i) for i in range(len(names))], radius)
        layers.insert(0, Layer("Forces", True, FORCE_COLOR, (steps(root["object"]["forces"]),)))
        layers.append(Layer("Contact paths", False, None, (steps(root["contact paths"]),)))
    if hand.axes:
        axes = tuple(draw_axis(nodes[link]["joint axis"], axis, radius) for link, axis in hand.axes.items())
        layers.append(Layer("Joint axes", False, AXIS_COLOR, axes))
    labels: tuple[Label, ...] = ()
    if design.hand is None:
        node = root["object"]["contacts"]
        contacts = (*_draw_contacts(node, task, radius), *draw_candidates(node, design.placement, radius))
        labels = (*contacts, *goal_labels(root["goals"], task, GOAL_COLOR))
        layers.append(Layer("Contacts", True, None, (steps(root["object"]["contacts"]),)))
    if len(timeline.time) > 1:
        recorder.send(SetAnimation(tracks.animation, play=False, repetitions=1))
    return Scene(
        commands=recorder.commands,
        time=timeline.time,
        views=views(task.palm.rotation[:, 2]),
        radius=radius,
        hand=steps(root["palm"]),
        ground=None if task.ground is None else steps(root["ground"]),
        layers=tuple(layers),
        legend=_legend(design),
        longest_force=force,
        labels=labels,
    )


def _draw_hand(root: Any, tracks: Tracks, hand: Robot, timeline: Timeline, fingers: Sequence[str]) -> dict[str, Any]:
    """Draw the links as a tree, each moving relative to its parent, so that between keys joints still only turn.

    Returns:
        Each link's node.
    """
    nodes: dict[str, Any] = {}
    for link, parent in hand.parents.items():
        if parent is None:
            nodes[link], relative = root[link], timeline.palm @ timeline.links[link]
        else:
            nodes[link] = nodes[parent][link_name(link, fingers)]
            relative = np.linalg.inv(timeline.links[parent]) @ timeline.links[link]
        nodes[link].set_transform(relative[0])
        tracks.move(nodes[link], relative)
    for name, shape in named(hand.shapes):
        _draw_shape(nodes[shape.link][name], shape, MeshPhongMaterial(color=paint(shape.color), shininess=40))
    return nodes


def _draw_object(node: Any, item: Robot) -> None:
    """Draw the object in two tones."""
    for name, shape in named(item.shapes):
        node[name].set_object(two_toned(shape), MeshPhongMaterial(vertexColors=True, shininess=40))
        node[name].set_transform(shape.placement)


def _draw_goals(node: Any, design: Result, item: Robot, radius: float) -> None:
    """Draw each different goal pose as a ghost of the object, or each point as a dot on the path of the tool."""
    task = design.task
    if task.tool is None:
        # First the ghost's depth alone, then its colour: otherwise its spheres show through its cylinders.
        depth = MeshBasicMaterial(transparent=True, colorWrite=False)
        ghost = MeshLambertMaterial(color=paint(GOAL_COLOR), opacity=0.2, transparent=True)
        places = goal_poses(task)
        for group in distinct_goals(places, 1e-6 * task.object.characteristic_length):
            goal = node[f"goal {group[0] + 1}"]
            goal.set_transform(places[group[0]])
            for name, shape in named(item.shapes):
                _draw_shape(goal[name]["depth"], shape.thinner, depth, layer=1)
                _draw_shape(goal[name]["color"], shape.thinner, ghost, layer=2)
        return
    for k, goal in enumerate(task.motion):
        node[f"goal {k + 1}"].set_object(Sphere(_MARKER * radius), MeshLambertMaterial(color=paint(GOAL_COLOR)))
        node[f"goal {k + 1}"].set_transform(shift(np.array(goal.tool_at)))
    if design.motion is not None:
        places = poses(design.motion.object_position, design.motion.object_orientation)
        path = places[:, :3, :3] @ np.array(task.tool) + places[:, :3, 3]
        node["path of the tool"].set_object(Line(PointsGeometry(path.T), LineBasicMaterial(color=paint(GOAL_COLOR))))


def _draw_contacts(node: Any, task: Task, radius: float) -> Iterator[Label]:
    """Draw where fingertips shall touch as dots on the object, and name them; those to be placed have no place yet."""
    for i, (name, finger) in enumerate(task.fingers.items()):
        for n, point in enumerate(finger.points if finger.is_placed else ()):
            # Where it touches later, after a regrasp, is a number.
            dot = node[node_name(f"{name} {n + 1}" if n else name)]
            dot.set_object(Sphere(_MARKER * radius), MeshLambertMaterial(color=paint(finger_color(i))))
            dot.set_transform(shift(np.array(point)))
            yield Label(steps(dot), f"{name} {n + 1}" if n else name, finger_color(i))


def _draw_ground(node: Any, middle: np.ndarray, radius: float, height: float) -> None:
    """Draw a disc whose top is the ground."""
    thickness = 0.02 * radius
    node.set_object(Cylinder(thickness, 5 * radius), MeshLambertMaterial(color=paint(GROUND_COLOR)))
    node.set_transform(shift(np.array([middle[0], middle[1], height - thickness / 2])) @ UPRIGHT_CYLINDER)


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
        node.set_transform(shape.placement @ UPRIGHT_CYLINDER)


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


def views(facing: np.ndarray) -> dict[str, np.ndarray]:
    """Directions (3,) to the camera by name, of a palm that faces a direction (3,)."""
    start = eye_towards(facing)
    front = np.array([facing[0], facing[1], 0.0]) if np.linalg.norm(facing[:2]) >= 0.3 else np.array([1.0, 0.0, 0.0])
    front /= np.linalg.norm(front)
    side = np.cross(front, [0.0, 0.0, 1.0])
    # A camera that looks straight down has no up; this one is turned as the first.
    above = np.array([1e-3 * start[0], 1e-3 * start[1], 1.0])
    return {"Start": start, "Front": front, "Side": side, "Top": above / np.linalg.norm(above)}


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
