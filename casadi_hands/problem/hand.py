"""A designed hand in SI."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.geometry.bodies import Solid

if TYPE_CHECKING:
    from casadi_hands.problem.drive import Drive


@dataclass(frozen=True)
class Link:
    """One finger segment: a capsule along its frame's z axis, from ``(0, 0, hinge)`` to ``(0, 0, length)``.

    The joint turns in the round end of the body before; a finger's first one in a ball on the palm.

    Attributes:
        length: from its joint to the next one or the tip, m.
        radius: radius of the capsule, m.
        axis: (3,) unit vector of the joint at the segment's start, in the link's frame.
        bend: (2,) how the link's frame is turned from its parent's, the palm's for the first, at zero angle: rotation
            vector about the parent's x and y axes, rad.
        hinge: from its joint to where the capsule's axis begins, m; 0 where it shares a ball with the body before.
    """

    length: float
    radius: float
    axis: tuple[float, float, float]
    bend: tuple[float, float] = (0.0, 0.0)
    hinge: float = 0.0

    @property
    def turn(self) -> Rotation:
        """From its parent's frame to its own at zero angle."""
        return Rotation.from_rotvec([*self.bend, 0.0])

    @property
    def solid(self) -> Solid:
        """Its body in its own frame."""
        return Solid("capsule", np.array([0.0, 0.0, self.hinge]), np.array([0.0, 0.0, self.length]), self.radius)


@dataclass(frozen=True)
class Finger:
    """A serial finger on the palm.

    Attributes:
        name: the task's name of the finger and its contact.
        base: (3,) position of the first joint in the palm frame, m; on the palm's surface, z = 0.
        links: segments from the palm outwards.
    """

    name: str
    base: tuple[float, float, float]
    links: tuple[Link, ...]


@dataclass(frozen=True)
class Hand:
    """A palm disc and its fingers; the palm's frame has its origin on the surface and z where fingers point.

    Attributes:
        palm_radius: m.
        palm_thickness: m; the disc reaches from z = -thickness to z = 0.
        fingers: in the order of the task's fingers.
        joint_lower, joint_upper: limits of every joint, rad.
        effort: torque limit of every joint, N·m.
        velocity: speed limit of every joint, rad/s.
        density: of links and palm, kg/m³, from which masses and inertias follow.
        servo: in every joint, by its name in `task.servos`; None where motors are behind the palm.
        drive: of motors that share the joints; None where every joint has its own.
    """

    palm_radius: float
    palm_thickness: float
    fingers: tuple[Finger, ...]
    joint_lower: float
    joint_upper: float
    effort: float
    velocity: float
    density: float
    servo: str | None = None
    drive: Drive | None = None

    @property
    def motors(self) -> int:
        """Number of motors."""
        return self.drive.motors if self.drive else self.degrees_of_freedom

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in the order of the motion's angles."""
        return tuple(f"finger{i}_joint{j}" for i, finger in enumerate(self.fingers) for j in range(len(finger.links)))

    @property
    def palm_balls(self) -> tuple[Solid, ...]:
        """The balls on the palm, in its frame, in which first joints turn; none where links share theirs."""
        hinged = [(np.array(finger.base), finger.links[0].radius) for finger in self.fingers if finger.links[0].hinge]
        return tuple(Solid("sphere", base, base, radius) for base, radius in hinged)

    @property
    def degrees_of_freedom(self) -> int:
        """Number of joints in the hand."""
        return sum(len(finger.links) for finger in self.fingers)
