"""An exported URDF as Pinocchio reads it back: its links, their shapes, and where they are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from casadi_hands.export.meshes import mesh_path, polytopes, raw_meshes
from casadi_hands.export.urdf import object_urdf

if TYPE_CHECKING:
    from casadi_hands.task import Task

_THINNER = 0.985  # share of its size that a goal's ghost is drawn with


@dataclass(frozen=True)
class Shape:
    """One visual primitive of a link.

    Attributes:
        link: the link that carries it.
        placement: (4, 4) pose in the link's frame.
        radius: m; of a box that of the ball about it.
        length: of a cylinder, m, along its z axis; None for a sphere.
        color: RGB in 0..1, as exported.
        sides: (3,) of a box, m; None for others.
        mesh: vertices (V, 3), m, and triangles (T, 3) of them of what is convex; None for others.
    """

    link: str
    placement: np.ndarray
    radius: float
    length: float | None
    color: tuple[float, float, float]
    sides: tuple[float, float, float] | None = None
    mesh: tuple[np.ndarray, np.ndarray] | None = None

    @property
    def thinner(self) -> Shape:
        """The same about its middle, a little thinner (a cylinder as long): a ghost that the shape in it hides."""
        sides = self.sides and (_THINNER * self.sides[0], _THINNER * self.sides[1], _THINNER * self.sides[2])
        mesh = None if self.mesh is None else (_THINNER * self.mesh[0], self.mesh[1])
        return replace(self, radius=_THINNER * self.radius, sides=sides, mesh=mesh)

    @property
    def kind(self) -> str:
        """What it is, in a word or two."""
        if self.mesh is not None:
            return "convex part"
        if self.sides is not None:
            return "box"
        return "sphere" if self.length is None else "cylinder"

    @property
    def reach(self) -> float:
        """Radius of the sphere about the shape's centre that holds it, m."""
        return float(np.hypot(self.radius, (self.length or 0.0) / 2))


class Robot:
    """A URDF text, parsed.

    Args:
        urdf: the text as exported.
        meshes: what the files that it names hold, by their names in it: vertices (V, 3), m, and triangles (T, 3).

    Attributes:
        parents: each link's parent link, parents first; the root's is None.
        axes: (3,) of the joint that moves each link, unit length, in the link's frame; of those that are moved.
        shapes: the visual primitives of all links.
    """

    def __init__(self, urdf: str, meshes: Mapping[str, tuple[np.ndarray, np.ndarray]] | None = None) -> None:
        """Parse the text."""
        urdf, drawn = _without_meshes(urdf, meshes or {})
        self._model = pin.buildModelFromXML(urdf)
        self._data = self._model.createData()
        self._frames = [(k, frame) for k, frame in enumerate(self._model.frames) if frame.type == pin.FrameType.BODY]
        self.parents = {frame.name: self._parent(frame) for _, frame in self._frames}
        self.axes = dict(_axes(urdf))
        visuals = pin.buildGeomFromUrdfString(self._model, urdf, pin.GeometryType.VISUAL)
        self.shapes = (*(self._shape(item) for item in visuals.geometryObjects), *drawn)

    def link_poses(self, angles: Mapping[str, float]) -> dict[str, np.ndarray]:
        """Pose (4, 4) of every link in the root link's frame.

        Args:
            angles: joint name -> rad; joints not named stay at zero.
        """
        configuration = pin.neutral(self._model)
        for name, angle in angles.items():
            configuration[self._model.joints[self._model.getJointId(name)].idx_q] = angle
        pin.framesForwardKinematics(self._model, self._data, configuration)
        return {frame.name: np.array(self._data.oMf[k].homogeneous) for k, frame in self._frames}

    def _parent(self, frame: Any) -> str | None:
        """The nearest body frame above a frame, by name."""
        while frame.parentFrame != 0:
            frame = self._model.frames[frame.parentFrame]
            if frame.type == pin.FrameType.BODY:
                return str(frame.name)
        return None

    def _shape(self, item: Any) -> Shape:
        """A visual of the model, which Pinocchio places relative to the joint."""
        frame = self._model.frames[item.parentFrame]
        placement = np.array((frame.placement.inverse() * item.placement).homogeneous)
        red, green, blue = (float(part) for part in item.meshColor[:3])
        half_sides = getattr(item.geometry, "halfSide", None)
        if half_sides is not None:
            x, y, z = (2 * float(side) for side in half_sides)
            ball = float(np.linalg.norm(half_sides))
            return Shape(str(frame.name), placement, ball, None, (red, green, blue), (x, y, z))
        half_length = getattr(item.geometry, "halfLength", None)
        length = None if half_length is None else 2 * float(half_length)
        return Shape(str(frame.name), placement, float(item.geometry.radius), length, (red, green, blue))


def object_robot(task: Task) -> Robot:
    """The object as it is exported."""
    meshes = {mesh_path(name): (solid.vertices, solid.triangles) for name, solid in polytopes(task).items()}
    return Robot(object_urdf(task), {**meshes, **raw_meshes(task)})


def _axes(urdf: str) -> Iterator[tuple[str, np.ndarray]]:
    """Links that joints move, and the joints' axes (3,); URDF gives them in the frame of the link moved."""
    for joint in ElementTree.fromstring(urdf).iter("joint"):
        child, axis = joint.find("child"), joint.find("axis")
        if child is not None and axis is not None and joint.get("type") != "fixed":
            direction = np.array([float(part) for part in axis.get("xyz", "").split()])
            yield child.get("link", ""), direction / np.linalg.norm(direction)


def _without_meshes(urdf: str, meshes: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> tuple[str, list[Shape]]:
    """A text without the visuals that name files, which Pinocchio would look for, and what they draw."""
    root, drawn = ElementTree.fromstring(urdf), []
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            mesh, color = visual.find("geometry/mesh"), visual.find("material/color")
            if mesh is None or color is None:
                continue
            link.remove(visual)
            vertices, triangles = meshes[mesh.get("filename", "")]
            middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
            placement = np.eye(4)
            placement[:3, 3] = middle
            red, green, blue = (float(part) for part in color.get("rgba", "").split()[:3])
            reach = float(np.linalg.norm(vertices - middle, axis=1).max())
            shape = Shape(link.get("name", ""), placement, reach, None, (red, green, blue))
            drawn.append(replace(shape, mesh=(vertices - middle, triangles)))
    return (ElementTree.tostring(root, encoding="unicode"), drawn) if drawn else (urdf, [])
