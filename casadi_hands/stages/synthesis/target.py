"""What fingers must follow: a floating motion seen from the palm, nondimensional."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.geometry.bodies import Body, packed
from casadi_hands.geometry.contact_points import inward_normals, on_bodies
from casadi_hands.motion import catmull_rom, linear
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.model import Model, palm_from_world
from casadi_hands.problem.palm_motion import added_to_spline

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Target:
    """Contacts, forces and the object's pose in the palm frame at the keyframes.

    Attributes:
        times: (N,) s.
        points: (N, C, 3) on the object's surface.
        normals: (N, C, 3) into the object.
        forces: (N, C, 3) on the object, m·g.
        centers: (N, 3) the object's centre of mass.
        active: (N, C) bool.
        pose: (N, 6) of the object in the world, as the floating stage has it.
        model: the task.
    """

    times: Array
    points: Array
    normals: Array
    forces: Array
    centers: Array
    active: NDArray[np.bool_]
    pose: Array
    model: Model

    @property
    def palm_radius(self) -> float:
        """Of the disc, lengths."""
        return self.model.palm_radius

    def radii(self, joints: int) -> list[float]:
        """Of a finger's links, lengths."""
        return self.model.radii(joints)

    def least_lengths(self, joints: int) -> Array:
        """(n,) shortest that a finger's links may be, lengths."""
        return self.model.least_lengths(joints)

    @property
    def link_length(self) -> tuple[float, float]:
        """Shortest and longest, lengths."""
        return self.model.link_length

    @property
    def joint_limits(self) -> tuple[float, float]:
        """Lower and upper, rad."""
        return self.model.joint_limits

    @property
    def kinds(self) -> tuple[type[Body], ...]:
        """What the object's bodies are."""
        return self.model.kinds

    @property
    def tip_arc(self) -> float:
        """How far along the fingertip's surface a contact may be from the cap's pole."""
        return self.model.tip_radius * np.pi / 2 + 0.3 * self.link_length[0]

    def string_of(self, contact: int) -> NDArray[np.int64]:
        """For each keyframe (N,) the string of a contact's active keyframes it belongs to."""
        return string_of(self.active[:, contact])

    def strings(self, contact: int) -> int:
        """Number of strings of a contact, at least 1."""
        return int(self.string_of(contact).max()) + 1

    def collision_times(self, between: int) -> Array:
        """The keyframes with ``between`` more times in each gap, s."""
        return self.model.schedule.between(between)

    def scene(self, times: Array) -> tuple[Array, Array, Array]:
        """Parameters of the object's bodies (T, W), the ground's normal (T, 3) and offset (T,), palm frame."""
        model = self.model
        added = linear(model.schedule.samples, times) @ added_to_spline(model, 0)
        poses = catmull_rom(self.times, times) @ self.pose + added
        bodies, up, offset = [], [], []
        for time, pose in zip(times, poses, strict=True):
            rotation, position = palm_from_world(model, time)
            turn = rotation @ pin.exp3(pose[3:]) @ pin.Quaternion(*model.reference).matrix()
            center = rotation @ (pose[:3] - position)
            bodies.append(packed([body.placed(turn, center) for body in model.bodies]))
            up.append(rotation[:, 2])
            offset.append(model.ground_height - position[2])
        return np.array(bodies), np.array(up), np.array(offset)


def string_of(active: NDArray[np.bool_]) -> NDArray[np.int64]:
    """For each keyframe (N,) of one contact its string of active keyframes; idle ones count with the next string."""
    starts = active & ~np.concatenate([[False], active[:-1]])
    strings = np.cumsum(starts) - 1
    return np.clip(np.where(active, strings, strings + 1), 0, max(int(starts.sum()) - 1, 0))


def target_of(model: Model, floating: Floating) -> Target:
    """See a floating motion from the palm; contact points are moved onto the object's surface."""
    schedule, contacts = model.schedule, model.contacts
    touched = model.touched[:contacts]
    points, normals, forces, centers = [], [], [], []
    for k, sample in enumerate(schedule.keyframe_samples):
        rotation, position = palm_from_world(model, schedule.keyframes[k])
        pose = floating.pose[k]
        turn = rotation @ pin.exp3(pose[3:]) @ pin.Quaternion(*model.reference).matrix()
        inward = inward_normals(floating.point[k, :contacts], touched)
        on_surface = on_bodies(floating.point[k, :contacts], touched)
        center = rotation @ (pose[:3] - position)
        force = floating.force[sample, :contacts] * floating.active[k, :contacts, None]
        points.append(on_surface @ turn.T + center)
        normals.append(inward @ turn.T)
        forces.append(force @ turn.T)
        centers.append(center)
    return Target(
        times=schedule.keyframes,
        points=np.array(points),
        normals=np.array(normals),
        forces=np.array(forces),
        centers=np.array(centers),
        active=floating.active[:, :contacts],
        pose=floating.pose,
        model=model,
    )
