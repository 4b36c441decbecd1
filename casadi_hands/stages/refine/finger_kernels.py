"""The fingers' blocks of the refine stage: contact, rolling, supply, clearance, all to be met exactly."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import casadi as ca
from casadi import SX

from casadi_hands.geometry import norm
from casadi_hands.geometry.bodies import Body, Surface, surfaces, width_of
from casadi_hands.geometry.bodies.capsule import Segment
from casadi_hands.geometry.surface import path_between, tangents
from casadi_hands.kinematics.singularity import MARGIN_SIZES, singularity_margin
from casadi_hands.kinematics.symbols import FingerSymbols, PlacedFinger, morphology, morphology_sizes
from casadi_hands.motion import conjugate, derivative, rotation_matrix
from casadi_hands.motion.pose import placed
from casadi_hands.nlp import Kernel
from casadi_hands.stages.whole_hand.kernels import distances
from casadi_hands.terms import clearance, finger
from casadi_hands.terms import constraints as limits
from casadi_hands.terms import contact as contact_terms

ROUNDING = 1e-6  # lengths, of distances where they vanish
LEAST_SINGULAR_VALUE = 0.06  # lengths/rad: forces along smaller singular values count as not actuated


def free_morphology(kernel: Kernel, joints: int, place: int | None = None) -> FingerSymbols:
    """A finger whose morphology is variables: base, lengths, axis coordinates, bends; its frames are a parameter."""
    frames = kernel.parameter("frames" if place is None else f"frames{place}", 9 * joints, "frames", place)
    return morphology(kernel.variable, frames, joints, place)


@dataclass(frozen=True)
class Touch:
    """A contact seen from both bodies at one knot; vectors in the palm frame unless said otherwise.

    Attributes:
        on_link: (3,) the contact in the last link's frame.
        off_object: signed distance of the contact from the object's surface.
        off_link: (3,) how far the link's axis is from its radius above the object's surface, object frame: zero
            where surfaces touch with opposed normals, and linear in where the link is, so that none ends up inside.
        normal: (3,) outward from the object, object frame.
        link_normal: (3,) outward from the link, link frame.
        rotation: (3, 3) object axes to palm axes.
        placed: the finger with the contact as its point.
    """

    on_link: SX
    off_object: SX
    off_link: SX
    normal: SX
    link_normal: SX
    rotation: SX
    placed: PlacedFinger


@dataclass(frozen=True)
class Scene:
    """Parameters that place object and palm at one knot."""

    reference: SX
    palm_position: SX
    palm_quaternion: SX
    body: Surface
    radii: tuple[SX, SX]
    hinge: SX

    @classmethod
    def declare(cls, kernel: Kernel, kind: type[Body], place: int | None = None) -> Scene:
        """Declare them in a kernel, for a contact on a body of a kind, at one of several knots if told so."""
        tag = "" if place is None else str(place)

        def declared(name: str, size: int) -> SX:
            return kernel.parameter(name + tag, size, name, place)

        reference, position, quaternion = (
            declared(n, k) for n, k in (("reference", 4), ("palm_position", 3), ("palm_quaternion", 4))
        )
        body = kind.surface(declared("body", kind.width))
        radii = declared("radius", 1), declared("tip_radius", 1)
        return cls(reference, position, quaternion, body, radii, declared("hinge", 1))

    def touch(self, pose: SX, point: SX, angles: SX, symbols: FingerSymbols) -> Touch:
        """See a contact point (3,), object frame, from the object and from a finger's last link."""
        position, quaternion = placed(pose, self.reference)
        to_palm = rotation_matrix(conjugate(self.palm_quaternion))
        rotation = ca.mtimes(to_palm, rotation_matrix(quaternion))
        in_palm = ca.mtimes(rotation, point) + ca.mtimes(to_palm, position - self.palm_position)
        skeleton = symbols.placed(angles, self.radii)
        on_link = ca.mtimes(skeleton.tip_rotation.T, in_palm - skeleton.origins[:, -1])
        off_object, normal = self.body.distance_and_normal(point, ROUNDING)
        axis = Segment(ca.vertcat(0, 0, self.hinge), ca.vertcat(0, 0, symbols.lengths[-1]))
        from_axis = axis.offset(on_link)
        from_link = ca.mtimes(rotation.T, ca.mtimes(skeleton.tip_rotation, from_axis))
        off_link = from_link + self.radii[1] * normal
        here = symbols.placed(angles, self.radii, on_link)
        return Touch(on_link, off_object, off_link, normal, from_axis / norm(from_axis, ROUNDING), rotation, here)


@cache
def contact(joints: int, kind: type[Body], limited: bool) -> Kernel:
    """One touching contact at one knot: on both surfaces, normals opposed, in the cone, actuated by the joints.

    Constraints: ``on_object`` (1), ``on_link`` (3: surface and normal, see ``Touch``), those of ``_hold`` and, of a
    finger whose joints can be singular, its ``singularity_margin`` (1) on the wanted side of zero.
    The cost of friction is the fourth power of the share in use.
    """
    kernel = Kernel("contact")
    symbols = free_morphology(kernel, joints)
    pose, point, force = kernel.variable("pose", 6), kernel.variable("point", 3), kernel.variable("force", 3)
    angles = kernel.variable("angles", joints)
    scene = Scene.declare(kernel, kind)
    friction, tie = kernel.parameter("friction"), kernel.parameter("tie")
    wanted_point, wanted_force = kernel.parameter("wanted_point", 3), kernel.parameter("wanted_force", 3)
    touch = scene.touch(pose, point, angles, symbols)
    if joints in MARGIN_SIZES:
        direction = kernel.parameter("margin_direction", MARGIN_SIZES[joints])
        kernel.constrain(limits.SINGULARITY_MARGIN, ca.dot(direction, singularity_margin(touch.placed.jacobian)))
    kernel.constrain(limits.ON_OBJECT, touch.off_object)
    kernel.constrain(limits.ON_LINK, touch.off_link)
    pressing, across, structural = _hold(kernel, touch, force, friction, limited)
    kernel.cost(finger.STRUCTURAL_FORCE, structural)
    kernel.cost(contact_terms.STAY_POINT, tie * (point - wanted_point))
    kernel.cost(contact_terms.STAY_FORCE, force - wanted_force)
    kernel.cost(contact_terms.GRIP, pressing)
    kernel.cost(contact_terms.FRICTION_MARGIN, contact_terms.friction_in_use(pressing, across, friction))
    return kernel


@cache
def disturbed_contact(joints: int, kind: type[Body], limited: bool) -> Kernel:
    """A second force of a touching contact at one knot: in the cone, and actuated by the joints, as the first."""
    kernel = Kernel("disturbed_contact")
    symbols = free_morphology(kernel, joints)
    pose, point, angles = kernel.variable("pose", 6), kernel.variable("point", 3), kernel.variable("angles", joints)
    force = kernel.variable("force", 3)
    scene, friction = Scene.declare(kernel, kind), kernel.parameter("friction")
    touch = scene.touch(pose, point, angles, symbols)
    _, _, structural = _hold(kernel, touch, force, friction, limited, disturbed=True)
    kernel.cost(finger.STRUCTURAL_FORCE, structural)
    return kernel


@cache
def actuated(joints: int, kind: type[Body]) -> Kernel:
    """A contact's force at any time: ``structural`` (3) is what no joint actuates of it."""
    kernel = Kernel("actuated")
    symbols = free_morphology(kernel, joints)
    pose, point, angles = kernel.variable("pose", 6), kernel.variable("point", 3), kernel.variable("angles", joints)
    force = kernel.variable("force", 3)
    structural = _structural(Scene.declare(kernel, kind).touch(pose, point, angles, symbols), force)
    kernel.constrain(limits.ACTUATED, structural)
    kernel.cost(finger.STRUCTURAL_FORCE, structural)
    return kernel


def _hold(
    kernel: Kernel, touch: Touch, force: SX, friction: SX, limited: bool, disturbed: bool = False
) -> tuple[SX, SX, SX]:
    """Constrain a contact force (3,), object frame; return its normal part, tangential square and structural part.

    Constraints: ``pressing`` (1: normal force), ``cone`` (1: (μ f_n)² - f_t²), ``structural`` (3: force no joint
    actuates), and where the task limits it ``torque`` (n).
    """
    pressing = -ca.dot(force, touch.normal)
    across = ca.sumsqr(force + pressing * touch.normal)
    kernel.constrain(limits.DISTURBED_PRESSING if disturbed else limits.PRESSING, pressing)
    cone = contact_terms.cone_margin_squared(pressing, across, friction)
    kernel.constrain(limits.DISTURBED_CONE if disturbed else limits.CONE, cone)
    structural = _structural(touch, force)
    kernel.constrain(limits.DISTURBED_ACTUATED if disturbed else limits.ACTUATED, structural)
    if limited:
        torque = ca.mtimes(touch.placed.jacobian.T, ca.mtimes(touch.rotation, force))
        kernel.constrain(limits.DISTURBED_TORQUE if disturbed else limits.WITHIN_TORQUE, torque)
    return pressing, across, structural


def _structural(touch: Touch, force: SX) -> SX:
    """The part (3,), palm frame, of a contact force, object frame, that no joint actuates."""
    return finger.structural_force(touch.placed.jacobian, ca.mtimes(touch.rotation, force), LEAST_SINGULAR_VALUE)


@cache
def rolling(joints: int, kind: type[Body], soft: bool = False, slides: bool = False) -> Kernel:
    """One contact from one knot to the next: no slip, or as a variable; its spin costs, of soft tips as one, too."""
    kernel = Kernel("rolling")
    symbols = free_morphology(kernel, joints)
    poses, points, angles = [], [], []
    for i in range(2):
        poses.append(kernel.variable(f"pose{i}", 6, "pose", i))
        points.append(kernel.variable(f"point{i}", 3, "point", i))
        angles.append(kernel.variable(f"angles{i}", joints, "angles", i))
    scenes = [Scene.declare(kernel, kind, i) for i in range(2)]
    helper, step = kernel.parameter("helper", 3), kernel.parameter("step")
    before, after = (scenes[i].touch(poses[i], points[i], angles[i], symbols) for i in range(2))
    turns = before.placed.tip_rotation, after.placed.tip_rotation
    over_object = path_between(points, (before.normal, after.normal), (before.rotation, after.rotation))
    over_link = path_between((before.on_link, after.on_link), (before.link_normal, after.link_normal), turns)
    first, second = (ca.mtimes(before.rotation, t) for t in tangents(before.normal, helper))
    slip = ca.vertcat(ca.dot(first, over_object - over_link), ca.dot(second, over_object - over_link))
    kernel.constrain(limits.NO_SLIP, slip)
    kernel.cost(contact_terms.SLIP, slip / step)
    if slides:
        kernel.constrain(limits.SLIP_RATE, slip / step - kernel.variable("slip", 2))
    relative = [ca.mtimes(touch.placed.tip_rotation.T, touch.rotation) for touch in (before, after)]
    spin = contact_terms.spin(ca.mtimes(relative[0].T, relative[1]), before.normal, step)
    kernel.cost(contact_terms.SPIN, contact_terms.pivoting(spin) if soft else spin)
    if soft:
        kernel.constrain(limits.SPIN_RATE, spin - kernel.variable("spin", 1))
    return kernel


@cache
def apart(
    joints: int, kinds: tuple[type[Body], ...], touched: int | None, grounded: bool, servos: bool = False
) -> Kernel:
    """One finger clear of palm, ground, itself and the object at one time.

    Args:
        joints: of the finger.
        kinds: of the object's bodies.
        touched: index of the body that the last link touches, left out; None where it must stay clear of all.
        grounded: whether there is a ground.
        servos: whether there is one in every joint, clear of all that it is not in.
    """
    kernel = Kernel("apart")
    symbols = free_morphology(kernel, joints)
    pose, angles = kernel.variable("pose", 6), kernel.variable("angles", joints)
    reference, palm_position, palm_quaternion = (
        kernel.parameter(n, k) for n, k in (("reference", 4), ("palm_position", 3), ("palm_quaternion", 4))
    )
    radii = kernel.parameter("radius"), kernel.parameter("tip_radius")
    palm_radius, ground = kernel.parameter("palm_radius"), kernel.parameter("ground_height")
    bodies = surfaces(kinds, kernel.parameter("bodies", width_of(kinds)))
    position, quaternion = placed(pose, reference)
    to_palm = rotation_matrix(conjugate(palm_quaternion))
    rotation, center = ca.mtimes(to_palm, rotation_matrix(quaternion)), ca.mtimes(to_palm, position - palm_position)
    seen = [body.mapped(lambda point: ca.mtimes(rotation, point) + center) for body in bodies]
    here = symbols.placed(angles, radii)
    up = to_palm[:, 2] if grounded else None
    servo = kernel.parameter("servo_radius") if servos else None
    clear, last = distances(here, palm_radius, seen, up, ground - palm_position[2], servo)
    others = [last[k] for k in range(len(kinds)) if k != touched]
    kernel.constrain(limits.CLEAR, ca.vertcat(clear, *others))
    if joints > 1:
        kernel.constrain(limits.UNFOLDED, clearance.unfolded(here.ends, radii[0]))
    return kernel


@cache
def fingers_apart(joints: int, other_joints: int, servos: bool = False) -> Kernel:
    """Two fingers, and servos in their joints if they have any, clear of each other at one time."""
    kernel = Kernel("fingers_apart")
    first = free_morphology(kernel, joints, 0)
    angles = kernel.variable("angles0", joints, "angles", 0)
    second = free_morphology(kernel, other_joints, 1)
    other_angles = kernel.variable("angles1", other_joints, "angles", 1)
    radii = kernel.parameter("radius"), kernel.parameter("tip_radius")
    servo = kernel.parameter("servo_radius") if servos else None
    links = first.placed(angles, radii).links, second.placed(other_angles, radii).links
    kernel.constrain(limits.CLEAR_OF_EACH_OTHER, clearance.two_fingers(*links, servo))
    return kernel


@cache
def joint_motion(joints: int, limited: bool) -> Kernel:
    """One finger's angles at three knots: smooth, and within the speed limit if there is one."""
    kernel = Kernel("joint_motion")
    angles = [kernel.variable(f"angles{i}", joints, "angles", i) for i in range(3)]
    steps = [kernel.parameter(f"step{i}", 1, "step", i) for i in range(2)]
    kernel.cost(finger.JOINT_ACCELERATION, derivative(angles, steps))
    if limited:
        kernel.constrain(limits.WITHIN_SPEED, ca.vertcat(*[(angles[i + 1] - angles[i]) / steps[i] for i in range(2)]))
    return kernel


@cache
def joint_jerk(joints: int) -> Kernel:
    """How the acceleration of one finger's joints changes over four knots.

    Between knots joints move on smooth curves, which leave the paths that roll where accelerations change abruptly.
    """
    kernel = Kernel("joint_jerk")
    angles = [kernel.variable(f"angles{i}", joints, "angles", i) for i in range(4)]
    kernel.cost(finger.JOINT_JERK, derivative(angles, [kernel.parameter(f"step{i}", 1, "step", i) for i in range(3)]))
    return kernel


@cache
def near_design(joints: int) -> Kernel:
    """A finger's morphology: short, on the palm, and near what the synthesis found."""
    kernel = Kernel("near_design")
    sizes = morphology_sizes(joints)
    shape = {name: kernel.variable(name, size) for name, size in sizes.items()}
    off = [shape[name] - kernel.parameter(f"wanted_{name}", size) for name, size in sizes.items()]
    kernel.cost(finger.STAY_DESIGN, ca.vertcat(*off))
    kernel.constrain(limits.ON_PALM, ca.sumsqr(shape["base"]))
    return kernel
