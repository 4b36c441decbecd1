"""What is drawn over a design: forces, joint axes, paths of contacts; and what can be shown and hidden."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from meshcat.geometry import Cylinder, MeshBasicMaterial, TriangularMeshGeometry

from casadi_hands.export.markup import Color
from casadi_hands.export.page.names import node_name
from casadi_hands.export.page.shapes import UPRIGHT_CYLINDER, LayeredMesh, paint, shift
from casadi_hands.export.page.timeline import poses
from casadi_hands.export.page.tracks import Tracks, along
from casadi_hands.export.page.unsolved import steps

if TYPE_CHECKING:
    from casadi_hands.problem.motion import Motion

FORCE_COLOR: Color = (0.85, 0.12, 0.15)
EXTERNAL_COLOR: Color = (0.45, 0.20, 0.75)
AXIS_COLOR: Color = (0.98, 0.52, 0.05)

# Sizes on the page, where the whole scene fits in a ball of radius 1.
_LONGEST_ARROW = 0.45
_HEAD = 0.07
_SHAFT_RADIUS = 0.012
_AXIS = (0.24, 0.007)  # length and radius
_PATH_RADIUS = 0.006
_SIDES = 5  # of a path's tube
_FINEST = 2e-3  # of a path: corners nearer than this to the line between their neighbours are left out


@dataclass(frozen=True)
class Layer:
    """Things that a button shows and hides together.

    Attributes:
        name: on the button.
        on: whether they are shown at first.
        color: RGB in 0..1, if they have one.
        paths: of each in meshcat's tree, names from the root.
    """

    name: str
    on: bool
    color: Color | None
    paths: tuple[tuple[str, ...], ...]

    def as_data(self) -> dict[str, Any]:
        """What the page's script reads."""
        shades = None if self.color is None else f"rgb({', '.join(str(round(255 * part)) for part in self.color)})"
        return {"name": self.name, "on": self.on, "color": shades, "paths": [list(path) for path in self.paths]}


def draw_forces(node: Any, tracks: Tracks, motion: Motion, radius: float) -> float:
    """Draw contact and external forces, each arrow's point where the force acts; they ride on the object.

    Args:
        node: meshcat's visualizer below the object.
        tracks: of the animation.
        motion: of hand and object.
        radius: of the scene, m.

    Returns:
        The largest force, N, whose arrow is the longest; 0 if there are none.
    """
    forces = [
        (f"at {node_name(name)}", FORCE_COLOR, motion.contact_point_object[:, c], motion.contact_force[:, c])
        for c, name in enumerate(motion.contact_names)
    ]
    forces.append(("external", EXTERNAL_COLOR, np.zeros_like(motion.external_force), motion.external_force))
    largest = max(float(np.linalg.norm(force, axis=1).max()) for *_, force in forces)
    if largest == 0.0:
        return 0.0
    to_world = poses(motion.object_position, motion.object_orientation)[:, :3, :3]
    for name, color, tips, force in forces:
        if not force.any():
            continue
        _draw_arrow(node[name], color, radius)
        local = np.einsum("sji,sj->si", to_world, force) * (_LONGEST_ARROW * radius / largest)
        tracks.arrow(node[name], _HEAD * radius, tips, local, np.linalg.norm(force, axis=1) > 1e-6 * largest)
    return largest


def draw_axis(node: Any, axis: np.ndarray, radius: float) -> tuple[str, ...]:
    """Draw a joint's axis (3,) through its link's origin, and return where it is in the tree."""
    length, thickness = (part * radius for part in _AXIS)
    node.set_object(LayeredMesh(Cylinder(length, thickness), _over_all(AXIS_COLOR), 3))
    node.set_transform(along(axis) @ UPRIGHT_CYLINDER)
    return steps(node)


def draw_paths(node: Any, motion: Motion, colors: Sequence[Color], radius: float) -> None:
    """Draw where each contact goes in the world while there is contact, as a tube in its finger's colour."""
    world = poses(motion.object_position, motion.object_orientation)
    for c, name in enumerate(motion.contact_names):
        points = np.einsum("sij,sj->si", world[:, :3, :3], motion.contact_point_object[:, c]) + world[:, :3, 3]
        color = colors[c % len(colors)] if colors else FORCE_COLOR
        for k, run in enumerate(_runs(motion.contact_active[:, c])):
            corners = thinned(points[run], _FINEST * radius)
            if np.ptp(corners, axis=0).max() > _FINEST * radius:
                mesh = TriangularMeshGeometry(*tube(corners, _PATH_RADIUS * radius))
                node[node_name(name)][f"part {k + 1}"].set_object(LayeredMesh(mesh, _over_all(color), 3))


def thinned(points: np.ndarray, tolerance: float) -> np.ndarray:
    """Corners (M, 3) among points (N, 3), both ends kept, the line through which passes all within a tolerance.

    Source: Douglas and Peucker, Algorithms for the reduction of the number of points, 1973.
    """
    kept, todo = {0, len(points) - 1}, [(0, len(points) - 1)]
    while todo:
        first, last = todo.pop()
        way, offsets = points[last] - points[first], points[first : last + 1] - points[first]
        share = np.clip(offsets @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
        off = np.linalg.norm(offsets - share[:, None] * way, axis=1)
        if off.max() > tolerance:
            corner = first + int(off.argmax())
            kept.add(corner)
            todo += [(first, corner), (corner, last)]
    return points[sorted(kept)]


def tube(points: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and triangles (T, 3) of a tube about the line through points (N, 3), N > 1."""
    angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
    ring = radius * np.stack([np.cos(angle), np.sin(angle), np.zeros(_SIDES)], axis=1)
    turned, upright = [], np.eye(3)
    for way in np.gradient(points, axis=0):
        # Each ring is turned from the one before as little as the way is, so that the tube is not wrung.
        upright = upright @ along(upright.T @ way)[:3, :3]
        turned.append(ring @ upright.T)
    vertices = (points[:, None] + np.array(turned)).reshape(-1, 3)
    one = (_SIDES * np.arange(len(points) - 1)[:, None] + np.arange(_SIDES)).ravel()
    next_one = one - one % _SIDES + (one + 1) % _SIDES
    sides = [np.stack([one, next_one, next_one + _SIDES], 1), np.stack([one, next_one + _SIDES, one + _SIDES], 1)]
    return vertices, np.vstack(sides)


def _runs(active: np.ndarray) -> list[slice]:
    """Where (S,) bool is true without a break."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], active, [False]]).astype(int)))
    return [slice(start, stop) for start, stop in edges.reshape(-1, 2)]


def _over_all(color: Color) -> MeshBasicMaterial:
    """Paint that shines through whatever is in front of it."""
    return MeshBasicMaterial(color=paint(color), opacity=0.85, transparent=True, depthTest=False, depthWrite=False)


def _draw_arrow(node: Any, color: Color, radius: float) -> None:
    """Draw an arrow along z with its point at the origin; its shaft is of unit length, to be scaled.

    It shines through whatever is in front of it: most of it lies inside a fingertip.
    """
    head, shaft = _HEAD * radius, _SHAFT_RADIUS * radius
    cone = Cylinder(head, radiusTop=0.0, radiusBottom=2.5 * shaft)
    node["head"]["cone"].set_object(LayeredMesh(cone, _over_all(color), 3))
    node["head"]["cone"].set_transform(shift(np.array([0.0, 0.0, -head / 2])) @ UPRIGHT_CYLINDER)
    node["shaft"]["rod"].set_object(LayeredMesh(Cylinder(1.0, shaft), _over_all(color), 3))
    node["shaft"]["rod"].set_transform(shift(np.array([0.0, 0.0, -0.5])) @ UPRIGHT_CYLINDER)
