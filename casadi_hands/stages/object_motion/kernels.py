"""The object's blocks of the floating and the whole-hand stage: physics, contacts, goals, clearance, most as costs."""

from __future__ import annotations

from functools import cache

import casadi as ca
from casadi import SX

from casadi_hands.geometry import point_disc_distance
from casadi_hands.geometry.bodies import Body
from casadi_hands.motion import angular_motion, exponential, multiply, rotation_matrix
from casadi_hands.motion.pose import placed
from casadi_hands.nlp import Kernel
from casadi_hands.stages.object_motion.palm import Palm
from casadi_hands.terms import body as motion_terms
from casadi_hands.terms import clearance, contact
from casadi_hands.terms import constraints as limits

_MARKS = 3  # points that stand for a capsule, of which the weight is


@cache
def dynamics(contacts: int, suffix: str = "", regularise: bool = True, joint: str = "") -> Kernel:
    """Newton–Euler at one sample (eq. 2.5, 2.6) and the object's accelerations (eq. 2.14, 2.15).

    What a palm that moves carries is accelerated with it; only what differs from that costs. Of an object on a joint
    balance is asked along its one freedom, where the joint resists, too.

    Args:
        contacts: number of contacts, the ground's included.
        suffix: of the term names, for a second scenario.
        regularise: whether to add the terms that do not depend on forces.
        joint: ``turning`` or ``sliding`` of an object that is attached by one.
    """
    kernel = Kernel("dynamics" + suffix)
    poses = [kernel.variable(f"pose{i}", 6, "pose", i) for i in range(3)]
    points = ca.reshape(kernel.variable("points", 3 * contacts, "point"), 3, contacts)
    forces = ca.reshape(kernel.variable("forces", 3 * contacts, "force"), 3, contacts)
    invariant = kernel.variable("invariant", contacts)
    reference, step = kernel.parameter("reference", 4), kernel.parameter("step")
    gravity = kernel.parameter("gravity", 3)
    external, external_torque = kernel.parameter("external_force", 3), kernel.parameter("external_torque", 3)
    inertia, inertial = ca.reshape(kernel.parameter("inertia", 9), 3, 3), kernel.parameter("inertial")
    before, now, after = (placed(pose, reference) for pose in poses)
    acceleration = (after[0] - 2 * now[0] + before[0]) / step**2
    omega, alpha = angular_motion(before[1], now[1], after[1], step)
    rotation = rotation_matrix(now[1])
    inertial_torque = inertial * motion_terms.gyroscopic(inertia, omega, alpha)
    local_torque = ca.mtimes(rotation.T, external_torque)
    in_world = ca.mtimes(rotation, forces)
    linear = motion_terms.linear_momentum(in_world, invariant, gravity, external, acceleration, inertial)
    angular = motion_terms.angular_momentum(points, forces, invariant, local_torque, inertial_torque)
    if joint:
        free = kernel.parameter("freedom", 6)
        along = ca.dot(free, ca.vertcat(ca.mtimes(rotation.T, linear), angular)) + kernel.parameter("resistance")
        law = motion_terms.ANGULAR_MOMENTUM if joint == "turning" else motion_terms.LINEAR_MOMENTUM
        kernel.cost(law, along, suffix)
    else:
        kernel.cost(motion_terms.LINEAR_MOMENTUM, linear, suffix)
        kernel.cost(motion_terms.ANGULAR_MOMENTUM, angular, suffix)
    if regularise:
        kernel.cost(motion_terms.OBJECT_ACCELERATION, acceleration - kernel.parameter("carried_acceleration", 3))
        kernel.cost(motion_terms.OBJECT_ANGULAR_ACCELERATION, inertial_torque / step)
    return kernel


@cache
def contact_forces(kind: type[Body], suffix: str = "") -> Kernel:
    """One finger contact at one sample: eq. 2.7, 2.8, 2.10, 2.12 and the slip they miss.

    Friction is also a constraint: the exponential of eq. 2.8 alone lets forces out of the cone by 0.1 m·g.
    """
    kernel = Kernel("contact" + suffix)
    force, invariant = kernel.variable("force", 3), kernel.variable("invariant", 1)
    point = kernel.variable("point", 3, place=0)
    before = kernel.variable("point_before", 3, "point", -1)
    body = kind.surface(kernel.parameter("body", kind.width))
    friction, sharpness, step = (kernel.parameter(name) for name in ("friction", "sharpness", "step"))
    projection, normal = body.project(point)
    projection_before, _ = body.project(before)
    kernel.cost(contact.FORCE_REGULARISATION, invariant * force, suffix)
    kernel.cost(contact.RAW_FORCE, force, suffix)
    cone = contact.friction_cone(force, -normal, friction, sharpness)
    kernel.cost(contact.FRICTION_CONE, invariant * cone, suffix)
    kernel.constrain(limits.IN_CONE, contact.cone_margin(force, -normal, friction))
    kernel.cost(contact.CONTACT_ON_OBJECT, contact.off_surface(force, invariant, point, projection), suffix)
    gaps = (projection - point, projection_before - before)
    kernel.cost(contact.SLIP_ON_OBJECT, contact.gap_rate(force, invariant, *gaps, step), suffix)
    kernel.cost(contact.TANGENTIAL_SLIP, contact.slip(force, invariant, point, before, step), suffix)
    return kernel


@cache
def contact_motion() -> Kernel:
    """Where one contact point goes: eq. 2.13, and a weak pull to the user's patch."""
    kernel = Kernel("contact_motion")
    before, point, after = (kernel.variable(f"point{i}", 3, "point", i) for i in range(3))
    patch, step = kernel.parameter("patch", 3), kernel.parameter("step")
    kernel.cost(contact.CONTACT_ACCELERATION, contact.acceleration(before, point, after, step))
    kernel.cost(contact.CONTACT_PATCH, point - patch)
    return kernel


@cache
def ground_contact(kind: type[Body], suffix: str = "") -> Kernel:
    """The contact of object and ground at one sample (section 3.1); its normal is the world's z."""
    kernel = Kernel("ground" + suffix)
    pose, pose_before = kernel.variable("pose", 6, place=0), kernel.variable("pose_before", 6, "pose", -1)
    point, force, invariant = kernel.variable("point", 3), kernel.variable("force", 3), kernel.variable("invariant", 1)
    reference, body = kernel.parameter("reference", 4), kind.surface(kernel.parameter("body", kind.width))
    height = kernel.parameter("ground_height")
    friction, sharpness, step = (kernel.parameter(n) for n in ("friction", "sharpness", "step"))
    position, quaternion = placed(pose, reference)
    rotation = rotation_matrix(quaternion)
    position_before, quaternion_before = placed(pose_before, reference)
    in_world = position + ca.mtimes(rotation, point)
    in_world_before = position_before + ca.mtimes(rotation_matrix(quaternion_before), point)
    projection, normal = body.project(point)
    kernel.cost(contact.FORCE_REGULARISATION, invariant * force, suffix)
    kernel.cost(contact.RAW_FORCE, force, suffix)
    upward_in_object = rotation.T[:, 2]
    cone = contact.friction_cone(force, upward_in_object, friction, sharpness)
    kernel.cost(contact.GROUND_FRICTION_CONE, invariant * cone, suffix)
    kernel.constrain(limits.IN_CONE, contact.cone_margin(force, upward_in_object, friction))
    off = contact.off_surface(force, invariant, point, projection)
    kernel.cost(contact.CONTACT_ON_OBJECT, off, suffix)
    above = contact.off_surface(force, invariant, in_world[2], height)
    tilted = contact.off_surface(force, invariant, normal, -upward_in_object)
    kernel.cost(contact.CONTACT_ON_GROUND, above + 0.1 * tilted, suffix)
    kernel.cost(contact.SLIP_ON_GROUND, contact.slip(force, invariant, in_world, in_world_before, step), suffix)
    return kernel


@cache
def goal_pose() -> Kernel:
    """The task term at one goal (eq. 2.9)."""
    kernel = Kernel("goal")
    pose = kernel.variable("pose", 6)
    reference = kernel.parameter("reference", 4)
    target, vector = kernel.parameter("target", 3), kernel.parameter("vector", 3, "goal_vector")
    position, turned = placed(pose, reference)
    goal = multiply(exponential(vector), reference)
    kernel.cost(motion_terms.TASK, motion_terms.task_pose(position, turned, target, goal))
    return kernel


@cache
def goal_point() -> Kernel:
    """The task term of a drawing at one sample of its path (fig. 3.4)."""
    kernel = Kernel("goal")
    pose = kernel.variable("pose", 6)
    reference = kernel.parameter("reference", 4)
    target, tool = kernel.parameter("target", 3), kernel.parameter("tool", 3)
    position, quaternion = placed(pose, reference)
    kernel.cost(motion_terms.TOOL, motion_terms.task_point(position, rotation_matrix(quaternion), tool, target))
    return kernel


@cache
def straight_path() -> Kernel:
    """One keyframe's distance (6,) from the straight way between goals: lengths and rad.

    Without it the object wanders where no goal holds it, to wherever forces are smallest.
    """
    kernel = Kernel("straight_path")
    pose, straight = kernel.variable("pose", 6), kernel.parameter("straight", 6)
    kernel.cost(motion_terms.PATH, pose - straight)
    return kernel


@cache
def palm_clearance(kind: type[Body], moves: bool) -> Kernel:
    """One body of the object against palm and ground at one sample (section 3.2.3)."""
    kernel = Kernel("palm_clearance")
    pose = kernel.variable("pose", 6)
    palm = Palm(kernel, moves)
    reference, body = kernel.parameter("reference", 4), kind.surface(kernel.parameter("body", kind.width))
    palm_radius, ground, margin = (kernel.parameter(name) for name in ("palm_radius", "ground_height", "clearance"))
    position, quaternion = placed(pose, reference)
    rotation = rotation_matrix(quaternion)
    core = body.core.mapped(lambda point: position + ca.mtimes(rotation, point))
    costs: list[SX] = []
    marks = core.marks(palm.axis)
    for point in marks:
        distance = point_disc_distance(palm.sees(point), palm_radius) - body.radius
        costs.append(clearance.overlap(margin - distance))
        costs.append(clearance.overlap(ground - (point[2] - body.radius)))
    # A body costs the same however many points stand for it.
    kernel.cost(clearance.PALM_CLEARANCE, _MARKS / len(marks) * ca.vertcat(*costs))
    return kernel


@cache
def enough_contacts(contacts: int) -> Kernel:
    """The sum of the contact invariants at one keyframe, to be bounded below."""
    kernel = Kernel("enough_contacts")
    invariant = kernel.variable("invariant", contacts)
    kernel.constrain(limits.ENOUGH_CONTACTS, ca.sum1(invariant))
    return kernel
