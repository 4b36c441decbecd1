"""A task and a design in viser's scene, in metres, world z up."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from casadi_hands.export.markup import GROUND_COLOR, Color, finger_color
from casadi_hands.export.page.robot import Robot, Shape, object_robot
from casadi_hands.export.page.scene import GOAL_COLOR
from casadi_hands.export.page.shapes import two_toned
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.motion.quaternion import quaternion
from casadi_hands.problem.result import Result
from casadi_hands.studio.animation import OBJECT, Animation, animation_of
from casadi_hands.studio.document import Path
from casadi_hands.studio.places import Place, places
from casadi_hands.task import Task

TASK, RESULT = "/task", "/result"
"""Of what is shown while the task is, and while the hand is; the floor is always."""
_GAMMA = 2.2  # colours of vertices are linear in a glTF mesh, and elsewhere not
_PALM: Color = (0.62, 0.65, 0.70)


class TaskDrawing:
    """A task as it is written: each of its places is a node that can be clicked and moved.

    Args:
        scene: viser's.
        chosen: called with the place that is clicked.
    """

    def __init__(self, scene: Any, chosen: Callable[[Place], None]) -> None:
        self._scene, self._chosen = scene, chosen
        self._nodes: dict[tuple[str | int, ...], Any] = {}

    def draw(self, task: Task) -> None:
        """Draw a task in place of what was drawn."""
        for node in self._nodes.values():
            node.remove()
        self._nodes = {}
        item, size = object_robot(task), task.object.characteristic_length
        for each in places(task):
            node = self._scene.add_frame(
                f"{TASK}/{'_'.join(map(str, each.path))}",
                show_axes=False,
                position=each.position,
                wxyz=quaternion(each.rotation),
            )
            self._nodes[each.path] = node
            for handle in self._draw_place(node.name, each, task, item, size):
                handle.on_click(lambda _, each=each: self._chosen(each))
        for path, text, at in names_of(task):
            self._scene.add_label(
                f"{self._nodes[path].name}/name", text, position=at, font_screen_scale=0.8, anchor="bottom-left"
            )
        if task.ground is not None:
            self._nodes[("floor",)] = _add_floor(self._scene, "/floor", task, size)

    def move(self, place: Place, position: np.ndarray, wxyz: np.ndarray) -> None:
        """Let one place follow a gizmo, until the task is drawn anew."""
        node = self._nodes.get(place.path)
        if node is not None:
            node.position, node.wxyz = position, wxyz

    def _draw_place(self, name: str, place: Place, task: Task, item: Robot, size: float) -> list[Any]:
        scene, mark = self._scene, 0.06 * size
        if place.kind in ("palm", "waypoint"):
            palm, ghost = task.palm, place.kind == "waypoint"
            body = scene.add_cylinder(
                f"{name}/disc",
                palm.radius,
                palm.thickness,
                _rgb(_PALM),
                opacity=0.25 if ghost else None,
                position=(0.0, 0.0, -palm.thickness / 2),
            )
            return [body]
        if place.kind in ("goal", "joint goal"):
            first = place.path == ("motion", 0)
            return [_add_shape(scene, f"{name}/{k}", shape, first) for k, shape in enumerate(item.shapes)]
        if place.kind == "tool goal":
            drawn = [scene.add_icosphere(f"{name}/dot", mark, _rgb(GOAL_COLOR))]
            if place.path == ("motion", 0):
                away = -np.array(task.tool or (0.0, 0.0, 0.0))
                scene.add_frame(f"{name}/object", show_axes=False, position=away)
                drawn += [_add_shape(scene, f"{name}/object/{k}", s, True) for k, s in enumerate(item.shapes)]
            return drawn
        finger = place.path[1]
        color = finger_color(list(task.fingers).index(finger)) if finger in task.fingers else GROUND_COLOR
        return [scene.add_icosphere(f"{name}/dot", mark, _rgb(color))]


def names_of(task: Task) -> list[tuple[Path, str, np.ndarray]]:
    """Names of a task's places, those in one place together: the path of the first, and where in its frame (3,), m."""
    found: list[tuple[Place, list[str], np.ndarray, np.ndarray]] = []
    near = 0.1 * task.object.characteristic_length
    for each in places(task):
        local = np.zeros(3)
        if each.kind in ("goal", "joint goal"):
            lower, upper = task.object.bounding_box
            longest = int(np.argmax(upper - lower))
            local = (lower + upper) / 2
            local[longest] = upper[longest]
        elif each.kind in ("palm", "waypoint"):
            local[2] = -task.palm.thickness
        world = each.position + each.rotation @ local
        beside = next((words for _, words, _, other in found if np.linalg.norm(other - world) < near), None)
        if beside is None:
            found.append((each, [each.short], local, world))
        else:
            beside.append(each.short)
    return [(place.path, ", ".join(words), local) for place, words, local, _ in found]


class ResultDrawing:
    """A designed hand and its object, at any time of their motion.

    Args:
        scene: viser's.
        atomic: viser's context within which what moves moves at once.
    """

    def __init__(self, scene: Any, atomic: Callable[[], Any]) -> None:
        self._scene, self._atomic = scene, atomic
        self._frames: list[Any] = []
        self._animation: Animation | None = None

    @property
    def end(self) -> float:
        """When the motion ends, s; 0 where nothing moves."""
        return 0.0 if self._animation is None else self._animation.end

    @property
    def there(self) -> bool:
        """Whether a hand is drawn."""
        return self._animation is not None

    def draw(self, design: Result) -> bool:
        """Draw a design in place of what was drawn; nothing, and False, where it has no hand."""
        if design.hand is None:
            return False
        for frame in self._frames:
            frame.remove()
        hand, item = Robot(hand_urdf(design.hand)), object_robot(design.task)
        self._animation = animation_of(design, hand)
        self._frames = [self._scene.add_frame(f"{RESULT}/{name}", show_axes=False) for name in self._animation.names]
        for k, shape in enumerate(hand.shapes):
            _add_plain(self._scene, f"{RESULT}/{shape.link}/{k}", shape, shape.color)
        for k, shape in enumerate(item.shapes):
            _add_shape(self._scene, f"{RESULT}/{OBJECT}/{k}", shape, True)
        self.show(0.0)
        return True

    def show(self, time: float) -> None:
        """Show where everything is at a time, s."""
        if self._animation is None:
            return
        positions, orientations = self._animation.at(time)
        with self._atomic():
            for frame, position, wxyz in zip(self._frames, positions, orientations, strict=True):
                frame.position, frame.wxyz = position, wxyz


def _add_shape(scene: Any, name: str, shape: Shape, solid: bool) -> Any:
    """A shape of the object: in two tones, or as the ghost of a goal."""
    if not solid:
        return _add_plain(scene, name, shape.thinner, GOAL_COLOR, 0.25)
    import trimesh
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial

    mesh = two_toned(shape)
    opaque = np.ones((len(mesh.vertices), 1))
    # Without a material it would be of metal, which is black where there is nothing to mirror.
    material = PBRMaterial(metallicFactor=0.0, roughnessFactor=0.8)  # type: ignore[no-untyped-call]
    look = TextureVisuals(material=material)  # type: ignore[no-untyped-call]
    look.vertex_attributes["color"] = np.round(255 * np.hstack([mesh.color**_GAMMA, opaque])).astype(np.uint8)
    solid_mesh = trimesh.Trimesh(mesh.vertices, mesh.faces, vertex_normals=mesh.normals, visual=look, process=False)
    return scene.add_mesh_trimesh(name, solid_mesh, **_pose(shape.placement))


def _add_plain(scene: Any, name: str, shape: Shape, color: Color, opacity: float | None = None) -> Any:
    more = {"color": _rgb(color), "opacity": opacity, **_pose(shape.placement)}
    if shape.mesh is not None:
        return scene.add_mesh_simple(name, *shape.mesh, flat_shading=True, **more)
    if shape.sides is not None:
        return scene.add_box(name, dimensions=shape.sides, **more)
    if shape.length is None:
        return scene.add_icosphere(name, shape.radius, **more)
    return scene.add_cylinder(name, shape.radius, shape.length, **more)


def _add_floor(scene: Any, name: str, task: Task, size: float) -> Any:
    """A disc whose top is the ground, below the palm and the object."""
    middle = (np.array(task.palm.position[:2]) + task.goal_poses()[0][1][:2]) / 2
    thickness = 0.05 * size
    assert task.ground is not None
    where = (*middle, task.ground.height - thickness / 2)
    return scene.add_cylinder(name, 12 * size, thickness, _rgb(GROUND_COLOR), radial_segments=96, position=where)


def _pose(placement: np.ndarray) -> dict[str, np.ndarray]:
    return {"position": placement[:3, 3], "wxyz": quaternion(placement[:3, :3])}


def _rgb(color: Color) -> tuple[int, int, int]:
    red, green, blue = (round(255 * part) for part in color)
    return red, green, blue
