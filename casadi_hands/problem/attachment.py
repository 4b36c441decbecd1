"""An object that a joint holds to the world: its one coordinate, and what moves it along."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Array = NDArray[np.float64]
MOVING = 0.01
"""rad/s, of a slider lengths/s: speed at which 0.7 of the dry friction acts against it."""


@dataclass(frozen=True)
class Attachment:
    """The joint of an attached object; nondimensional, see ``Model``.

    The coordinate is 0 at the first goal: an angle in rad, of a slider a distance. Forces along it are torques
    (m·g·length), of a slider forces (m·g). The axis moves neither in the world nor in the object.

    Attributes:
        axis: (3,) unit, object frame.
        point: (3,) of the axis, object frame.
        turning: whether the object turns with the coordinate.
        advance: how far it goes along the axis as the coordinate grows; 1 of a slider.
        start: (3,) position of the object where the coordinate is 0, world; its orientation there is the reference.
        reference: (4,) quaternion of that.
        goals: (G,) the coordinate at the goals.
        mass: of the coordinate: m·length², of a slider m.
        friction: largest dry friction along the coordinate.
        stiffness: of a spring that rests at 0, over the coordinate.
        damping: over the coordinate's speed, s.
    """

    axis: Array
    point: Array
    turning: bool
    advance: float
    start: Array
    reference: Array
    goals: Array
    mass: float
    friction: float
    stiffness: float
    damping: float

    @property
    def twist(self) -> Array:
        """(6,) velocity of the centre of mass and angular velocity, object frame, at a coordinate's speed of 1."""
        along = self.advance * self.axis
        if not self.turning:
            return np.concatenate([along, np.zeros(3)])
        return np.concatenate([np.cross(self.point, self.axis) + along, self.axis])

    @property
    def world_axis(self) -> Array:
        """(3,) unit, world."""
        return np.asarray(pin.Quaternion(*self.reference).matrix() @ self.axis)

    @property
    def turn_axis(self) -> Array:
        """(3,) rotation vector from the reference for a coordinate of 1; 0 of a slider."""
        return self.world_axis if self.turning else np.zeros(3)

    @property
    def pivot(self) -> Array:
        """(3,) where the axis' point is at a coordinate of 0, world."""
        return np.asarray(self.start + pin.Quaternion(*self.reference).matrix() @ self.point)

    def poses(self, coordinates: Array) -> Array:
        """Poses (T, 6) at coordinates (T,): position and rotation vector from the reference, world."""
        found = []
        for q in coordinates:
            vector = q * self.turn_axis
            position = self.pivot + pin.exp3(vector) @ (self.start - self.pivot) + self.advance * q * self.world_axis
            found.append(np.concatenate([position, vector]))
        return np.array(found)

    def coordinates(self, position: Array, vector: Array) -> Array:
        """Coordinates (T,) of poses on the joint, or near it: positions and rotation vectors (T, 3)."""
        return np.asarray(vector @ self.world_axis if self.turning else (position - self.start) @ self.world_axis)

    def rates(self, coordinates: Array, speeds: Array) -> Array:
        """(T, 6) velocity of the centre of mass, world, and angular velocity, object frame."""
        reference = pin.Quaternion(*self.reference).matrix()
        velocity = [pin.exp3(q * self.turn_axis) @ reference @ self.twist[:3] for q in coordinates]
        return np.hstack([np.array(velocity) * speeds[:, None], np.outer(speeds, self.twist[3:])])

    def towards(self, homotopy: float) -> Attachment:
        """The same with goals that part of the way to where they are."""
        return replace(self, goals=self.goals[0] + homotopy * (self.goals - self.goals[0]))

    def resistance(self, coordinates: Array, speeds: Array) -> Array:
        """(T,) of the spring and the damper, without friction."""
        return -self.stiffness * coordinates - self.damping * speeds


def dry_friction(attachment: Attachment, speeds: Array, moving: float) -> Array:
    """(T,) dry friction against speeds (T,), full where they are well above ``moving``."""
    return -attachment.friction * speeds / np.sqrt(speeds**2 + moving**2)


def directions(attachment: Attachment, goal_times: Array, times: Array) -> Array:
    """Which way (T,) an attached object goes at times (T,): 1, -1, or 0 where it rests or turns back.

    Args:
        attachment: with the goals.
        goal_times: (G,) s.
        times: s.
    """
    ways = np.concatenate([[0.0], np.sign(np.round(np.diff(attachment.goals), 12)), [0.0]])
    before, after = (np.searchsorted(goal_times, times - 1e-9), np.searchsorted(goal_times, times + 1e-9))
    return np.asarray(np.where(ways[before] == ways[after], ways[before], 0.0))
