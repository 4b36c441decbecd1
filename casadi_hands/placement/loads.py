"""What contacts must bear: the weight on the way, disturbances, and the wrenches that contacts can make."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from casadi_hands.placement.seen import Pose, poses
from casadi_hands.placement.surface import farthest_first
from casadi_hands.problem.model import Model
from casadi_hands.statics.grasp import EDGES, friction_edges, grasp_map

Array = NDArray[np.float64]
PUSH, TWIST = 0.5, 0.25  # weights, as replays push, and weights × length, about each axis either way
MARGIN = 0.7  # of the friction
_ATTITUDES, _PUSHED = 8, 6  # poses whose weight, and own disturbances of the task, that count
_NEAR = 0.1  # lengths above the ground, within which it may still carry
_CARRIES = 1.0  # weights that the ground bears at most


@dataclass(frozen=True)
class Load:
    """A wrench that contacts must make, about the object's origin, object frame.

    Attributes:
        wrench: (6,) m·g and m·g·length.
        ground: (6, E) wrenches of the ground's contact that presses with all it bears; E is 0 where it is out of reach.
    """

    wrench: Array
    ground: Array


def disturbances(torques: bool = True) -> Array:
    """(D, 6) wrenches that come on top, which fingers meet by no more than the stiffness of their joints."""
    ways = np.diag([PUSH] * 3 + [TWIST] * 3)[: 6 if torques else 3]
    return np.vstack([ways, -ways])


def loads(model: Model) -> tuple[Load, ...]:
    """The weight where the object's attitude differs most, and the task's own disturbances that differ most."""
    held = poses(model)
    weights = np.array([np.append(-pose.turn.T @ model.gravity, np.zeros(3)) for pose in held])
    # A pose that the ground helps in is another load than the same high above it.
    near = np.array([_ground(model, pose).shape[1] > 0 for pose in held], float)
    chosen = farthest_first(np.column_stack([weights, near]), _ATTITUDES)
    return (*(Load(weights[k], _ground(model, held[k])) for k in chosen), *_own(model, held))


def _own(model: Model, held: list[Pose]) -> list[Load]:
    """Of the task's own disturbances those that differ most."""
    pushed, times = [], np.array([pose.time for pose in held])
    for scenario in model.scenarios[1:]:
        for k in np.flatnonzero((scenario.force != 0).any(axis=1) | (scenario.torque != 0).any(axis=1)):
            pose = held[int(np.abs(times - model.schedule.samples[k]).argmin())]
            force, torque = model.gravity + scenario.force[k], scenario.torque[k]
            needed = -np.concatenate([pose.turn.T @ force, pose.turn.T @ torque])
            pushed.append(Load(needed, _ground(model, pose)))
    if not pushed:
        return []
    return [pushed[k] for k in farthest_first(np.array([load.wrench for load in pushed]), _PUSHED)]


def _ground(model: Model, pose: Pose) -> Array:
    """Wrenches (6, E) of the ground's contact at a pose, pressing with all that it bears."""
    if model.ground is None:
        return np.zeros((6, 0))
    contact = model.contact_table[-1]
    if (pose.place + pose.turn @ contact.patch)[2] > model.ground + _NEAR:
        return np.zeros((6, 0))
    edges = friction_edges(pose.turn[2][None], np.array([MARGIN * contact.friction]))
    return np.asarray(_CARRIES * grasp_map(contact.patch[None]) @ edges)


@dataclass(frozen=True)
class Contacts:
    """Points that might be touched, in numbers that grips are made of.

    Attributes:
        frames: (N, 3, 3) rows: the normal into the object, and two directions across it.
        maps: (N, 4, 6) from a twist of the object to how a contact moves along its frame's rows, and turns about its
            normal; the transpose is from its force and its torsional moment to the wrench.
        edges: (N, 6, E) wrenches of contacts that press with 1: edges of the friction's cones with all of the torsion
            either way.
        friction: with its margin taken, of the octagon within the cone.
        torsion: radius of the torsional friction, with its margin taken.
    """

    frames: Array
    maps: Array
    edges: Array
    friction: float
    torsion: float

    @classmethod
    def of(cls, points: Array, normals: Array, friction: float, torsion: float) -> Contacts:
        """Contacts at points (N, 3) with outward normals (N, 3), of given friction and radius of torsional friction."""
        inward = -normals
        first = np.cross(inward, np.eye(3)[np.argmin(np.abs(inward), axis=1)])
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        frames = np.stack([inward, first, np.cross(inward, first)], axis=1)
        maps = np.zeros((len(points), 4, 6))
        maps[:, :3, :3], maps[:, :3, 3:] = frames, np.cross(points[:, None], frames)
        maps[:, 3, 3:] = inward
        mu, radius = MARGIN * friction, MARGIN * torsion
        angles = 2 * np.pi * np.arange(EDGES) / EDGES
        pressing = np.column_stack([np.ones(EDGES), mu * np.cos(angles), mu * np.sin(angles), np.full(EDGES, radius)])
        if radius:
            pressing = np.vstack([pressing, pressing * [1, 1, 1, -1]])
        return cls(frames, maps, maps.transpose(0, 2, 1) @ pressing.T, mu * np.cos(np.pi / EDGES), radius)
