"""What the palm and the ground are to points of the object while it goes its straight way from goal to goal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.motion import linear
from casadi_hands.placement.surface import Spots
from casadi_hands.problem.model import Model, palm_from_world

Array = NDArray[np.float64]
SIDE_ON = np.radians(48.0)  # from side-on to the palm, which costs as much as a weight more of normal force
FAR, TRAVEL = 0.3, 0.3  # weights of normal force that a palm radius of distance or of travel costs
FARTHEST = np.radians(65.0)  # the root of the mean square over the motion, beyond which no contact is placed


@dataclass(frozen=True)
class Pose:
    """The object at a keyframe: rotation (3, 3) and position (3,), world, lengths, at a time, s."""

    time: float
    turn: Array
    place: Array


def poses(model: Model) -> list[Pose]:
    """The object at the keyframes, straight from goal to goal; a drawing's object stands upright."""
    schedule = model.schedule
    ways = linear(schedule.keyframes[list(schedule.goals)], schedule.keyframes)
    reference, found = pin.Quaternion(*model.reference).matrix(), []
    for time, way in zip(schedule.keyframes, ways, strict=True):
        turn = pin.exp3(way @ model.goal_vectors) @ reference
        place = way @ model.goal_positions - (0.0 if model.tool is None else turn @ model.tool)
        found.append(Pose(float(time), turn, place))
    return found


@dataclass(frozen=True)
class Seen:
    """What is to be said of each of N points.

    Attributes:
        off_side: (N,) rad, how far its normal is from side-on to the palm, at worst.
        usual: (N,) the mean over the keyframes of that, squared, as a share of ``SIDE_ON`` squared.
        above_ground: (N,) lengths, least height of a fingertip there above the ground; inf where there is none.
        before_palm: (N,) lengths, least height of a fingertip there above the palm's face.
        far: (N,) mean distance of a fingertip there from the palm's disc, by the palm's radius.
        travel: (N,) largest distance between a fingertip's places, palm frame, by the palm's radius.
    """

    off_side: Array
    usual: Array
    above_ground: Array
    before_palm: Array
    far: Array
    travel: Array

    @property
    def sideways(self) -> NDArray[np.bool_]:
        """(N,) whether fingers come to the point from a side most of the time."""
        return np.asarray(self.usual <= (FARTHEST / SIDE_ON) ** 2)

    @property
    def cost(self) -> Array:
        """(N,) what a contact there costs a finger, in weights of normal force."""
        return np.asarray(self.usual + FAR * self.far + TRAVEL * self.travel)


def seen(model: Model, on: Spots, palm_moves: bool) -> Seen:
    """Look at points of the object from palm and ground.

    Args:
        model: the task.
        on: the points.
        palm_moves: whether the program may move the palm, which then follows the object; what counts is the start.
    """
    radius = model.tip_radius
    angles, heights, places = [], [], []
    for pose in poses(model)[: 1 if palm_moves else None]:
        rotation, position = palm_from_world(model, pose.time)
        tips = (on.points + radius * on.normals) @ pose.turn.T + pose.place
        in_palm = (tips - position) @ rotation.T
        places.append(in_palm)
        angles.append(np.arcsin(np.clip(np.abs((on.normals @ pose.turn.T @ rotation.T)[:, 2]), 0, 1)))
    for pose in poses(model):
        tips = (on.points + radius * on.normals) @ pose.turn.T + pose.place
        heights.append(tips[:, 2] - radius - (-np.inf if model.ground is None else model.ground))
    at = np.array(places)
    beyond = np.maximum(np.linalg.norm(at[:, :, :2], axis=2) - model.palm_radius, 0)
    far = np.hypot(beyond, at[:, :, 2]).mean(axis=0)
    travel = np.linalg.norm(at[:, None] - at[None], axis=3).max(axis=(0, 1))
    return Seen(
        off_side=np.max(angles, axis=0),
        usual=np.mean(np.square(angles), axis=0) / SIDE_ON**2,
        above_ground=np.min(heights, axis=0),
        before_palm=at[:, :, 2].min(axis=0) - radius,
        far=far / model.palm_radius,
        travel=travel / model.palm_radius,
    )
