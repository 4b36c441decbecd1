"""The object's blocks of the refine stage: wrench of contacts, ground, clearance, drawing, all met exactly."""

from __future__ import annotations

from functools import cache

import casadi as ca
from casadi import SX

from casadi_hands.geometry import point_disc_distance
from casadi_hands.geometry.bodies import Body, surfaces, width_of
from casadi_hands.geometry.surface import path_between
from casadi_hands.motion import conjugate, derivative, rotation_matrix
from casadi_hands.motion.pose import placed
from casadi_hands.nlp import Constraint, Kernel
from casadi_hands.stages.refine.torsion import twist_torque
from casadi_hands.terms import body, contact
from casadi_hands.terms import constraints as limits

ROUNDING = 1e-6  # lengths, of distances where they vanish


@cache
def wrench(contacts: int, soft: bool) -> Kernel:
    """The contacts' force and torque at a knot, as variables of their own: physics then knows no contacts."""
    kernel = Kernel("wrench")
    total = kernel.variable("wrench", 6)
    points, forces = _contacts(kernel, contacts)
    torque = _torque(points, forces) + twist_torque(kernel, soft)
    kernel.constrain(limits.WRENCH_OF_CONTACTS, ca.vertcat(ca.sum2(forces), torque) - total)
    return kernel


@cache
def middle_torque(contacts: int, soft: bool) -> Kernel:
    """The contacts' torque halfway between two knots, with forces and points linear in the object's frame."""
    kernel = Kernel("middle_torque")
    middle = kernel.variable("middle_torque", 3)
    ends = [_contacts(kernel, contacts, i) for i in range(2)]
    points, forces = ((ends[0][i] + ends[1][i]) / 2 for i in range(2))
    twist = (twist_torque(kernel, soft, 0) + twist_torque(kernel, soft, 1)) / 2
    kernel.constrain(limits.WRENCH_OF_CONTACTS, _torque(points, forces) + twist - middle)
    return kernel


def _contacts(kernel: Kernel, contacts: int, place: int | None = None) -> tuple[SX, SX]:
    """Declare the points and forces (3, C) of all contacts, at one of several knots if told so."""
    tag = "" if place is None else str(place)
    points, forces = (kernel.variable(name + tag, 3 * contacts, name, place) for name in ("point", "force"))
    return ca.reshape(points, 3, contacts), ca.reshape(forces, 3, contacts)


def _torque(points: SX, forces: SX) -> SX:
    return sum((ca.cross(points[:, i], forces[:, i]) for i in range(points.shape[1])), SX.zeros(3, 1))


@cache
def disturbed(contacts: int, soft: bool) -> Kernel:
    """Second forces at a knot that, with a push from outside and the same torsion, make the wrench of the first."""
    kernel = Kernel("disturbed")
    pose, total = kernel.variable("pose", 6), kernel.variable("wrench", 6)
    points, forces = _contacts(kernel, contacts)
    names = (("reference", 4), ("external_force", 3), ("external_torque", 3))
    reference, force, torque = (kernel.parameter(n, k) for n, k in names)
    _, quaternion = placed(pose, reference)
    to_object = rotation_matrix(conjugate(quaternion))
    push = ca.vertcat(ca.mtimes(to_object, force), ca.mtimes(to_object, torque))
    torque = _torque(points, forces) + twist_torque(kernel, soft)
    kernel.constrain(limits.DISTURBED_WRENCH, ca.vertcat(ca.sum2(forces), torque) + push - total)
    kernel.cost(body.DISTURBED_FORCE, forces)
    return kernel


@cache
def object_jerk() -> Kernel:
    """How the object's acceleration changes over three knots.

    Without it a motion that starts still reaches its full acceleration in one step, which joints cannot follow.
    """
    kernel = Kernel("object_jerk")
    rates = [kernel.variable(f"rate{i}", 6, "rate", i) for i in range(3)]
    kernel.cost(body.OBJECT_JERK, derivative(rates, [kernel.parameter(f"step{i}", 1, "step", i) for i in range(2)]))
    return kernel


@cache
def force_change(contacts: int) -> Kernel:
    """Change of the contact forces from one knot to the next."""
    kernel = Kernel("force_change")
    before, after = (kernel.variable(f"force{i}", 3 * contacts, "force", i) for i in range(2))
    kernel.cost(body.FORCE_CHANGE, after - before)
    return kernel


@cache
def near_path() -> Kernel:
    """The object near the motion of the whole-hand stage at one knot."""
    kernel = Kernel("near_path")
    pose, wanted = kernel.variable("pose", 6), kernel.parameter("wanted_pose", 6)
    kernel.cost(body.STAY_PATH, pose - wanted)
    return kernel


@cache
def meet_goal() -> Kernel:
    """The object's distance (6,) from a goal; the tolerance is there for where it is needed, not to be used up."""
    kernel = Kernel("meet_goal")
    pose, wanted = kernel.variable("pose", 6), kernel.parameter("goal_pose", 6)
    kernel.cost(body.GOAL, pose - wanted)
    return kernel


@cache
def ground_contact(kind: type[Body]) -> Kernel:
    """The object's contact with the ground at one knot; the ground's normal is the world's z.

    Constraints: ``on_surfaces`` (2: off the object, off the ground), ``opposed`` (2), ``facing`` (1), ``pressing``
    (1) and ``cone`` (1), as a finger's contact has them.
    """
    kernel = Kernel("ground")
    pose, point, force = kernel.variable("pose", 6), kernel.variable("point", 3), kernel.variable("force", 3)
    reference, touched = kernel.parameter("reference", 4), kind.surface(kernel.parameter("body", kind.width))
    height, friction = kernel.parameter("ground_height"), kernel.parameter("friction")
    wanted_point, wanted_force = kernel.parameter("wanted_point", 3), kernel.parameter("wanted_force", 3)
    position, quaternion = placed(pose, reference)
    rotation = rotation_matrix(quaternion)
    off_object, normal = touched.distance_and_normal(point, ROUNDING)
    outward, exerted = ca.mtimes(rotation, normal), ca.mtimes(rotation, force)
    above = position[2] + ca.dot(rotation[2, :].T, point) - height
    kernel.constrain(limits.ON_SURFACES, ca.vertcat(off_object, above))
    kernel.constrain(limits.OPPOSED, outward[:2])
    kernel.constrain(limits.FACING, outward[2])
    _hold(kernel, exerted, friction, (limits.GROUND_PRESSING, limits.GROUND_CONE))
    kernel.cost(contact.STAY_POINT, point - wanted_point)
    kernel.cost(contact.STAY_FORCE, force - wanted_force)
    kernel.cost(contact.GROUND_LOAD, exerted[2])
    return kernel


@cache
def disturbed_ground() -> Kernel:
    """A second force in the ground's cone at one knot."""
    kernel = Kernel("disturbed_ground")
    pose, force = kernel.variable("pose", 6), kernel.variable("force", 3)
    reference, friction = kernel.parameter("reference", 4), kernel.parameter("friction")
    _, quaternion = placed(pose, reference)
    declared = limits.DISTURBED_GROUND_PRESSING, limits.DISTURBED_GROUND_CONE
    _hold(kernel, ca.mtimes(rotation_matrix(quaternion), force), friction, declared)
    return kernel


def _hold(kernel: Kernel, exerted: SX, friction: SX, declared: tuple[Constraint, Constraint]) -> None:
    """Constrain the ground's force (3,) on the object, world: ``pressing`` (1) and ``cone`` (1: (μ f_n)² - f_t²)."""
    kernel.constrain(declared[0], exerted[2])
    kernel.constrain(declared[1], contact.cone_margin_squared(exerted[2], ca.sumsqr(exerted[:2]), friction))


@cache
def ground_rolling(kind: type[Body]) -> Kernel:
    """The object's contact with the ground from one knot to the next: it rolls or stands, and does not slip."""
    kernel = Kernel("ground_rolling")
    ends = [(kernel.variable(f"pose{i}", 6, "pose", i), kernel.variable(f"point{i}", 3, "point", i)) for i in range(2)]
    reference, touched = kernel.parameter("reference", 4), kind.surface(kernel.parameter("body", kind.width))
    step = kernel.parameter("step")
    points, normals, rotations, world = [], [], [], []
    for pose, point in ends:
        position, quaternion = placed(pose, reference)
        points.append(point)
        normals.append(touched.distance_and_normal(point, ROUNDING)[1])
        rotations.append(rotation_matrix(quaternion))
        world.append(position + ca.mtimes(rotations[-1], point))
    slip = (path_between(points, normals, rotations) - world[1] + world[0])[:2]
    kernel.constrain(limits.GROUND_NO_SLIP, slip)
    kernel.cost(contact.SLIP, slip / step)
    return kernel


@cache
def ground_wander() -> Kernel:
    """How much faster or slower the contact with the ground moves along the object from one interval to the next."""
    kernel = Kernel("ground_wander")
    points = [kernel.variable(f"point{i}", 3, "point", i) for i in range(3)]
    steps = [kernel.parameter(f"step{i}", 1, "step", i) for i in range(2)]
    before, after = (derivative(points[i : i + 2], steps[i : i + 1]) for i in range(2))
    kernel.cost(contact.GROUND_WANDER, after - before)
    return kernel


@cache
def object_apart(kinds: tuple[type[Body], ...], grounded: bool) -> Kernel:
    """The object clear of the palm, and above the ground if there is one, at one knot."""
    kernel = Kernel("object_apart")
    pose = kernel.variable("pose", 6)
    reference, palm_position, palm_quaternion = (
        kernel.parameter(n, k) for n, k in (("reference", 4), ("palm_position", 3), ("palm_quaternion", 4))
    )
    palm_radius, ground = kernel.parameter("palm_radius"), kernel.parameter("ground_height")
    bodies = surfaces(kinds, kernel.parameter("bodies", width_of(kinds)))
    position, quaternion = placed(pose, reference)
    rotation, to_palm = rotation_matrix(quaternion), rotation_matrix(conjugate(palm_quaternion))
    palm, above = [], []
    for each in bodies:
        core = each.core.mapped(lambda point: position + ca.mtimes(rotation, point))
        for point in core.marks(to_palm[2, :].T):
            seen = ca.mtimes(to_palm, point - palm_position)
            palm.append(point_disc_distance(seen, palm_radius) - each.radius)
        above += [point[2] - each.radius - ground for point in core.lowest(SX([0, 0, 1]))]
    kernel.constrain(limits.CLEAR_OF_PALM, ca.vertcat(*palm))
    if grounded:
        kernel.constrain(limits.ABOVE_GROUND, ca.vertcat(*above))
    return kernel


@cache
def tool_point() -> Kernel:
    """How far (3,) the object's tool is from where it must be at one knot of a drawing."""
    kernel = Kernel("tool_point")
    pose = kernel.variable("pose", 6)
    reference, tool, target = (
        kernel.parameter("reference", 4),
        kernel.parameter("tool", 3),
        kernel.parameter("target", 3),
    )
    position, quaternion = placed(pose, reference)
    off = position + ca.mtimes(rotation_matrix(quaternion), tool) - target
    kernel.constrain(limits.ON_PATH, off)
    kernel.cost(body.GOAL, off)
    return kernel
