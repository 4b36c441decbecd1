"""Where the palm stands that a task leaves to the program: tried all around the object, by geometry alone."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from casadi_hands.motion import nearest_exponential
from casadi_hands.task.fields import vector
from casadi_hands.task.obstacles import depth_in_palm, palm_depth_below
from casadi_hands.task.palm import Palm
from casadi_hands.task.palm_reach import BEHIND, Touched, cost_of, keyframe_poses, off_side_and_distance, touched
from casadi_hands.task.problem import Problem
from casadi_hands.task.task import Task

Array = NDArray[np.float64]
ROOM = 0.75  # palm radii between palm and object, in which fingers begin
RINGS, AROUND = (0.0, 0.75, 1.5), 8  # palm radii off the middle of all contacts, and places on each ring
HEIGHTS = np.arange(1.0, 4.01, 0.25)  # palm radii, of the middle of all contacts above the palm's face
_ALIKE = 6  # decimals, beyond which costs do not differ: what is symmetric is chosen alike on any machine
_ALONG = np.linspace(0.0, 0.9, 10)[:, None]  # of the straight way from the palm's rim to a fingertip


@dataclass(frozen=True)
class Places:
    """Poses of the palm, best first.

    Attributes:
        positions: (P, 3) m, world.
        facings: (P, 3) where fingers point, whole numbers or as given.
        costs: (P,) weights.
    """

    positions: Array
    facings: Array
    costs: Array


def stand(task: Task, faces: bool, reach: float = math.inf) -> Palm | Problem:
    """The palm where fingers reach best over all goals; what is wrong where there is no place for it.

    Places all around the object are taken in the order of their costs (`palm_reach.cost_of`), and the first is chosen
    that is clear: by a link's width of ground and boxes, by ``ROOM`` of the object; with straight ways for fingers
    that boxes and ground leave free, if there is any such place.

    Args:
        task: whose palm stands nowhere yet.
        faces: whether it faces as the task has it, else anywhere.
        reach: of a finger from the palm's rim, m.
    """
    at = keyframe_poses(task)
    contacts = touched(task)
    found = places(task, faces, contacts, at)
    blocked: Palm | None = None
    for position, facing, cost in zip(found.positions, found.facings, found.costs, strict=True):
        palm = task.palm.model_copy(
            update={"position": vector(position), "facing": vector(facing), "auto": False, "placed": True}
        )
        if cost >= BEHIND or not _is_clear(task, palm, contacts, at, reach):
            continue
        if _ways_are_free(task, palm, contacts, at):
            return palm
        blocked = blocked or palm
    if blocked is not None:
        return blocked
    allowed = (
        f"a palm for which there is room: each of {len(found.costs)} places around the object is in the ground or in a "
        "box of keep_out, too near the object, or out of the fingers' reach; a smaller palm.radius, fewer boxes or "
        "longer fingers may do"
    )
    return Problem(("palm",), "auto", allowed)


def directions() -> Array:
    """(98, 3) whole numbers: directions to the points of a cube's surface, from downward to upward."""
    found = [v for v in itertools.product((-2, -1, 0, 1, 2), repeat=3) if max(map(abs, v)) == 2]
    plain = [tuple(x // 2 for x in v) if all(x % 2 == 0 for x in v) else v for v in found]
    return np.array(sorted(plain, key=lambda v: (v[2] / math.hypot(*v), *(-abs(x) for x in v), *v)), float)


def places(task: Task, faces: bool, contacts: Touched, at: tuple[Array, Array]) -> Places:
    """All places that are tried, best first.

    Args:
        task: whose palm stands nowhere yet.
        faces: whether it faces as the task has it, else anywhere.
        contacts: of its fingers.
        at: rotations (K, 3, 3) and positions (K, 3), m, of the object.
    """
    palm, radius = task.palm, task.palm.radius
    step = 10.0 ** (math.floor(math.log10(radius)) - 2)
    tips = contacts.tips(at, task.fingertip.radius)
    middle = tips.reshape(-1, 3).mean(axis=0)
    angles = 2 * np.pi * np.arange(AROUND) / AROUND
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    off = np.vstack([np.zeros((1, 2)), *[r * ring for r in RINGS[1:]]])
    local = np.array([[*across, -height] for across in off for height in HEIGHTS]) * radius
    positions, facings, costs = [], [], []
    for facing in np.array([palm.facing]) if faces else directions():
        if palm.up and np.linalg.norm(np.cross(facing, palm.up)) < 1e-6 * np.linalg.norm(palm.up):
            continue
        rotation = palm.model_copy(update={"facing": vector(facing)}).rotation
        tried = np.round(np.round((middle + local @ rotation.T) / step) * step, 12) + 0.0  # no -0
        positions.append(tried)
        facings.append(np.tile(facing, (len(tried), 1)))
        costs.append(cost_of(task, contacts, at, tried, rotation) + _off_middle(local, radius))
    cost = np.asarray(np.round(np.concatenate(costs), _ALIKE), float)
    order = np.argsort(cost, kind="stable")
    return Places(np.concatenate(positions)[order], np.concatenate(facings)[order], cost[order])


def _off_middle(local: Array, radius: float) -> Array:
    """What it costs to stand beside the middle of all contacts, so that fingers on one side go far."""
    return np.asarray(0.1 * (local[:, :2] ** 2).sum(axis=1) / radius**2)


def _is_clear(task: Task, palm: Palm, contacts: Touched, at: tuple[Array, Array], reach: float) -> bool:
    """Whether the palm is clear of all that it must be, and contacts are within a finger's reach."""
    position, rotation = np.array(palm.position), palm.rotation
    width = 2 * task.hand.link_radius
    if task.ground and palm_depth_below(palm, position, rotation, task.ground.height) > -width:
        return False
    if any(box.distance_from_palm(position, rotation, palm.radius, palm.thickness) < width for box in task.keep_out):
        return False
    if np.isfinite(reach):
        tips = (contacts.tips(at, task.fingertip.radius) - position) @ rotation
        from_rim = np.asarray(np.hypot(np.linalg.norm(tips[..., :2], axis=-1) - palm.radius, tips[..., 2]))
        if contacts.of_groups(np.asarray(from_rim.max(axis=0), float)).max() > reach:
            return False
    poses = ((place, nearest_exponential(turn, np.zeros(3))) for turn, place in zip(*at, strict=True))
    return all(depth_in_palm(task.object, *pose, palm) <= -ROOM * palm.radius for pose in poses)


def _ways_are_free(task: Task, palm: Palm, contacts: Touched, at: tuple[Array, Array]) -> bool:
    """Whether straight ways from the palm's rim to fingertips are free of boxes and ground; of a region's, to half."""
    radius, position, rotation = task.hand.link_radius, np.array(palm.position), palm.rotation
    tips = contacts.tips(at, task.fingertip.radius)
    local = (tips - position) @ rotation
    across = np.linalg.norm(local[..., :2], axis=-1, keepdims=True)
    rim = np.concatenate([palm.radius * local[..., :2] / np.maximum(across, 1e-9), 0 * across], axis=-1)
    rim = rim @ rotation.T + position
    ways = rim[..., None, :] + _ALONG * (tips - rim)[..., None, :]
    free = np.ones(ways.shape[:-1], bool)
    if task.ground:
        free &= ways[..., 2] >= task.ground.height + radius
    for box in task.keep_out:
        free &= box.distance(ways) >= radius
    blocked = np.asarray(~free.all(axis=(0, 2)), float)
    return bool(contacts.of_groups(blocked).max() == 0)


@dataclass(frozen=True)
class Standing:
    """What is to be said of where a palm stands.

    Attributes:
        off_side: degrees from side-on to it that contacts are, the root of the mean square over goals and fingers.
        distance: m, of fingertips from its disc, the mean over goals and fingers.
        object_gap: m, between it and the object at the keyframe where that is nearest.
        ground_gap: m, between it and the ground; None where there is none.
        keep_out_gaps: m, between it and each box that it keeps off, by name or ``keep_out[number]``.
    """

    off_side: float
    distance: float
    object_gap: float
    ground_gap: float | None
    keep_out_gaps: dict[str, float]

    def __str__(self) -> str:
        """In words."""
        gaps = [f"the object comes within {1e3 * self.object_gap:.3g} mm of it"]
        gaps += [] if self.ground_gap is None else [f"the ground is {1e3 * self.ground_gap:.3g} mm away"]
        gaps += [f"{name} {1e3 * gap:.3g} mm" for name, gap in self.keep_out_gaps.items()]
        return (
            f"contacts are {self.off_side:.0f}° from side-on and {1e3 * self.distance:.3g} mm from it on average over "
            f"the goals, {', '.join(gaps)}"
        )


def standing(task: Task) -> Standing:
    """What is to be said of where a task's palm stands at the start."""
    palm, at, contacts = task.palm, keyframe_poses(task), touched(task)
    position, rotation = np.array(palm.position), palm.rotation
    off_side, distance = off_side_and_distance(task, contacts, at, position[None], rotation)
    of_fingers = [
        np.average(contacts.of_groups(np.asarray(each, float)), weights=contacts.weights)
        for each in ((off_side**2).mean(axis=0), distance[0].mean(axis=0))
    ]
    poses = ((place, nearest_exponential(turn, np.zeros(3))) for turn, place in zip(*at, strict=True))
    disc = position, rotation, palm.radius, palm.thickness
    ground = None if task.ground is None else -palm_depth_below(palm, position, rotation, task.ground.height)
    return Standing(
        math.degrees(math.sqrt(of_fingers[0])),
        float(of_fingers[1]) * palm.radius,
        min(-depth_in_palm(task.object, *pose, palm) for pose in poses),
        ground,
        {each.name or f"keep_out[{k}]": each.distance_from_palm(*disc) for k, each in enumerate(task.keep_out)},
    )
