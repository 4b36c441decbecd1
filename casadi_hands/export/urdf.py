"""The hand and the object as URDF: spheres, cylinders and boxes; what is convex in files beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.export.markup import (
    OBJECT_COLOR,
    PALM_COLOR,
    PIN_COLOR,
    SERVO_COLOR,
    Color,
    document,
    finger_color,
    joint_color,
    number,
    numbers,
)
from casadi_hands.export.meshes import mesh_path, object_solids, of_raw_meshes, polytopes
from casadi_hands.geometry.bodies import Solid
from casadi_hands.problem.inertia import Case, Inertial, body_inertials, servo_cases

if TYPE_CHECKING:
    from casadi_hands.problem.hand import Finger, Hand, Link
    from casadi_hands.task import Task

_UPRIGHT = 1e-12  # of a unit vector, what no direction can be read off


def hand_urdf(hand: Hand, world: tuple[Sequence[float], Sequence[float]] | None = None) -> str:
    """The hand as URDF text.

    Link ``palm`` is the palm frame; ``finger{i}_link{j}`` has its origin at its joint and z along the segment. At
    zero angles it is turned from the frame of its parent by the link's bend.

    Args:
        hand: the designed hand.
        world: position (3,), m, and orientation [w, x, y, z] of a palm that is fixed to a link ``world``; without, the
            palm is the root.
    """
    robot = _robot("hand")
    if world is not None:
        position, orientation = world
        SubElement(robot, "link", name="world")
        fixed = SubElement(robot, "joint", name="world_to_palm", type="fixed")
        SubElement(fixed, "parent", link="world")
        SubElement(fixed, "child", link="palm")
        turn = Rotation.from_quat(orientation, scalar_first=True).as_matrix()
        SubElement(fixed, "origin", xyz=numbers(position), rpy=numbers(_roll_pitch_yaw(turn)))
    palm, inertials, cases = SubElement(robot, "link", name="palm"), body_inertials(hand), servo_cases(hand)
    _add_inertial(palm, inertials["palm"])
    middle = np.array([0.0, 0.0, -hand.palm_thickness / 2])
    for role in ("visual", "collision"):
        _add_shape(palm, role, _cylinder(hand.palm_radius, hand.palm_thickness), middle, (0.0, 0.0, 0.0), PALM_COLOR)
    for ball in hand.palm_balls:
        _add_solid(palm, ball, PALM_COLOR, PALM_COLOR)
    for i, finger in enumerate(hand.fingers):
        _add_finger(robot, hand, i, finger, inertials)
    for link in robot.findall("link"):
        for case in cases.get(link.get("name", ""), ()):
            _add_case(link, case)
    for j, name in enumerate(hand.joint_names):
        if hand.drive is None or hand.drive.leader(j) is None:
            _add_transmission(robot, name)
    return document(robot)


def object_urdf(task: Task) -> str:
    """The task's object as URDF text: one link ``object`` whose frame is the object frame.

    It looks like the meshes that it was made of, where those are known, and collides as their convex parts do.

    Args:
        task: its object gives shapes, mass and inertia.
    """
    robot = _robot("object", meshes=bool(polytopes(task)))
    link = SubElement(robot, "link", name="object")
    body = task.object
    _add_inertial(link, Inertial(body.mass, np.asarray(body.center_of_mass), np.asarray(body.inertia)))
    raw = of_raw_meshes(task)
    for path in dict.fromkeys(raw.values()):
        mesh = Element("mesh", filename=path)
        _add_shape(link, "visual", mesh, np.zeros(3), (0.0, 0.0, 0.0), OBJECT_COLOR)
    for name, solid in object_solids(task).items():
        if solid.kind == "convex":
            for role in ("collision",) if name in raw else ("visual", "collision"):
                mesh = Element("mesh", filename=mesh_path(name))
                _add_shape(link, role, mesh, np.zeros(3), (0.0, 0.0, 0.0), OBJECT_COLOR)
        else:
            _add_solid(link, solid, OBJECT_COLOR, OBJECT_COLOR)
    return document(robot)


def _roll_pitch_yaw(turn: np.ndarray) -> tuple[float, float, float]:
    """URDF's angles, rad, of a rotation (3, 3); where x points straight up or down the yaw, then free, is 0."""
    level = float(np.hypot(turn[0, 0], turn[1, 0]))
    yaw = float(np.arctan2(turn[1, 0], turn[0, 0])) if level > _UPRIGHT else 0.0
    across = np.array([-np.sin(yaw), np.cos(yaw), 0.0]) @ turn  # (0, cos roll, -sin roll)
    return float(np.arctan2(-across[2], across[1])), float(np.arctan2(-turn[2, 0], level)), yaw


def _robot(name: str, meshes: bool = False) -> Element:
    """An empty robot; MuJoCo would otherwise merge the root link into its world and drop its mass.

    Args:
        name: of it.
        meshes: whether it has files of meshes, whose folder MuJoCo would otherwise leave out.
    """
    robot = Element("robot", name=name)
    compiler = {"fusestatic": "false"} | ({"strippath": "false"} if meshes else {})
    SubElement(SubElement(robot, "mujoco"), "compiler", compiler)
    return robot


def _add_finger(robot: Element, hand: Hand, i: int, finger: Finger, inertials: Mapping[str, Inertial]) -> None:
    """Add one finger's joints and links; `i` is its place in the hand."""
    parent, origin = "palm", np.asarray(finger.base)
    for j, link in enumerate(finger.links):
        name = f"finger{i}_link{j}"
        joint = SubElement(robot, "joint", name=f"finger{i}_joint{j}", type="revolute")
        SubElement(joint, "parent", link=parent)
        SubElement(joint, "child", link=name)
        SubElement(joint, "origin", xyz=numbers(origin), rpy=_bend(link))
        SubElement(joint, "axis", xyz=numbers(link.axis))
        SubElement(
            joint,
            "limit",
            lower=number(hand.joint_lower),
            upper=number(hand.joint_upper),
            effort=number(hand.effort),
            velocity=number(hand.velocity),
        )
        _add_mimic(joint, hand, f"finger{i}_joint{j}")
        body = SubElement(robot, "link", name=name)
        _add_inertial(body, inertials[name])
        _add_solid(body, link.solid, finger_color(i), joint_color(i))
        if link.hinge:
            _add_hinge(body, link, finger.links[max(j - 1, 0)].radius, joint_color(i))
        parent, origin = name, np.array([0.0, 0.0, link.length])


def _add_hinge(body: Element, link: Link, size: float, color: Color) -> None:
    """Add a link's tongue, up to its joint, and the pin that it turns on: looked at, but in the body before.

    Args:
        body: the link's element.
        link: whose hinge it is.
        size: radius of the body before, m.
        color: of the tongue.
    """
    axis = 1.2 * size * np.asarray(link.axis)
    for start, end, radius, shown in (
        (np.zeros(3), link.solid.start, 0.6 * size, color),
        (-axis, axis, 0.25 * size, PIN_COLOR),
    ):
        along, length = end - start, float(np.linalg.norm(end - start))
        _add_shape(body, "visual", _cylinder(radius, length), (start + end) / 2, _pointing(along), shown)


def _pointing(axis: np.ndarray) -> tuple[float, float, float]:
    """URDF's angles of a frame whose z points along an axis (3,)."""
    return 0.0, float(np.arctan2(np.hypot(axis[0], axis[1]), axis[2])), float(np.arctan2(axis[1], axis[0]))


def _bend(link: Link) -> str:
    """URDF's angles of how a link is bent from the one before."""
    return numbers(_roll_pitch_yaw(link.turn.as_matrix())) if any(link.bend) else "0 0 0"


def _add_case(link: Element, case: Case) -> None:
    """Add a servo's case, which is looked at and does not collide: at its joint it is in the links that it turns."""
    turn = _roll_pitch_yaw(case.turn)
    _add_shape(link, "visual", Element("box", size=numbers(case.size)), case.center, turn, SERVO_COLOR)


def _add_mimic(joint: Element, hand: Hand, name: str) -> None:
    """Say which joint this one follows, where one motor turns both: so do their commands, springs in between."""
    found = None if hand.drive is None else hand.drive.leader(hand.joint_names.index(name))
    if found is not None:
        first, multiplier, offset = found
        leader = hand.joint_names[first]
        SubElement(joint, "mimic", joint=leader, multiplier=number(multiplier), offset=number(offset))


def _add_transmission(robot: Element, joint: str) -> None:
    """Add a motor that turns the joint one to one; what reads no transmissions takes the joint's limits."""
    transmission = SubElement(robot, "transmission", name=f"{joint}_transmission")
    SubElement(transmission, "type").text = "transmission_interface/SimpleTransmission"
    driven = SubElement(transmission, "joint", name=joint)
    SubElement(driven, "hardwareInterface").text = "hardware_interface/PositionJointInterface"
    motor = SubElement(transmission, "actuator", name=f"{joint}_motor")
    SubElement(motor, "mechanicalReduction").text = "1"


def _add_inertial(link: Element, inertial: Inertial) -> None:
    """Add mass, centre of mass and inertia."""
    element = SubElement(link, "inertial")
    SubElement(element, "origin", xyz=numbers(inertial.center), rpy="0 0 0")
    SubElement(element, "mass", value=number(inertial.mass))
    axes = "xyz"
    entries = {f"i{axes[a]}{axes[b]}": number(inertial.inertia[a, b]) for a in range(3) for b in range(a, 3)}
    SubElement(element, "inertia", entries)


def _add_solid(link: Element, solid: Solid, color: Color, end_color: Color) -> None:
    """Add a solid; a capsule as cylinder and two spheres."""
    if solid.kind == "box":
        for role in ("visual", "collision"):
            box = Element("box", size=numbers(solid.size))
            _add_shape(link, role, box, solid.start, _roll_pitch_yaw(solid.turn), color)
        return
    start, end, radius = solid.start, solid.end, solid.radius
    axis = end - start
    length = float(np.linalg.norm(axis))
    rotation = _pointing(axis)
    for role in ("visual", "collision"):
        if solid.kind != "cylinder":
            _add_shape(link, role, _sphere(radius), start, rotation, end_color)
        if solid.kind != "sphere":
            _add_shape(link, role, _cylinder(radius, length), (start + end) / 2, rotation, color)
        if solid.kind == "capsule":
            _add_shape(link, role, _sphere(radius), end, rotation, end_color)


def _add_shape(
    link: Element, role: str, shape: Element, center: np.ndarray, rotation: tuple[float, float, float], color: Color
) -> None:
    """Add one primitive; `rotation` is URDF's roll, pitch, yaw in rad."""
    element = SubElement(link, role)
    SubElement(element, "origin", xyz=numbers(center), rpy=numbers(rotation))
    SubElement(element, "geometry").append(shape)
    if role == "visual":
        name = "color_" + "_".join(f"{round(255 * part):03d}" for part in color)
        SubElement(SubElement(element, "material", name=name), "color", rgba=numbers((*color, 1.0)))


def _sphere(radius: float) -> Element:
    return Element("sphere", radius=number(radius))


def _cylinder(radius: float, length: float) -> Element:
    return Element("cylinder", radius=number(radius), length=number(length))
