"""How well fingers reach their contacts over all goals from where a palm stands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from casadi_hands.motion import Schedule, linear
from casadi_hands.task.object import ManipulatedObject
from casadi_hands.task.region import Region
from casadi_hands.task.rotation import rotation_matrix
from casadi_hands.task.task import Task

Array = NDArray[np.float64]
SIDE_ON = np.radians(48.0)  # from side-on to the palm, which costs one
USUAL = 2.0  # palm radii from palm to fingertips; the tasks of problems/ have 1.5 to 2.6
FAR = 0.3  # what a palm radius more or less costs
CROWDED = 0.5  # what two fingertips cost of which one is behind the other
ROOM = 2.6  # radii of a fingertip between the centres of two, seen from the palm
BELOW = 0.1  # what a palm costs that faces straight up
BEHIND = 10.0  # what a fingertip costs that is behind the palm's face
_MOST_POSES = 16
_POINTS = 48  # of the surface, where contacts are yet to be placed


@dataclass(frozen=True)
class Touched:
    """Where fingers touch or may touch, object frame.

    Attributes:
        points: (N, 3) m.
        normals: (N, 3), unit, outward.
        groups: (N,) of which finger or, for fingers that ask for the same region, fingers each is.
        weights: (G,) number of fingers of each group.
    """

    points: Array
    normals: Array
    groups: NDArray[np.int64]
    weights: Array

    def tips(self, at: tuple[Array, Array], radius: float) -> Array:
        """Centres (K, N, 3) of fingertips of a radius there, m, world, with the object at ``at``."""
        turns, positions = at
        return np.asarray((self.points + radius * self.normals) @ turns.transpose(0, 2, 1) + positions[:, None])

    def of_groups(self, values: Array) -> Array:
        """The mean (..., G) over the better half, which is less, of each group's values (..., N)."""
        found = []
        for group in range(len(self.weights)):
            own = np.sort(values[..., self.groups == group], axis=-1)
            found.append(own[..., : (own.shape[-1] + 1) // 2].mean(axis=-1))
        return np.stack(found, axis=-1)


def keyframe_poses(task: Task) -> tuple[Array, Array]:
    """Rotations (K, 3, 3) and positions (K, 3), m, of the object at keyframes, straight from goal to goal.

    Of a palm that the program may move, which then follows the object, only the start counts.
    """
    times, positions, vectors = zip(*task.goal_poses(), strict=True)
    schedule = Schedule.of(times, task.duration, task.keyframes_between, task.time_step)
    ways = linear(schedule.keyframes[list(schedule.goals)], schedule.keyframes)
    if task.palm.may_move:
        ways = ways[:1]
    elif len(ways) > _MOST_POSES:
        ways = ways[np.unique(np.linspace(0, len(ways) - 1, _MOST_POSES).round().astype(int))]
    first = rotation_matrix(vectors[0])
    turns = np.array([rotation_matrix(turn) @ first for turn in ways @ task.goal_turns()])
    return turns, np.asarray(ways @ np.array(positions))


def touched(task: Task) -> Touched:
    """Contacts that are given, and points of the regions in which the program is to place others."""
    points, normals, groups = [], [], []
    weights: list[float] = []
    regions: dict[str, int] = {}
    for finger in task.fingers.values():
        if finger.is_placed:
            body = min(
                (s.body for s in task.object.shapes), key=lambda b: abs(b.signed_distance(np.array(finger.point)))
            )
            own = np.array([finger.point]), body.outward(np.array(finger.point))[None]
        elif str(finger.touches) in regions:
            weights[regions[str(finger.touches)]] += 1.0
            continue
        else:
            regions[str(finger.touches)] = len(weights)
            own = _points_in(task.object, finger.touches)
        points.append(own[0])
        normals.append(own[1])
        groups.append(np.full(len(own[0]), len(weights)))
        weights.append(1.0)
    return Touched(np.vstack(points), np.vstack(normals), np.concatenate(groups), np.array(weights))


def cost_of(task: Task, contacts: Touched, at: tuple[Array, Array], positions: Array, rotation: Array) -> Array:
    """What reaching the contacts costs (P,) from palms at positions (P, 3), m, with a rotation (3, 3) world <- palm.

    A contact costs one that is 48° off side-on to the palm all the time, and 0.3 at a palm radius more or less than two
    from it, both squared; fingertips that hide each other from the palm cost more, and so does a palm from below.
    """
    tip = task.fingertip.radius
    tips = contacts.tips(at, tip)
    off_side, distance = off_side_and_distance(task, contacts, at, positions, rotation)
    each = ((off_side / SIDE_ON) ** 2).mean(axis=0) + FAR * ((distance - USUAL) ** 2).mean(axis=1)
    heights = (tips[None] - positions[:, None, None]) @ rotation[:, 2]
    each += np.where(heights.min(axis=1) < tip, BEHIND, 0.0)
    cost = np.average(contacts.of_groups(each), axis=-1, weights=contacts.weights)
    single = [k for k, group in enumerate(contacts.groups) if (contacts.groups == group).sum() == 1]
    flat = (tips[:, single] @ rotation)[..., :2]
    apart = np.linalg.norm(flat[:, :, None] - flat[:, None], axis=-1).mean(axis=0)[np.triu_indices(len(single), 1)]
    crowded = CROWDED * np.maximum(1 - apart / (ROOM * tip), 0).sum() / max(len(single), 1)
    return np.asarray(cost + crowded + BELOW * (1 + rotation[2, 2]) / 2)


def off_side_and_distance(
    task: Task, contacts: Touched, at: tuple[Array, Array], positions: Array, rotation: Array
) -> tuple[Array, Array]:
    """How far contacts (K, N) are from side-on to the palm, rad, and fingertips (P, K, N) from its disc, palm radii."""
    tips = contacts.tips(at, task.fingertip.radius)
    normals = contacts.normals @ at[0].transpose(0, 2, 1)
    off_side = np.arcsin(np.clip(np.abs(normals @ rotation[:, 2]), 0, 1))
    local = (tips[None] - positions[:, None, None]) @ rotation
    beyond = np.maximum(np.linalg.norm(local[..., :2], axis=-1) - task.palm.radius, 0)
    return off_side, np.hypot(beyond, local[..., 2]) / task.palm.radius


def _points_in(body: ManipulatedObject, region: Region) -> tuple[Array, Array]:
    """Points (N, 3) of the surface in a region, and normals; what is nearest to its middle where it is small."""
    shapes = [s for s in body.shapes if (not region.on or s.name in region.on) and s.name not in region.not_on]
    points, normals = [], []
    ways = _spread(max(8, _POINTS // max(len(shapes), 1)))
    for shape in shapes:
        lower, upper = shape.bounding_box
        others = [other.body for other in body.shapes if other is not shape]
        for start in (lower + upper) / 2 + 0.6 * (upper - lower) * ways:
            on = shape.body.on_surface(start)
            if all(other.signed_distance(on) > 0 for other in others):
                points.append(on)
                normals.append(shape.body.outward(start))
    if region.near is not None and region.within is not None:
        near = np.array(region.near)
        kept = [k for k, point in enumerate(points) if np.linalg.norm(point - near) <= region.within]
        points, normals = [points[k] for k in kept], [normals[k] for k in kept]
        if not points:
            closest = min((s.body for s in shapes or body.shapes), key=lambda b: abs(b.signed_distance(near)))
            points, normals = [closest.on_surface(near)], [closest.outward(near)]
    if not points:
        return _points_in(body, Region())
    return np.array(points), np.array(normals)


def _spread(count: int) -> Array:
    """(count, 3) unit vectors spread over a sphere."""
    height, turn = 1 - 2 * (np.arange(count) + 0.5) / count, np.arange(count) * np.pi * (3 - np.sqrt(5))
    across = np.sqrt(1 - height**2)
    return np.column_stack([across * np.cos(turn), across * np.sin(turn), height])
