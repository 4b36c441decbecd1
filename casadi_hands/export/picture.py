"""A design's start as a still picture: SVG of few lines, for pages that have no room for the moving one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from casadi_hands.export.markup import GROUND_COLOR, Color
from casadi_hands.export.page.robot import Robot, Shape, object_robot
from casadi_hands.export.page.scene import eye_towards
from casadi_hands.export.page.timeline import design_timeline
from casadi_hands.export.page.unsolved import bare_palm
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.problem.result import Result

Array = NDArray[np.float64]
_AROUND = 32  # corners of a circle
_MARGIN = 0.04  # of the picture's width
_LIGHT = (0.75, 1.0)  # brightness of what is farthest and nearest


@dataclass(frozen=True)
class _Patch:
    """Something flat in the picture.

    Attributes:
        corners: (N, 2) m, right and up.
        depth: m towards the eye, of its middle.
        color: RGB in 0..1.
        radius: of a ball about the only corner, m; None of a polygon.
    """

    corners: Array
    depth: float
    color: Color
    radius: float | None = None


def picture(design: Result, width: int = 320) -> str:
    """SVG of palm, fingers, object and ground as they stand at the motion's start, seen as the page shows them.

    Parts are drawn one over the other, those nearest to the eye last; what goes through each other is not told apart.

    Args:
        design: whole or partial.
        width: of the picture, px; as high as wide.
    """
    task = design.task
    hand, item = Robot(hand_urdf(design.hand or bare_palm(design))), object_robot(task)
    timeline = design_timeline(design, hand)
    eye = _frame(eye_towards(task.palm.rotation[:, 2]))
    palm, body = timeline.palm[0], timeline.object[0]
    patches = [_patch(shape, palm @ timeline.links[shape.link][0], eye) for shape in hand.shapes]
    patches += [_patch(shape, body, eye) for shape in item.shapes]
    reach = np.vstack([_extent(each) for each in patches])
    low, high = reach.min(axis=0), reach.max(axis=0)
    scale = width * (1 - 2 * _MARGIN) / float((high - low).max())
    middle = (low + high) / 2
    if task.ground is not None:
        patches.append(_ground(task.ground.height, body, eye, float((high - low).max()) / 2))
    depths = [each.depth for each in patches if np.isfinite(each.depth)]
    near, far = max(depths), min(depths)
    drawn = [
        _drawn(_lit(each, (each.depth - far) / ((near - far) or 1.0)), middle, scale, width)
        for each in sorted(patches, key=lambda each: each.depth)
    ]
    frame = f'xmlns="http://www.w3.org/2000/svg" width="{width}" height="{width}" viewBox="0 0 {width} {width}"'
    return "\n".join([f'<svg {frame} role="img" aria-label="the hand and the object at the start">', *drawn, "</svg>"])


def _frame(towards_eye: Array) -> Array:
    """Rows right, up and towards the eye (3, 3), world."""
    right = np.cross([0.0, 0.0, 1.0], towards_eye)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(towards_eye, right), towards_eye])


def _patch(shape: Shape, pose: Array, eye: Array) -> _Patch:
    """A primitive as it is seen; of what is convex the outline."""
    placed = pose @ shape.placement
    if shape.sides is None and shape.mesh is None and shape.length is None:
        seen = (eye @ placed[:3, 3])[None]
        return _Patch(seen[:, :2], float(seen[0, 2] + shape.radius), shape.color, shape.radius)
    points = np.array(list(_corners(shape))) @ placed[:3, :3].T + placed[:3, 3]
    seen = points @ eye.T
    outline = seen[_outline(seen[:, :2]), :2]
    return _Patch(outline, float(seen[:, 2].mean() + shape.radius), shape.color)


def _corners(shape: Shape) -> Iterator[Array]:
    """Points (3,) whose hull is the primitive, in its own frame."""
    if shape.mesh is not None:
        yield from shape.mesh[0]
    elif shape.sides is not None:
        for signs in np.ndindex(2, 2, 2):
            yield (np.array(signs) - 0.5) * shape.sides
    else:
        for angle in np.linspace(0, 2 * np.pi, _AROUND, endpoint=False):
            for end in (-0.5, 0.5):
                x, y = shape.radius * np.cos(angle), shape.radius * np.sin(angle)
                yield np.array([x, y, end * (shape.length or 0.0)])


def _outline(points: Array) -> NDArray[np.int_]:
    """Numbers of the points (N, 2) that lie on their outline, in order."""
    return np.asarray(ConvexHull(points).vertices)


def _extent(patch: _Patch) -> Array:
    """Lower and upper corner (2, 2) of what a patch covers."""
    radius = patch.radius or 0.0
    return np.array([patch.corners.min(axis=0) - radius, patch.corners.max(axis=0) + radius])


def _ground(height: float, body: Array, eye: Array, size: float) -> _Patch:
    """A disc of the ground below the object, behind all else."""
    angles = np.linspace(0, 2 * np.pi, _AROUND, endpoint=False)
    rim = body[:2, 3] + size * np.column_stack([np.cos(angles), np.sin(angles)])
    seen = np.column_stack([rim, np.full(_AROUND, height)]) @ eye.T
    return _Patch(seen[:, :2], -np.inf, GROUND_COLOR)


def _lit(patch: _Patch, nearness: float) -> _Patch:
    """The patch, a little darker the farther it is from the eye."""
    bright = _LIGHT[0] + (_LIGHT[1] - _LIGHT[0]) * float(np.clip(nearness, 0.0, 1.0))
    red, green, blue = (bright * part for part in patch.color)
    return replace(patch, color=(red, green, blue))


def _drawn(patch: _Patch, middle: Array, scale: float, width: int) -> str:
    """A circle or a polygon of SVG."""
    places = (patch.corners - middle) * [scale, -scale] + width / 2
    fill = "#" + "".join(f"{round(255 * part):02x}" for part in patch.color)
    look = f'fill="{fill}" stroke="#0004" stroke-width="0.7"'
    if patch.radius is not None:
        return f'<circle cx="{places[0, 0]:.1f}" cy="{places[0, 1]:.1f}" r="{scale * patch.radius:.1f}" {look}/>'
    return f'<polygon points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in places)}" {look}/>'
