"""The whole scene as MJCF for MuJoCo: hand on its base, object, ground, one position actuator a motor.

Choices a reader of the file should know:

- **Palm.** A palm that stands still is a fixed body. A palm that moves is a free body welded to the mocap body
  ``palm_target``: whoever replays the motion moves the target. A mocap palm alone would have no velocity in the
  solver's eyes, and friction would hold the object back.
- **Contact.** Elliptic cones, four dimensions. The task's friction holds wherever the object touches the hand, the
  ground's wherever anything touches the ground. Fingertips are soft: they have the task's torsional friction, and give
  like rubber (see `casadi_hands.export.compliance`). Creep, an artefact of MuJoCo's regularised friction, is held down
  by ``impratio`` and the no-slip pass.
- **Motors.** See `casadi_hands.problem.motors`; torque is limited to the hand's effort. The hand carries its own weight
  (``gravcomp``), as a controller that knows its hand does. Targets are not clamped, so that a feed-forward torque can
  be given as an offset of the target (see `casadi_hands.export.commands`).
- **Shared motors.** Where motors share joints, each is a hinge of its own, ``motor{m}``, with a stiff position
  actuator. A fixed tendon pulls at every joint, by the joint's spring and damper, to where the motors turn it, and as
  hard at the motors, by virtual work.
- **Object.** It is free, or hangs on its joint, ``object``, with friction (``frictionloss``), spring and damper; of a
  thread an equation keeps the pitch between that and a second one, ``object_along``.
- **Start.** Bodies stand as at the motion's first sample, whose joint angles are the joints' reference: what loads the
  scene and resets nothing finds no finger in the object.
- **Collisions.** Neighbours in a chain, the palm and first links among them, do not collide; all else does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.export.attached import add_joints, couple, object_coordinates
from casadi_hands.export.commands import commanded
from casadi_hands.export.compliance import IMPEDANCE, contact_time
from casadi_hands.export.markup import (
    GROUND_COLOR,
    OBJECT_COLOR,
    PALM_COLOR,
    document,
    finger_color,
    number,
    numbers,
)
from casadi_hands.export.meshes import object_solids
from casadi_hands.export.mjcf_solids import add_inertial, add_meshes, add_solid
from casadi_hands.export.shared_motors import add_motors
from casadi_hands.problem.inertia import Inertial, body_inertials
from casadi_hands.problem.motors import Motor, joint_motors, shared_motors

if TYPE_CHECKING:
    from casadi_hands.problem.hand import Finger, Hand
    from casadi_hands.problem.motion import Motion
    from casadi_hands.task import Ground, Task

_TIME_STEP = 0.001  # s
_IMPRATIO, _NO_SLIP = "100", "20"  # harder friction changes little any more (``scripts/creep.py``)
_SOFTNESS = 0.02  # depth over which a contact stiffens, of the characteristic length
_STILL = 1e-9  # a palm that moves less, relative to its size (or in its quaternion), stands still


def scene_mjcf(task: Task, hand: Hand, motion: Motion) -> str:
    """The scene as MJCF text, as it stands at the motion's first sample.

    The keyframes ``start`` and ``goal1``, ``goal2``, … hold the poses at the first sample and at the task's goals, and
    the commands that press there as planned.

    Args:
        task: gives the object, gravity, friction, ground.
        hand: the designed hand.
        motion: its first sample places palm, joints and object; it also says whether the palm moves. Without commands
            it is given them.
    """
    if motion.joint_commands is None:
        motion = commanded(task, hand, motion)
    moves = _palm_moves(hand, motion)
    motors = joint_motors(task, hand)
    root = Element("mujoco", model=task.name)
    _add_settings(root, task, contact_time(task, hand, motion, motors, moves, 2 * _TIME_STEP))
    add_meshes(root, task)
    world = SubElement(root, "worldbody")
    SubElement(world, "light", pos=numbers(motion.object_position[0] + [0, 0, 20 * task.object.characteristic_length]))
    if task.ground is not None:
        _add_ground(world, task.ground, task.object.characteristic_length)
    _add_hand(world, task, hand, motion, motors, moves)
    _add_object(world, task, motion)
    contact = SubElement(root, "contact")
    for first, second in neighbours(hand):
        SubElement(contact, "exclude", body1=first, body2=second)
    if moves:
        weld = {"body1": "palm_target", "body2": "palm", "solref": number(2.5 * _TIME_STEP) + " 1"}
        SubElement(SubElement(root, "equality"), "weld", weld)
    couple(root, task.object.attached)
    if hand.drive is None:
        _add_actuators(root, hand.joint_names, motors, hand.effort)
    else:
        shared = shared_motors(task, hand)
        add_motors(world, root, hand, motors, shared)
        _add_actuators(root, hand.drive.names, shared, hand.drive.effort)
    _add_keyframes(root, task, motion, moves)
    return document(root)


def neighbours(hand: Hand) -> tuple[tuple[str, str], ...]:
    """Pairs of links that share a joint, by name, from the palm outwards."""
    pairs = []
    for i, finger in enumerate(hand.fingers):
        chain = ["palm", *(f"finger{i}_link{j}" for j in range(len(finger.links)))]
        pairs += list(pairwise(chain))
    return tuple(pairs)


def _palm_moves(hand: Hand, motion: Motion) -> bool:
    """Whether the palm's pose changes over the motion."""
    shift = np.abs(motion.base_position - motion.base_position[0]).max() / hand.palm_radius
    # q and -q are one orientation, so compare the size of the inner product with 1.
    turn = 1 - np.abs(motion.base_orientation @ motion.base_orientation[0]).min()
    return bool(shift > _STILL or turn > _STILL)


def _add_settings(root: Element, task: Task, give: float) -> None:
    """Add solver options and the defaults of contacts, whose time constant is ``give`` (s)."""
    SubElement(root, "compiler", angle="radian")
    SubElement(
        root,
        "option",
        timestep=number(_TIME_STEP),
        gravity=numbers(task.gravity),
        integrator="implicitfast",
        cone="elliptic",
        impratio=_IMPRATIO,
        noslip_iterations=_NO_SLIP,
    )
    extent = 8 * task.object.characteristic_length
    center = task.palm.position
    SubElement(root, "statistic", extent=number(extent), center=numbers(center), meansize=number(extent / 20))
    geom = {
        "condim": "4",
        "solref": f"{number(give)} 1",
        "solimp": numbers((*IMPEDANCE, _SOFTNESS * task.object.characteristic_length)),
    }
    SubElement(SubElement(root, "default"), "geom", geom)


def _friction(task: Task) -> str:
    """Sliding, torsional and rolling coefficient of a contact with a fingertip."""
    return numbers((task.friction, task.fingertip.torsion, 0.0))


def _add_ground(world: Element, ground: Ground, spacing: float) -> None:
    """Add the ground plane; its friction takes precedence over that of whatever touches it.

    Its lines are drawn `spacing` (m) apart.
    """
    SubElement(
        world,
        "geom",
        name="ground",
        type="plane",
        pos=numbers((0.0, 0.0, ground.height)),
        size=numbers((0.0, 0.0, spacing)),
        friction=numbers((ground.friction, 0.0, 0.0)),
        condim="3",
        priority="2",
        rgba=numbers((*GROUND_COLOR, 1.0)),
    )


def _add_object(world: Element, task: Task, motion: Motion) -> None:
    """Add the object, free or on its joint, at its first pose; its friction takes precedence over the hand's."""
    start, item = (
        {"pos": numbers(motion.object_position[0]), "quat": numbers(motion.object_orientation[0])},
        task.object,
    )
    body = SubElement(world, "body", start, name="object")
    add_joints(body, item.attached, motion)
    add_inertial(body, Inertial(item.mass, np.asarray(item.center_of_mass), np.asarray(item.inertia)))
    for name, solid in object_solids(task).items():
        geom = {"name": name, "priority": "1", "friction": _friction(task)}
        add_solid(body, geom, solid, OBJECT_COLOR)


def _add_hand(world: Element, task: Task, hand: Hand, motion: Motion, motors: tuple[Motor, ...], moves: bool) -> None:
    """Add the palm at its first pose and the fingers on it."""
    start = {"pos": numbers(motion.base_position[0]), "quat": numbers(motion.base_orientation[0])}
    if moves:
        SubElement(world, "body", start, name="palm_target", mocap="true")
    palm = SubElement(world, "body", start, name="palm", gravcomp="1")
    if moves:
        SubElement(palm, "freejoint", name="palm")
    inertials = body_inertials(hand)
    add_inertial(palm, inertials["palm"])
    friction = _friction(task)
    SubElement(
        palm,
        "geom",
        name="palm",
        type="cylinder",
        pos=numbers((0.0, 0.0, -hand.palm_thickness / 2)),
        size=numbers((hand.palm_radius, hand.palm_thickness / 2)),
        friction=friction,
        rgba=numbers((*PALM_COLOR, 1.0)),
    )
    for k, ball in enumerate(hand.palm_balls):
        add_solid(palm, {"name": f"palm_ball{k}", "friction": friction}, ball, PALM_COLOR)
    remaining = iter(motors)
    for i, finger in enumerate(hand.fingers):
        names = [f"finger{i}_joint{j}" for j in range(len(finger.links))]
        joints = [(next(remaining), motion.joint_angles[0, motion.joint_names.index(name)]) for name in names]
        _add_finger(palm, hand, i, finger, joints, friction, inertials)


def _add_finger(
    palm: Element,
    hand: Hand,
    i: int,
    finger: Finger,
    joints: list[tuple[Motor, float]],
    friction: str,
    inertials: Mapping[str, Inertial],
) -> None:
    """Add one finger as a chain of nested bodies, turned as at the start.

    Args:
        palm: the body it stands on.
        hand: it belongs to.
        i: its place in the hand.
        finger: its links.
        joints: motor and angle at the start, rad, of each joint.
        friction: of its surface.
        inertials: of the hand's bodies, by name.
    """
    parent, origin = palm, np.asarray(finger.base)
    for j, (link, (motor, angle)) in enumerate(zip(finger.links, joints, strict=True)):
        name = f"finger{i}_link{j}"
        # A turn about its own axis leaves the axis where it is, so that it is the URDF's.
        turn = (link.turn * Rotation.from_rotvec(angle * np.asarray(link.axis))).as_quat(scalar_first=True)
        body = SubElement(parent, "body", name=name, pos=numbers(origin), quat=numbers(turn), gravcomp="1")
        SubElement(
            body,
            "joint",
            name=f"finger{i}_joint{j}",
            axis=numbers(link.axis),
            ref=number(angle),
            limited="true",
            range=numbers((hand.joint_lower, hand.joint_upper)),
            armature=number(motor.armature),
        )
        add_inertial(body, inertials[name])
        add_solid(body, {"name": name, "friction": friction}, link.solid, finger_color(i))
        parent, origin = body, link.solid.end


def _add_actuators(root: Element, joints: Sequence[str], motors: tuple[Motor, ...], effort: float) -> None:
    """Add a position actuator for every joint or, where these share motors, every motor, named as what it turns."""
    actuators = SubElement(root, "actuator")
    for name, motor in zip(joints, motors, strict=True):
        SubElement(
            actuators,
            "position",
            name=name,
            joint=name,
            kp=number(motor.stiffness),
            kv=number(motor.damping),
            forcelimited="true",
            forcerange=numbers((-effort, effort)),
        )


def _add_keyframes(root: Element, task: Task, motion: Motion, moves: bool) -> None:
    """Add the keyframes of start and goals; MuJoCo orders coordinates as the bodies stand in the file."""
    assert motion.joint_commands is not None
    parent = SubElement(root, "keyframe")
    moments = {"start": 0.0, **{f"goal{n}": goal.at for n, goal in enumerate(task.motion, start=1)}}
    for name, time in moments.items():
        k = int(np.argmin(np.abs(motion.time - time)))
        base = (*motion.base_position[k], *motion.base_orientation[k]) if moves else ()
        key = {"name": name, "time": number(motion.time[k])}
        shared = () if motion.motor_positions is None else motion.motor_positions[k]
        key["qpos"] = numbers((*base, *motion.joint_angles[k], *object_coordinates(task, motion, k), *shared))
        key["ctrl"] = numbers(motion.joint_commands[k] if motion.motor_positions is None else shared)
        if moves:
            key["mpos"], key["mquat"] = numbers(base[:3]), numbers(base[3:])
        SubElement(parent, "key", key)
