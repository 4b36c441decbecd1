"""Where SI and the stages' nondimensional numbers meet: tasks come in; hands and motions go out, and back in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from casadi_hands.geometry.bodies import Body
from casadi_hands.kinematics import STAND
from casadi_hands.kinematics.morphology import FingerSeed, frame_about
from casadi_hands.motion import Schedule, continuous
from casadi_hands.motion.quaternion import quaternion
from casadi_hands.problem.contacts import Contact
from casadi_hands.problem.hand import Finger, Hand, Link
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.holds import shortened_task
from casadi_hands.problem.loads import USUAL_FORCE, usual_force_limit
from casadi_hands.problem.model import Model
from casadi_hands.problem.motion import Motion
from casadi_hands.problem.outside import attached, attachment_of, exerted_of, scenarios_of
from casadi_hands.problem.palm_path import PalmPath
from casadi_hands.problem.placement import object_rotation, torques_in_all
from casadi_hands.problem.regrasp import asked_regrasp, regrasp_times
from casadi_hands.problem.units import STANDARD_GRAVITY, Units, round_off
from casadi_hands.task import Task
from casadi_hands.task.rotation import rotation_matrix

Array = NDArray[np.float64]
_WITHIN = 0.9 / math.sqrt(3)  # share of a limit that each of three coordinates may use
# Lengths: beyond these a gap is no contact, and slip would need friction on its cone, whatever a task accepts.
_MOST_GAP, _MOST_SLIP = 2e-4, 2e-3
# Accepted slip from which on it may be planned, m and lengths, and the share of it that may be.
_SLIDING, _FAR, _PLANNED = 1e-3, 0.02, 0.8


def build_model(task: Task, whole: bool = False) -> Model:
    """Turn a task into nondimensional numbers; contacts that are not placed yet are left out.

    Args:
        task: as loaded.
        whole: whether long stretches in which nothing happens are kept, too.
    """
    task, holds = (task, ()) if whole else shortened_task(task)
    gravity_size = float(np.linalg.norm(task.gravity))
    acceleration = gravity_size if gravity_size > 0 else STANDARD_GRAVITY
    if task.force_unit > task.object.mass * acceleration:
        acceleration = task.force_unit / task.object.mass
    length = task.object.characteristic_length
    units = Units(length, task.object.mass * acceleration, acceleration)
    times, places, turns = zip(*task.palm.waypoints, strict=True)
    goal_times = [goal.at for goal in task.motion]
    stops = [*times, *regrasp_times(task)]
    schedule = Schedule.of(goal_times, task.duration, task.keyframes_between, task.time_step, stops)
    schedule = replace(schedule, holds=holds)
    bodies = tuple(s.body.measured(lambda lengths: round_off(lengths / length)) for s in task.object.shapes)
    positions, vectors, reference = _goals(task)
    palm_path = PalmPath(np.array(times), round_off(np.array(places) / length), np.array(turns))
    palm = palm_path.at(schedule.samples)
    actuator = task.actuator
    low, high = task.hand.joint_limits
    given = task.hand.contact_force
    model = Model(
        units=units,
        schedule=schedule,
        gravity=round_off(np.asarray(task.gravity) / acceleration),
        inertia=round_off(np.asarray(task.object.inertia) / (task.object.mass * length**2)),
        bodies=bodies,
        contact_table=_contacts(task, bodies, length),
        ground=None if task.ground is None else round_off(task.ground.height / length),
        palm_radius=round_off(task.palm.radius / length),
        palm_position=palm[:, :3],
        palm_quaternion=palm[:, 3:],
        palm_path=palm_path,
        goal_positions=round_off(positions / length),
        goal_vectors=vectors,
        goal_tolerance=(
            round_off(_WITHIN * task.limits.goal_position / length),
            _WITHIN * math.radians(task.limits.goal_angle),
        ),
        gap_tolerance=round_off(min(0.2 * task.limits.gap / length, _MOST_GAP)),
        slip_tolerance=round_off(min(0.2 * task.limits.slip / length, _MOST_SLIP)),
        reference=reference,
        tool=None if not task.draws else round_off(np.asarray(task.tool) / length),
        scenarios=scenarios_of(task, schedule, units),
        exerted=exerted_of(task, units),
        link_radius=round_off(task.hand.link_radius / length),
        tip_radius=round_off(task.fingertip.radius / length),
        hinge=round_off(task.hand.hinge_of(task.fingertip.radius) / length),
        link_length=(round_off(task.hand.link_length[0] / length), round_off(task.hand.link_length[1] / length)),
        shortest_last=round_off(task.hand.shortest_of(task.fingertip.radius) / length),
        joint_limits=(math.radians(low), math.radians(high)),
        bend=math.radians(task.hand.bend),
        axis_cosines=_cosines(task.hand.axes.from_link),
        torque_limit=math.inf if actuator.torque is None else round_off(actuator.torque / units.torque),
        speed_limit=math.inf if actuator.speed is None else actuator.speed,
        stiffness=round_off(actuator.stiffness / units.torque),
        torsion=round_off(task.fingertip.torsion / length),
        sliding=_sliding(task.limits.slip, length),
        servo=round_off(task.hand.drive.motor.reach / length) if task.hand.drive.motor else 0.0,
        force_limit=given or USUAL_FORCE,
        clearance=round_off(task.hand.clearance / length),
        ratios=task.hand.ratios,
    )
    if task.object.attached is not None:
        model = attached(model, attachment_of(task, units, reference))
    regrasp = asked_regrasp(task, schedule, model.contact_names, model.patches, length)
    model = replace(model, regrasp=regrasp)
    return model if given or not task.is_placed else replace(model, force_limit=usual_force_limit(model))


def _cosines(degrees: tuple[float, float]) -> tuple[float, float]:
    """Least and largest cosine of angles between least and largest ones."""
    least, largest = (math.cos(math.radians(angle)) for angle in reversed(degrees))
    return (least if degrees[1] < 90 else 0.0), largest


def _sliding(slip: float, length: float) -> float:
    """Lengths of slip that may be planned where this slip, m, is accepted."""
    return round_off(_PLANNED * slip / length) if slip >= max(_SLIDING, _FAR * length) else 0.0


def _contacts(task: Task, bodies: Sequence[Body], length: float) -> tuple[Contact, ...]:
    """The fingers' contacts that are placed, then the ground's."""
    found = []
    for name, finger in task.fingers.items():
        if not finger.is_placed:
            continue
        patch = np.array(finger.point) / length
        found.append(Contact(name, round_off(patch), _nearest_body(patch, bodies), task.friction))
    if task.ground is not None:
        patch = np.asarray(task.ground.touches, float) / length
        body = _nearest_body(patch, bodies)
        found.append(Contact("ground", round_off(patch), body, task.ground.friction, finger=False))
    return tuple(found)


def _nearest_body(point: Array, bodies: Sequence[Body]) -> int:
    """Index of the body whose surface is nearest to a point (3,)."""
    return int(np.argmin([abs(body.signed_distance(point)) for body in bodies]))


def _goals(task: Task) -> tuple[Array, Array, Array]:
    """Goal positions (m), rotation vectors from the reference, and the reference quaternion."""
    if task.draws:
        points = np.array([goal.tool_at for goal in task.motion], float)
        return points, np.zeros((len(points), 3)), np.array([1.0, 0.0, 0.0, 0.0])
    positions, turns = np.array([goal.position for goal in task.motion], float), task.goal_turns()
    first = task.motion[0].rotation.matrix
    # Far about one axis, from the middle, so that all goals are where the exponential map's coordinates serve.
    middle = task.middle_turn
    return positions, turns - middle, quaternion(rotation_matrix(middle) @ first)


RESERVE = 1.5  # of torque and speed limits over what the motion uses, where the task names none
LEAST = 0.01  # of the object's weight × length, and rad/s: no joint is so weak or slow that none could drive it


def hand_of(
    task: Task, model: Model, fingers: Sequence[FingerSeed], contacts: Sequence[int], effort: float, speed: float
) -> Hand:
    """The hand in SI; limits of the actuator where the task names them, else 1.5 times what the motion uses.

    Args:
        task: for what the stages do not know.
        model: for the units.
        fingers: morphology, nondimensional.
        contacts: index of each finger's contact.
        effort: largest joint torque of the motion, N·m.
        speed: largest joint speed of the motion, rad/s.
    """
    length = model.units.length
    built = []
    for finger, contact in zip(fingers, contacts, strict=True):
        radii = model.radii(finger.joints)
        hinges = [task.hand.hinge_length] * (finger.joints - 1) + [task.hand.hinge_of(task.fingertip.radius)]
        links = tuple(
            Link(
                float(part * length),
                radius * length,
                _triple(a / np.linalg.norm(a)),
                (b[0], b[1]),
                hinge,
            )
            for part, radius, a, b, hinge in zip(
                finger.lengths, radii, finger.axis_vectors, finger.bends.tolist(), hinges, strict=True
            )
        )
        base = _triple(np.append(finger.base, STAND * radii[0]) * length)
        built.append(Finger(model.contact_names[contact], base, links))
    # A motor that joints share has other limits than they.
    named = (None, None) if model.motors else (task.actuator.torque, task.actuator.speed)
    return Hand(
        palm_radius=task.palm.radius,
        palm_thickness=task.palm.thickness,
        fingers=tuple(built),
        joint_lower=model.joint_limits[0],
        joint_upper=model.joint_limits[1],
        effort=named[0] or max(RESERVE * effort, LEAST * model.units.torque),
        velocity=named[1] or max(RESERVE * speed, LEAST),
        density=task.hand.density,
        servo=task.hand.drive.servo,
    )


def design_change(model: Model, before: WholeHand, after: WholeHand) -> dict[str, dict[str, float]]:
    """For each finger how far its base moved and its lengths changed at most, m, and its axes and bends, rad."""
    changes = {}
    for contact, old, new in zip(before.contacts, before.fingers, after.fingers, strict=True):
        cosines = np.clip((new.axis_vectors * old.axis_vectors).sum(axis=1), -1, 1)
        changes[model.contact_names[contact]] = {
            "base": float(np.linalg.norm(new.base - old.base)) * model.units.length,
            "lengths": float(np.abs(new.lengths - old.lengths).max()) * model.units.length,
            "axes": float(np.arccos(cosines).max()),
            "bends": float(np.linalg.norm(new.bends - old.bends, axis=1).max()),
        }
    return changes


def _triple(vector: Array) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z


def finger_from_si(finger: Finger, angles: Array, length: float) -> FingerSeed:
    """A finger in units of ``length`` (m), with its joint angles at the keyframes."""
    return FingerSeed(
        base=np.array(finger.base[:2]) / length,
        lengths=np.array([link.length for link in finger.links]) / length,
        frames=np.array([frame_about(np.array(link.axis)) for link in finger.links]),
        axes=np.zeros((len(finger.links), 2)),
        bends=np.array([link.bend for link in finger.links]),
        angles=angles,
        tips=np.zeros((0, 2)),
    )


def motion_from_si(motion: Motion, length: float, force: float) -> Motion:
    """A motion's lengths in units of ``length`` (m) and forces in units of ``force`` (N); nothing else changes."""
    return replace(
        motion,
        object_position=motion.object_position / length,
        base_position=motion.base_position / length,
        contact_point_object=motion.contact_point_object / length,
        contact_point_link=motion.contact_point_link / length,
        contact_force=motion.contact_force / force,
    )


def motion_in_si(
    model: Model,
    position: Array,
    vector: Array,
    palm_position: Array,
    palm_quaternion: Array,
    angles: Array,
    joint_names: tuple[str, ...],
    contact_names: tuple[str, ...],
    contact_link: Sequence[str],
    active: NDArray[np.bool_],
    force: Array,
    point: Array,
    on_link: Array,
) -> Motion:
    """Dress nondimensional arrays as a ``Motion`` in SI, forces turned into the world."""
    units = model.units
    rotations = np.array([object_rotation(model, v) for v in vector])
    scale = np.full(len(contact_names), units.length)
    return Motion(
        time=model.schedule.samples,
        object_position=position * units.length,
        object_orientation=continuous(np.array([quaternion(r) for r in rotations])),
        base_position=palm_position * units.length,
        base_orientation=continuous(palm_quaternion),
        joint_angles=angles,
        joint_names=joint_names,
        contact_names=contact_names,
        contact_link=tuple(contact_link),
        contact_active=active,
        contact_force=np.einsum("sij,scj->sci", rotations, force) * units.force,
        contact_point_object=point * units.length,
        contact_point_link=on_link * scale[None, :, None],
        external_force=model.scenarios[0].force * units.force,
        external_torque=model.scenarios[0].torque * units.torque,
    )


def joint_loads(model: Model, result: WholeHand) -> tuple[float, float]:
    """Largest joint torque (N·m, from forces and moments of contacts, disturbed ones too) and speed (rad/s)."""
    steps = np.diff(model.schedule.samples)[:, None]
    speed = max((float(np.abs(np.diff(angles, axis=0) / steps).max()) for angles in result.angles), default=0.0)
    torque = float(np.abs(torques_in_all(model, result)).max()) if result.fingers else 0.0
    return torque * model.units.torque, speed
