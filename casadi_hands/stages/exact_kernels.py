"""The blocks of the refine stage: physics between knots, contact, rolling, clearance, all to be met exactly."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
from casadi import SX

from casadi_hands.geometry import norm
from casadi_hands.motion import conjugate, multiply, rotation_matrix
from casadi_hands.nlp import Kernel
from casadi_hands.stages.finger_symbols import FingerSymbols, PlacedFinger, morphology
from casadi_hands.stages.hand_kernels import distances
from casadi_hands.stages.kernels import placed
from casadi_hands.terms import clearance, finger

SUBSTEPS = 4  # of the integration between two knots
LEVER_DAMPING = 0.04  # half extents/rad: forces that need a shorter lever than about this count as not supplied
_KINK = 1e-3  # smoothing of a capsule's change from cylinder to cap, relative to its length


def free_morphology(kernel: Kernel, joints: int, tag: str = "") -> FingerSymbols:
    """A finger whose morphology is variables: base, lengths, axis coordinates; its seed frames are a parameter."""
    return morphology(kernel.variable, kernel.parameter(f"frames{tag}", 9 * joints), joints, tag)


def smooth_surface(point: SX, start: SX, end: SX, radius: SX) -> tuple[SX, SX]:
    """Signed distance and outward normal (3,) of a capsule whose kink is rounded; all in one frame."""
    along = end - start
    t = ca.dot(point - start, along) / (ca.sumsqr(along) + 1e-9)
    t = (ca.sqrt(t**2 + _KINK**2) - ca.sqrt((t - 1) ** 2 + _KINK**2) + 1) / 2
    offset = point - start - t * along
    distance = norm(offset, 1e-6)
    return distance - radius, offset / distance


def tangents(normal: SX, helper: SX) -> tuple[SX, SX]:
    """Two unit vectors (3,) across a unit normal; ``helper`` (3,) must not be near it."""
    first = ca.cross(helper, normal)
    first = first / norm(first, 1e-9)
    return first, ca.cross(normal, first)


def wrench(contacts: int) -> Kernel:
    """The contacts' force and torque at a knot, as variables of their own: physics then knows no contacts."""
    kernel = Kernel("wrench")
    total = kernel.variable("total", 6)
    points, forces = _contacts(kernel, contacts, "")
    kernel.constrain("sum", ca.vertcat(ca.sum2(forces), _torque(points, forces)) - total)
    return kernel


def middle_torque(contacts: int) -> Kernel:
    """The contacts' torque halfway between two knots, with forces and points linear in the object's frame."""
    kernel = Kernel("middle_torque")
    middle = kernel.variable("middle", 3)
    ends = [_contacts(kernel, contacts, str(i)) for i in range(2)]
    points, forces = ((ends[0][i] + ends[1][i]) / 2 for i in range(2))
    kernel.constrain("sum", _torque(points, forces) - middle)
    return kernel


def _contacts(kernel: Kernel, contacts: int, tag: str) -> tuple[SX, SX]:
    """Declare the points and forces (3, C) of all contacts."""
    points, forces = (kernel.variable(name + tag, 3 * contacts) for name in ("points", "forces"))
    return ca.reshape(points, 3, contacts), ca.reshape(forces, 3, contacts)


def _torque(points: SX, forces: SX) -> SX:
    return sum((ca.cross(points[:, i], forces[:, i]) for i in range(points.shape[1])), SX.zeros(3, 1))


def physics() -> Kernel:
    """Newton–Euler from one knot to the next by RK4; forces and contact points linear in the object's frame.

    The force is then linear in time and the torque quadratic: both ends and the middle say all of it.
    """
    kernel = Kernel("physics")
    states = [(kernel.variable(f"pose{i}", 6), kernel.variable(f"rate{i}", 6)) for i in range(2)]
    wrenches = [kernel.variable(f"wrench{i}", 6) for i in range(2)]
    middle = kernel.variable("middle", 3)
    reference, step = kernel.parameter("reference", 4), kernel.parameter("step")
    gravity, inertial = kernel.parameter("gravity", 3), kernel.parameter("inertial")
    inertia = ca.reshape(kernel.parameter("inertia", 9), 3, 3)
    inverse = ca.reshape(kernel.parameter("inverse", 9), 3, 3)

    def derivative(state: SX, s: float) -> SX:
        quaternion, velocity, omega = state[3:7], state[7:10], state[10:13]
        force = (1 - s) * wrenches[0][:3] + s * wrenches[1][:3]
        ends = (1 - s) * (1 - 2 * s) * wrenches[0][3:] + s * (2 * s - 1) * wrenches[1][3:]
        torque = ends + 4 * s * (1 - s) * middle
        total = ca.mtimes(rotation_matrix(quaternion), force) + gravity
        alpha = ca.mtimes(inverse, torque / inertial - ca.cross(omega, ca.mtimes(inertia, omega)))
        spin = multiply(quaternion, ca.vertcat(0, omega)) / 2
        return ca.vertcat(velocity, spin, total / inertial, alpha)

    position, quaternion = placed(states[0][0], reference)
    state, h = ca.vertcat(position, quaternion, states[0][1]), step / SUBSTEPS
    for i in range(SUBSTEPS):
        s, ds = i / SUBSTEPS, 1 / SUBSTEPS
        k1 = derivative(state, s)
        k2 = derivative(state + h / 2 * k1, s + ds / 2)
        k3 = derivative(state + h / 2 * k2, s + ds / 2)
        k4 = derivative(state + h * k3, s + ds)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    position, quaternion = placed(states[1][0], reference)
    turned = 2 * multiply(conjugate(state[3:7]), quaternion)[1:]
    kernel.cost("object_acceleration", (states[1][1] - states[0][1]) / step)
    kernel.constrain("defect", ca.vertcat(position - state[:3], turned, states[1][1] - state[7:]))
    return kernel


@dataclass(frozen=True)
class Touch:
    """A contact seen from both bodies at one knot; vectors in the palm frame unless said otherwise.

    Attributes:
        on_link: (3,) the contact in the last link's frame.
        off_object, off_link: signed distances of the contact from the two surfaces.
        normal: (3,) outward from the object, object frame.
        link_normal: (3,) outward from the link, in the object's frame.
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
    capsule: SX
    radius: SX

    @classmethod
    def declare(cls, kernel: Kernel, tag: str = "") -> Scene:
        """Declare them in a kernel; ``reference``, ``capsule`` and ``radius`` first."""
        names = (("reference", 4), ("palm_position", 3), ("palm_quaternion", 4), ("capsule", 7), ("radius", 1))
        return cls(*[kernel.parameter(name + tag, size) for name, size in names])

    def touch(self, pose: SX, point: SX, angles: SX, symbols: FingerSymbols) -> Touch:
        """See a contact point (3,), object frame, from the object and from a finger's last link."""
        position, quaternion = placed(pose, self.reference)
        to_palm = rotation_matrix(conjugate(self.palm_quaternion))
        rotation = ca.mtimes(to_palm, rotation_matrix(quaternion))
        in_palm = ca.mtimes(rotation, point) + ca.mtimes(to_palm, position - self.palm_position)
        skeleton = symbols.placed(angles)
        on_link = ca.mtimes(skeleton.tip_rotation.T, in_palm - skeleton.origins[:, -1])
        off_object, normal = smooth_surface(point, self.capsule[:3], self.capsule[3:6], self.capsule[6])
        end = ca.vertcat(0, 0, symbols.lengths[-1])
        off_link, link_normal = smooth_surface(on_link, SX.zeros(3, 1), end, self.radius)
        in_object = ca.mtimes(rotation.T, ca.mtimes(skeleton.tip_rotation, link_normal))
        here = symbols.placed(angles, on_link)
        return Touch(on_link, off_object, off_link, normal, in_object, rotation, here)


def contact(joints: int, index: int, limited: bool) -> Kernel:
    """One touching contact at one knot: on both surfaces, normals opposed, in the cone, supplied by the joints.

    Constraints: ``on_surfaces`` (2), ``opposed`` (2), ``facing`` (1: cosine between the outward normals),
    ``pressing`` (1: normal force), ``cone`` (1: (μ f_n)² - f_t²), ``passive`` (3: force no joint supplies),
    and where the task limits it ``torque`` (n).
    """
    kernel = Kernel(f"contact{index}")
    symbols = free_morphology(kernel, joints)
    pose, point, force = kernel.variable("pose", 6), kernel.variable("point", 3), kernel.variable("force", 3)
    angles = kernel.variable("angles", joints)
    scene = Scene.declare(kernel)
    helper, friction = kernel.parameter("helper", 3), kernel.parameter("friction")
    wanted_point, wanted_force = kernel.parameter("wanted_point", 3), kernel.parameter("wanted_force", 3)
    touch = scene.touch(pose, point, angles, symbols)
    first, second = tangents(touch.normal, helper)
    kernel.constrain("on_surfaces", ca.vertcat(touch.off_object, touch.off_link))
    kernel.constrain("opposed", ca.vertcat(ca.dot(first, touch.link_normal), ca.dot(second, touch.link_normal)))
    kernel.constrain("facing", ca.dot(touch.normal, touch.link_normal))
    pressing = -ca.dot(force, touch.normal)
    kernel.constrain("pressing", pressing)
    across = ca.dot(force, first) ** 2 + ca.dot(force, second) ** 2
    kernel.constrain("cone", (friction * pressing) ** 2 - across)
    in_palm = ca.mtimes(touch.rotation, force)
    passive = finger.null_space_force(touch.placed.jacobian, in_palm, LEVER_DAMPING)
    kernel.constrain("passive", passive)
    if limited:
        kernel.constrain("torque", ca.mtimes(touch.placed.jacobian.T, in_palm))
    kernel.cost("passive_force", passive)
    kernel.cost("stay_point", point - wanted_point)
    kernel.cost("stay_force", force - wanted_force)
    kernel.cost("friction_margin", across / (friction * pressing + 0.1) ** 2)
    return kernel


def rolling(joints: int, index: int) -> Kernel:
    """One contact from one knot to the next: its paths over both surfaces agree (no slip), and its spin costs.

    With the contact on both surfaces at both knots, no slip is to second order in the step
    (R_k + R_k+1) Δr = (F_k + F_k+1) Δp, r over the object and p over the link.
    """
    kernel = Kernel(f"rolling{index}")
    symbols = free_morphology(kernel, joints)
    poses, points, angles = [], [], []
    for i in range(2):
        poses.append(kernel.variable(f"pose{i}", 6))
        points.append(kernel.variable(f"point{i}", 3))
        angles.append(kernel.variable(f"angles{i}", joints))
    scenes = [Scene.declare(kernel, str(i)) for i in range(2)]
    helper, step = kernel.parameter("helper", 3), kernel.parameter("step")
    before, after = (scenes[i].touch(poses[i], points[i], angles[i], symbols) for i in range(2))
    over_object = ca.mtimes(before.rotation + after.rotation, points[1] - points[0]) / 2
    turn = before.placed.tip_rotation + after.placed.tip_rotation
    over_link = ca.mtimes(turn, after.on_link - before.on_link) / 2
    first, second = (ca.mtimes(before.rotation, t) for t in tangents(before.normal, helper))
    slip = ca.vertcat(ca.dot(first, over_object - over_link), ca.dot(second, over_object - over_link))
    kernel.constrain("no_slip", slip)
    kernel.cost("slip", slip / step)
    relative_before = ca.mtimes(before.placed.tip_rotation.T, before.rotation)
    relative_after = ca.mtimes(after.placed.tip_rotation.T, after.rotation)
    change = ca.mtimes(relative_before.T, relative_after)
    turned = ca.vertcat(change[2, 1] - change[1, 2], change[0, 2] - change[2, 0], change[1, 0] - change[0, 1]) / 2
    kernel.cost("spin", ca.dot(turned, before.normal) / step)
    return kernel


def apart(joints: int, primitives: int, index: int, touched: int | None, grounded: bool) -> Kernel:
    """One finger clear of palm, ground, itself and the object at one time.

    Args:
        joints: of the finger.
        primitives: of the object.
        index: the contact.
        touched: the primitive the last link touches, left out; None where it must stay clear of all.
        grounded: whether there is a ground.
    """
    kernel = Kernel(f"apart{index}" if touched is None else f"apart_touching{index}")
    symbols = free_morphology(kernel, joints)
    pose, angles = kernel.variable("pose", 6), kernel.variable("angles", joints)
    reference, palm_position, palm_quaternion = (
        kernel.parameter(n, k) for n, k in (("reference", 4), ("palm_position", 3), ("palm_quaternion", 4))
    )
    radius, palm_radius, ground = (
        kernel.parameter("radius"),
        kernel.parameter("palm_radius"),
        kernel.parameter("ground"),
    )
    shapes = ca.reshape(kernel.parameter("primitives", 7 * primitives), 7, primitives)
    position, quaternion = placed(pose, reference)
    to_palm = rotation_matrix(conjugate(palm_quaternion))
    rotation, center = ca.mtimes(to_palm, rotation_matrix(quaternion)), ca.mtimes(to_palm, position - palm_position)
    seen = [
        ca.vertcat(
            ca.mtimes(rotation, shapes[:3, k]) + center, ca.mtimes(rotation, shapes[3:6, k]) + center, shapes[6, k]
        )
        for k in range(primitives)
    ]
    here = symbols.placed(angles)
    up = to_palm[:, 2] if grounded else None
    clear, last = distances(here, radius, palm_radius, ca.horzcat(*seen), up, ground - palm_position[2])
    others = [last[k] for k in range(primitives) if k != touched]
    kernel.constrain("clear", ca.vertcat(clear, *others))
    return kernel


def fingers_apart(joints: int, other_joints: int, tag: str) -> Kernel:
    """Two fingers clear of each other at one time."""
    kernel = Kernel(f"fingers_apart{tag}")
    first = free_morphology(kernel, joints, "_a")
    angles = kernel.variable("angles_a", joints)
    second = free_morphology(kernel, other_joints, "_b")
    other_angles = kernel.variable("angles_b", other_joints)
    radius = kernel.parameter("radius")
    kernel.constrain(
        "clear", clearance.links_and_links(first.placed(angles).ends, second.placed(other_angles).ends, radius)
    )
    return kernel


def joint_motion(joints: int, index: int, limited: bool) -> Kernel:
    """One finger's angles at three knots: smooth, and within the speed limit if there is one."""
    kernel = Kernel(f"joint_motion{index}")
    angles = [kernel.variable(f"angles{i}", joints) for i in range(3)]
    step = kernel.parameter("step")
    kernel.cost("joint_acceleration", (angles[2] - 2 * angles[1] + angles[0]) / step**2)
    if limited:
        kernel.constrain("speed", ca.vertcat(angles[1] - angles[0], angles[2] - angles[1]) / step)
    return kernel


def force_change(contacts: int) -> Kernel:
    """Change of the contact forces from one knot to the next."""
    kernel = Kernel("force_change")
    before, after = kernel.variable("before", 3 * contacts), kernel.variable("after", 3 * contacts)
    kernel.cost("force_change", after - before)
    return kernel


def stay(joints: int, index: int) -> Kernel:
    """A finger's morphology: short, on the palm, and near what the synthesis found."""
    kernel = Kernel(f"stay{index}")
    base, lengths, axes = (
        kernel.variable("base", 2),
        kernel.variable("lengths", joints),
        kernel.variable("axes", 2 * joints),
    )
    wanted = [kernel.parameter(n, k) for n, k in (("base", 2), ("lengths", joints), ("axes", 2 * joints))]
    kernel.cost("stay_design", ca.vertcat(base - wanted[0], lengths - wanted[1], axes - wanted[2]))
    kernel.constrain("on_palm", ca.sumsqr(base))
    return kernel


def stay_on_path() -> Kernel:
    """The object near the motion of the whole-hand stage at one knot."""
    kernel = Kernel("stay_path")
    pose, wanted = kernel.variable("pose", 6), kernel.parameter("wanted", 6)
    kernel.cost("stay_path", pose - wanted)
    return kernel
