"""The task in the numbers the stages work in: lengths by the characteristic length, forces by m·g, seconds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.geometry.bodies import Body
from casadi_hands.kinematics import link_radii
from casadi_hands.motion import Schedule, zero_order_hold
from casadi_hands.problem.attachment import Attachment
from casadi_hands.problem.contacts import Contact
from casadi_hands.problem.exerted import Exerted
from casadi_hands.problem.palm_path import PalmPath
from casadi_hands.problem.regrasp import Regrasp
from casadi_hands.problem.scenario import Scenario
from casadi_hands.problem.strength import Strength
from casadi_hands.problem.units import Units
from casadi_hands.terms.own import OwnTerm

Array = NDArray[np.float64]
_NO_GROUND = -1e3  # lengths


@dataclass(frozen=True)
class Model:
    """Everything the stages need of a task, nondimensional; arrays are read only by agreement.

    Attributes:
        units: of all numbers here.
        schedule: keyframes and samples, s.
        gravity: (3,) weight in m·g.
        inertia: (3, 3) object frame, in m·length².
        bodies: whose union the object is, object frame.
        contact_table: of all contacts, the C fingers' first, then the ground's, if there is one.
        ground: its height, or None.
        palm_radius: of the disc.
        palm_position: (S, 3) world, at the samples.
        palm_quaternion: (S, 4) world from palm, [w, x, y, z].
        palm_path: where they come from.
        goal_positions: (G, 3) world; for a drawing the tool's targets.
        goal_vectors: (G, 3) rotation vectors from the reference orientation, world; zeros for a drawing.
        goal_tolerance: lengths and rad, what each coordinate may miss a goal by within the task's limits.
        gap_tolerance: lengths, a part of the task's limit that a contact's surfaces may be apart.
        slip_tolerance: lengths, a part of the task's limit that a contact may slip from touch to lift.
        reference: (4,) quaternion of the reference orientation.
        tool: (3,) object frame, or None when goals are poses.
        scenarios: the motion as planned, and if the task disturbs it, the same with what does.
        exerted: what the object must exert on the world, whose answer is in all scenarios.
        attachment: the joint that holds the object to the world, or None of a free one.
        link_radius: of all links but a finger's last.
        tip_radius: of a finger's last link, which touches the object.
        bend: largest of a link at zero angle, rad.
        axis_cosines: least and largest cosine of a joint's axis and the links beside it.
        hinge: from the last joint to where the body of its link begins; 0 where links begin in a ball that they share.
        link_length: shortest and longest link.
        shortest_last: a finger's last link, which may have a longer hinge than others.
        joint_limits: lower and upper, rad.
        torque_limit: of a motor in m·g·length, or inf.
        speed_limit: of a motor in rad/s, or inf.
        force_limit: of each component of a contact force, object frame, in m·g.
        clearance: that bodies which do not touch keep from each other, lengths.
        stiffness: of a joint in m·g·length/rad.
        torsion: radius of the fingertips' torsional friction, lengths; 0 for hard points.
        sliding: lengths that a finger's contact may be planned to slide from touch to lift; 0 where it must roll.
        servo: radius of the ball about each joint that holds its servo; 0 where motors are behind the palm.
        regrasp: planned, or None where fingers stay where they touch.
        motors: that turn all joints; 0 where each joint has one of its own.
        ratios: the smallest and the largest size of a joint's ratio to such a motor, where it is not zero.
        strength: what fingers are held to bear, or None where that is left to the audit.
        own_terms: costs and constraints that a person adds to those of the stages.
    """

    units: Units
    schedule: Schedule
    gravity: Array
    inertia: Array
    bodies: tuple[Body, ...]
    contact_table: tuple[Contact, ...]
    ground: float | None
    palm_radius: float
    palm_position: Array
    palm_quaternion: Array
    palm_path: PalmPath
    goal_positions: Array
    goal_vectors: Array
    goal_tolerance: tuple[float, float]
    gap_tolerance: float
    slip_tolerance: float
    reference: Array
    tool: Array | None
    scenarios: tuple[Scenario, ...]
    link_radius: float
    tip_radius: float
    bend: float
    axis_cosines: tuple[float, float]
    hinge: float
    link_length: tuple[float, float]
    shortest_last: float
    joint_limits: tuple[float, float]
    torque_limit: float
    speed_limit: float
    force_limit: float
    clearance: float
    stiffness: float
    torsion: float
    sliding: float = 0.0
    servo: float = 0.0
    regrasp: Regrasp | None = None
    exerted: tuple[Exerted, ...] = ()
    attachment: Attachment | None = None
    motors: int = 0
    ratios: tuple[float, float] = (0.1, 2.0)
    strength: Strength | None = None
    own_terms: tuple[OwnTerm, ...] = ()

    def radii(self, joints: int) -> list[float]:
        """Of the links of a finger with some joints, lengths."""
        return link_radii(joints, self.link_radius, self.tip_radius)

    def least_lengths(self, joints: int) -> Array:
        """(n,) shortest that the links of a finger with some joints may be, lengths."""
        return np.array([*[self.link_length[0]] * (joints - 1), self.shortest_last])

    @property
    def joint_torque_limit(self) -> float:
        """Of a joint with a motor of its own; one that shares motors has no limit of theirs."""
        return np.inf if self.motors else self.torque_limit

    @property
    def joint_speed_limit(self) -> float:
        """Likewise."""
        return np.inf if self.motors else self.speed_limit

    @property
    def contact_names(self) -> tuple[str, ...]:
        """Names of the finger contacts."""
        return tuple(contact.name for contact in self.contact_table if contact.finger)

    @property
    def contacts(self) -> int:
        """Number of finger contacts."""
        return len(self.contact_names)

    @property
    def kinds(self) -> tuple[type[Body], ...]:
        """What the bodies are; with their parameters it is all that a kernel must know of them."""
        return tuple(type(body) for body in self.bodies)

    @property
    def touched(self) -> tuple[Body, ...]:
        """The body that each contact lies on, the ground's contact, if any, last."""
        return tuple(self.bodies[contact.body] for contact in self.contact_table)

    @property
    def friction(self) -> float:
        """Of fingertips and object."""
        return self.contact_table[0].friction

    @property
    def frictions(self) -> Array:
        """Friction of each contact, the ground's, if any, last."""
        return np.array([contact.friction for contact in self.contact_table])

    @property
    def patches(self) -> Array:
        """Where contacts are wanted, the ground's, if any, last; (C, 3) object frame."""
        return np.array([contact.patch for contact in self.contact_table])

    @property
    def keyframe_patches(self) -> Array:
        """(N, C, 3) where contacts are wanted at the keyframes, object frame; the ground's, if any, last."""
        if self.regrasp is not None:
            return self.regrasp.patches
        return np.tile(self.patches, (len(self.schedule.keyframes), 1, 1))

    @property
    def ground_height(self) -> float:
        """Of the ground, or a height that no object reaches where there is none."""
        return _NO_GROUND if self.ground is None else self.ground

    def slides(self, contact: int) -> bool:
        """Whether a finger's contact is planned to move on the object without lifting."""
        if self.regrasp is None or self.lifts(contact):
            return False
        return bool(np.any(self.regrasp.patches[:, contact] != self.regrasp.patches[0, contact]))

    def lifts(self, contact: int) -> bool:
        """Whether a finger's contact is planned to lift and touch the object again."""
        return self.regrasp is not None and bool(self.regrasp.lifted[:, contact].any())

    @property
    def limits_travel(self) -> bool:
        """Whether contacts are planned to stay behind while the object turns on beneath fingers that cannot let go."""
        return self.regrasp is not None and not self.regrasp.lifted.any()

    def point_spline(self, contact: int, offset: float = 0.0) -> Array:
        """(S, N) weights of a contact point at the samples, ``offset`` steps later.

        Around a planned regrasp it stays where it lifts and where it touches, and has not moved before it touches.
        """
        schedule = self.schedule
        if self.regrasp is None:
            return schedule.spline(offset)
        lifted = self.regrasp.lifted[:, contact]
        ends = np.union1d(np.flatnonzero(lifted), np.flatnonzero(lifted) + 1)
        weights = schedule.spline(offset, ends)
        now, then = (zero_order_hold(schedule.keyframes, schedule.samples + o * schedule.step) for o in (0.0, offset))
        touched = lifted[then] & ~lifted[now]
        weights[touched] = schedule.spline(0.0, ends)[touched]
        return weights

    @property
    def goal_poses(self) -> Array:
        """(G, 6) position and rotation vector from the reference at the goals, world."""
        return np.hstack([self.goal_positions, self.goal_vectors])

    @property
    def hinged(self) -> bool:
        """Whether joints' axes may not stand as they like to the links beside them."""
        return self.axis_cosines != (0.0, 1.0)

    @property
    def disturbance(self) -> Scenario | None:
        """What acts from outside in the second scenario beside the plan; None where the task asks for none."""
        if len(self.scenarios) == 1:
            return None
        return self.scenarios[1].plus(self.scenarios[0], -1.0) if self.exerted else self.scenarios[1]

    def unborne(self, wrenches: Array) -> Array:
        """What of wrenches (6, ...), object frame, contacts have to balance: all, or what a joint lets go (1, ...)."""
        return wrenches if self.attachment is None else self.attachment.twist[None] @ wrenches


def palm_from_world(model: Model, time: float) -> tuple[Array, Array]:
    """Rotation (3, 3) palm <- world and the palm's position (3,) in the world at a time."""
    sample = int(np.argmin(np.abs(model.schedule.samples - time)))
    return pin.Quaternion(*model.palm_quaternion[sample]).matrix().T, model.palm_position[sample]


def sizes(model: Model) -> tuple[int, int, int]:
    """Number of keyframes, samples and contacts (the ground's included)."""
    schedule = model.schedule
    return len(schedule.keyframes), len(schedule.samples), model.contacts + (model.ground is not None)


def sampled_points(model: Model, keyframes: Array) -> Array:
    """Contact points (S, C, 3) at the samples from those at the keyframes (N, C, 3)."""
    return np.stack([model.point_spline(c) @ keyframes[:, c] for c in range(keyframes.shape[1])], axis=1)
