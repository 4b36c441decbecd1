"""The fingers' blocks of the synthesis: Table 2.2."""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from casadi_hands.geometry.bodies import Body, surfaces, width_of
from casadi_hands.kinematics import link_radii
from casadi_hands.kinematics.symbols import morphology, tip_point
from casadi_hands.nlp import Kernel
from casadi_hands.terms import clearance, finger

Array = NDArray[np.float64]


@cache
def follow(joints: int) -> Kernel:
    """One finger at one keyframe: eq. 2.18, 2.23, 2.24 and 2.27."""
    kernel = Kernel("follow")
    frames = kernel.parameter("frames", 9 * joints)
    symbols = morphology(kernel.variable, frames, joints)
    angles, tip = kernel.variable("angles", joints), kernel.variable("tips", 2)
    target, force, active, radius, tip_radius, lowest, highest = (
        kernel.parameter(name, size)
        for name, size in (
            ("target", 3),
            ("force", 3),
            ("active", 1),
            ("link_radius", 1),
            ("tip_radius", 1),
            ("lowest", 1),
            ("highest", 1),
        )
    )
    point, _ = tip_point(tip, symbols.lengths[-1], tip_radius)
    placed = symbols.placed(angles, (radius, tip_radius), point)
    kernel.cost(finger.TIP_TARGET, active * (placed.contact - target))
    kernel.cost(finger.NULL_SPACE, active * finger.null_space(placed.jacobian, force))
    kernel.cost(finger.TORQUE, active * finger.joint_torques(placed.jacobian, force))
    kernel.cost(finger.JOINT_LIMITS, finger.beyond_limits(angles, lowest, highest))
    return kernel


@cache
def build(joints: int) -> Kernel:
    """One finger's shape: eq. 2.21, 2.22 and 2.25."""
    kernel = Kernel("build")
    base, lengths = kernel.variable("base", 2), kernel.variable("lengths", joints)
    kernel.cost(finger.BEND, kernel.variable("bends", 2 * joints))
    palm_radius, radius, tip_radius, shortest, shortest_last, longest = (
        kernel.parameter(n)
        for n in ("palm_radius", "link_radius", "tip_radius", "shortest", "shortest_last", "longest")
    )
    least = ca.vertcat(*[shortest] * (joints - 1), shortest_last)
    kernel.cost(finger.LENGTH, lengths)
    kernel.cost(finger.MINIMUM_LENGTH, finger.beyond_limits(lengths, least, longest))
    kernel.cost(finger.FINGER_BASE, finger.off_palm(base, palm_radius - link_radii(joints, radius, tip_radius)[0]))
    return kernel


@cache
def collide(joints: int, kinds: tuple[type[Body], ...], servos: bool = False) -> Kernel:
    """One finger, and servos in its joints if it has any, against object, palm, ground and itself (eq. 2.20)."""
    kernel = Kernel("collide")
    frames = kernel.parameter("frames", 9 * joints)
    symbols = morphology(kernel.variable, frames, joints)
    angles = kernel.variable("angles", joints)
    radius, tip_radius, palm_radius, margin = (
        kernel.parameter(name) for name in ("link_radius", "tip_radius", "palm_radius", "margin")
    )
    bodies = surfaces(kinds, kernel.parameter("bodies", width_of(kinds)))
    up, ground = kernel.parameter("up", 3), kernel.parameter("ground")
    ends, radii = symbols.placed(angles, (radius, tip_radius)).links
    apart = [
        clearance.links_and_palm(ends, radii, palm_radius),
        clearance.links_and_ground(ends, radii, up, ground),
        clearance.links_of_one(ends, radii),
    ]
    if joints > 1:
        apart.append(clearance.links_and_object(ends[:-1], radii[:-1], bodies, margin))
    if servos:
        servo = kernel.parameter("servo_radius")
        apart.append(clearance.servos_and_rest(ends, radii, servo, palm_radius, bodies, up, ground))
    touching = clearance.links_and_object(ends[-1:], radii[-1:], bodies, ca.SX(0))
    folds = clearance.unfolded(ends, radius)
    kernel.cost(clearance.COLLISION, clearance.overlap(ca.vertcat(margin - ca.vertcat(*apart), -touching, -folds)))
    return kernel


@cache
def keep_apart(joints: int, other_joints: int, servos: bool = False) -> Kernel:
    """Two fingers, and servos in their joints if they have any, against each other at one time (eq. 2.20)."""
    kernel = Kernel("keep_apart")
    frames = kernel.parameter("frames0", 9 * joints, "frames", 0)
    other_frames = kernel.parameter("frames1", 9 * other_joints, "frames", 1)
    first = morphology(kernel.variable, frames, joints, 0)
    angles = kernel.variable("angles0", joints, "angles", 0)
    second = morphology(kernel.variable, other_frames, other_joints, 1)
    other_angles = kernel.variable("angles1", other_joints, "angles", 1)
    radii, margin = (kernel.parameter("link_radius"), kernel.parameter("tip_radius")), kernel.parameter("margin")
    links = first.placed(angles, radii).links, second.placed(other_angles, radii).links
    servo = kernel.parameter("servo_radius") if servos else None
    kernel.cost(clearance.COLLISION, clearance.overlap(margin - clearance.two_fingers(*links, servo)))
    return kernel


@cache
def travel(joints: int) -> Kernel:
    """A fingertip's acceleration at a keyframe where it touches nothing (eq. 2.26)."""
    kernel = Kernel("travel")
    frames = kernel.parameter("frames", 9 * joints)
    symbols = morphology(kernel.variable, frames, joints)
    # Wherever it stands: only how its tip moves counts.
    before, now, after = (
        symbols.placed(kernel.variable(f"angles{i}", joints, "angles", i), (ca.SX(0), ca.SX(0))).tip for i in range(3)
    )
    acceleration = finger.tip_acceleration(before, now, after, kernel.parameter("idle_step"))
    kernel.cost(finger.FINGERTIP_ACCELERATION, acceleration)
    return kernel
