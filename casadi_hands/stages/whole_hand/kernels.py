"""The fingers' blocks of the whole-hand stage, one finger or two at one sample, and the palm's; all are costs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import casadi as ca
from casadi import SX

from casadi_hands.geometry.bodies import Body, Surface, surfaces, width_of
from casadi_hands.geometry.bodies.capsule import Segment
from casadi_hands.kinematics.symbols import FingerSymbols, PlacedFinger, morphology
from casadi_hands.motion import rotation_matrix
from casadi_hands.motion.pose import placed
from casadi_hands.nlp import Kernel
from casadi_hands.stages.object_motion.palm import Palm
from casadi_hands.terms import clearance, contact, finger


def given_morphology(kernel: Kernel, joints: int, place: int | None = None) -> FingerSymbols:
    """A finger whose morphology is parameters: seed frames, base, lengths, axis coordinates, bends."""
    tag = "" if place is None else str(place)
    frames = kernel.parameter(f"frames{tag}", 9 * joints, "frames", place)
    return morphology(kernel.parameter, frames, joints, place)


@cache
def touch(joints: int, moves: bool) -> Kernel:
    """One finger and its contact at one sample (Table 2.4): all that ties the contact to the finger."""
    kernel = Kernel("touch")
    pose, pose_before = kernel.variable("pose", 6, place=0), kernel.variable("pose_before", 6, "pose", -1)
    point, force, invariant = kernel.variable("point", 3), kernel.variable("force", 3), kernel.variable("invariant", 1)
    angles = kernel.variable("angles", joints, place=0)
    angles_before = kernel.variable("angles_before", joints, "angles", -1)
    palm, palm_before = Palm(kernel, moves), Palm(kernel, moves, before=True)
    symbols = given_morphology(kernel, joints)
    reference = kernel.parameter("reference", 4)
    radius, tip_radius, hinge, friction, sharpness, step = (
        kernel.parameter(n) for n in ("link_radius", "tip_radius", "hinge", "friction", "sharpness", "step")
    )
    radii = radius, tip_radius
    position, quaternion = placed(pose, reference)
    rotation = rotation_matrix(quaternion)
    in_palm = palm.sees(position + ca.mtimes(rotation, point))
    skeleton = symbols.placed(angles, radii)
    last = skeleton.origins[:, -1]
    on_link = ca.mtimes(skeleton.tip_rotation.T, in_palm - last)
    here = symbols.placed(angles, radii, on_link)
    link = Surface(Segment(ca.vertcat(0, 0, hinge), ca.vertcat(0, 0, symbols.lengths[-1])), tip_radius)
    projection, normal = link.project(on_link)
    force_in_palm = palm.turned(ca.mtimes(rotation, force))
    kernel.cost(contact.CONTACT_ON_FINGER, contact.off_surface(force, invariant, on_link, projection))
    position_before, quaternion_before = placed(pose_before, reference)
    object_moved = in_palm - palm_before.sees(position_before + ca.mtimes(rotation_matrix(quaternion_before), point))
    finger_moved = in_palm - symbols.placed(angles_before, radii, on_link).contact
    kernel.cost(contact.SLIP_ON_FINGER, contact.slip(force, invariant, object_moved, finger_moved, step))
    cone = contact.friction_cone(force_in_palm, ca.mtimes(here.tip_rotation, normal), friction, sharpness)
    kernel.cost(contact.FRICTION_CONE_HAND, invariant * cone)
    kernel.cost(finger.NULL_SPACE, invariant * finger.null_space(here.jacobian, force_in_palm))
    kernel.cost(finger.TORQUE, invariant * finger.joint_torques(here.jacobian, force_in_palm))
    return kernel


@cache
def move(joints: int) -> Kernel:
    """One finger's joints at one sample: eq. 2.26 for all tips, and eq. 2.27 as a plain square outside the limits."""
    kernel = Kernel("move")
    angles = [kernel.variable(f"angles{i}", joints, "angles", i) for i in range(3)]
    symbols = given_morphology(kernel, joints)
    lowest, highest, step = kernel.parameter("lowest"), kernel.parameter("highest"), kernel.parameter("step")
    before, now, after = (symbols.placed(a, (SX(0), SX(0))).tip for a in angles)  # wherever it stands
    kernel.cost(finger.FINGER_ACCELERATION, finger.tip_acceleration(before, now, after, step))
    beyond = ca.vertcat(ca.fmax(angles[1] - highest, 0), ca.fmax(lowest - angles[1], 0))
    kernel.cost(finger.JOINT_LIMITS_SQUARED, beyond)
    return kernel


@cache
def object_clearance(joints: int, kinds: tuple[type[Body], ...], moves: bool, servos: bool = False) -> Kernel:
    """One finger, and servos in its joints if it has any, against object, palm, ground and itself (eq. 2.20)."""
    kernel = Kernel("object_clearance")
    pose, angles = kernel.variable("pose", 6), kernel.variable("angles", joints)
    palm = Palm(kernel, moves)
    symbols = given_morphology(kernel, joints)
    reference = kernel.parameter("reference", 4)
    radius, tip_radius, palm_radius, ground, margin = (
        kernel.parameter(name) for name in ("link_radius", "tip_radius", "palm_radius", "ground_height", "margin")
    )
    bodies = surfaces(kinds, kernel.parameter("bodies", width_of(kinds)))
    position, quaternion = placed(pose, reference)
    rotation = rotation_matrix(quaternion)

    def seen(point: SX) -> SX:
        return palm.sees(position + ca.mtimes(rotation, point))

    in_palm = [body.mapped(seen) for body in bodies]
    here = symbols.placed(angles, (radius, tip_radius))
    up = palm.turned(SX([0, 0, 1]))
    servo = kernel.parameter("servo_radius") if servos else None
    apart, touching = distances(here, palm_radius, in_palm, up, ground - palm.position[2], servo, margin)
    folds = clearance.unfolded(here.ends, radius)
    kernel.cost(clearance.COLLISION, clearance.overlap(ca.vertcat(margin - apart, -touching, -folds)))
    return kernel


def distances(
    here: PlacedFinger,
    palm_radius: SX,
    bodies: Sequence[Surface],
    up: SX | None,
    ground: SX,
    servo: SX | None = None,
    margin: SX | None = None,
) -> tuple[SX, SX]:
    """Distances between one finger and all but other fingers: those to keep apart, and the touching link's (K,).

    Without a ground ``up`` is None, and so is ``servo``, the radius of a joint's ball with its servo, without these.
    Where there is a ``margin``, distances from the object need only be right up to it, and the touching link's up to 0.
    """
    ends, radii = here.links
    apart = [clearance.links_and_palm(ends, radii, palm_radius), clearance.links_of_one(ends, radii)]
    if up is not None:
        apart.append(clearance.links_and_ground(ends, radii, up, ground))
    if len(ends) > 1:
        apart.append(clearance.links_and_object(ends[:-1], radii[:-1], bodies, margin))
    if servo is not None:
        apart.append(clearance.servos_and_rest(ends, radii, servo, palm_radius, bodies, up, ground))
    touching = clearance.links_and_object(ends[-1:], radii[-1:], bodies, None if margin is None else SX(0))
    return ca.vertcat(*apart), touching


@cache
def finger_clearance(joints: int, other_joints: int, servos: bool = False) -> Kernel:
    """Two fingers, and servos in their joints if they have any, against each other at one sample (eq. 2.20)."""
    kernel = Kernel("finger_clearance")
    angles = kernel.variable("angles0", joints, "angles", 0)
    other_angles = kernel.variable("angles1", other_joints, "angles", 1)
    first, second = given_morphology(kernel, joints, 0), given_morphology(kernel, other_joints, 1)
    radii, margin = (kernel.parameter("link_radius"), kernel.parameter("tip_radius")), kernel.parameter("margin")
    servo = kernel.parameter("servo_radius") if servos else None
    links = first.placed(angles, radii).links, second.placed(other_angles, radii).links
    kernel.cost(clearance.COLLISION, clearance.overlap(margin - clearance.two_fingers(*links, servo)))
    return kernel


@cache
def palm_motion() -> Kernel:
    """A moving palm at one keyframe: acceleration of its offset, and a weak pull to the given motion."""
    kernel = Kernel("palm_motion")
    before, now, after = (kernel.variable(f"palm{i}", 6, "palm", i) for i in range(3))
    step = kernel.parameter("keyframe_step")
    kernel.cost(finger.BASE_ACCELERATION, ca.vertcat((after - 2 * now + before) / step**2, 0.1 * now))
    return kernel
