"""The task in the numbers the stages work in: lengths by the object's half extent, forces by m·g, seconds.

The only place where SI units turn into nondimensional ones (method notes: weights only make sense so).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from casadi_hands.geometry import nearest_on_axis
from casadi_hands.motion import Schedule, eased, held, linear
from casadi_hands.task import Task

Array = NDArray[np.float64]
STANDARD_GRAVITY = 9.81  # m/s², sets the force unit where a task has none
_WITHIN = 0.9 / math.sqrt(3)  # share of a limit that each of three coordinates may use
# Half extents. Beyond these a gap is no contact, and slip would need friction on its cone, whatever a task accepts.
_MOST_GAP, _MOST_SLIP = 2e-4, 2e-3
_NO_GROUND = -1e3  # half extents
_DIGITS = 12  # significant digits kept, so that scaled tasks give the very same numbers


@dataclass(frozen=True)
class Units:
    """Size of one nondimensional unit in SI.

    Attributes:
        length: m.
        force: N.
        gravity: m/s², force over mass.
    """

    length: float
    force: float
    gravity: float

    @property
    def torque(self) -> float:
        """N·m."""
        return self.force * self.length

    @property
    def inertial(self) -> float:
        """Length over gravity, s²: what turns lengths/s² into m·g."""
        return float(round_off(self.length / self.gravity))


@dataclass(frozen=True)
class Ground:
    """A horizontal plane; ``patch`` is where on the object it may touch, (3,) object frame."""

    height: float
    friction: float
    patch: Array
    capsule: Array


@dataclass(frozen=True)
class Regrasp:
    """Contacts that are to move on the object, planned: fingers lift and touch again elsewhere, or slide there.

    Attributes:
        lifted: (N, C) bool, from its keyframe to the next; the ground's contact, if any, last.
        patches: (N, C, 3) where contacts are wanted at the keyframes, object frame.
    """

    lifted: NDArray[np.bool_]
    patches: Array


@dataclass(frozen=True)
class PalmPath:
    """The palm's motion as the task gives it: straight from waypoint to waypoint, at rest at each.

    Attributes:
        times: (W,) s.
        positions: (W, 3) world.
        rotations: (W, 3, 3) world from palm.
    """

    times: Array
    positions: Array
    rotations: Array

    def at(self, times: Array) -> Array:
        """Positions and quaternions [w, x, y, z] (T, 7) at times (T,) in s."""
        if len(self.times) == 1:
            return np.tile(np.append(self.positions[0], quaternion(self.rotations[0])), (len(times), 1))
        weights = linear(self.times, eased(self.times, times))
        turns = [pin.Quaternion(rotation) for rotation in self.rotations]
        quaternions = []
        for row in weights:
            later = int(np.flatnonzero(row)[-1])
            turned = turns[max(later - 1, 0)].slerp(float(row[later]), turns[later])
            quaternions.append(quaternion(turned.matrix()))
        return np.hstack([round_off(weights @ self.positions), quaternions])


@dataclass(frozen=True)
class Model:
    """Everything the stages need of a task, nondimensional; arrays are read only by agreement.

    Attributes:
        units: of all numbers here.
        schedule: keyframes and samples, s.
        gravity: (3,) weight in m·g.
        inertia: (3, 3) object frame, in m·length².
        primitives: (K, 7) start, end, radius of the object's capsules, object frame.
        contact_names: of the C contacts.
        patches: (C, 3) the user's contact points, object frame.
        capsules: (C, 7) the primitive each contact lies on.
        friction: of fingertip and object.
        ground: or None.
        palm_radius: of the disc.
        palm_position: (S, 3) world, at the samples.
        palm_quaternion: (S, 4) world from palm, [w, x, y, z].
        palm_path: where they come from.
        goal_positions: (G, 3) world; for a drawing the tool's targets.
        goal_vectors: (G, 3) rotation vectors from the reference orientation, world; zeros for a drawing.
        goal_tolerance: half extents and rad, what each coordinate may miss a goal by within the task's limits.
        gap_tolerance: half extents, a part of the task's limit that a contact's surfaces may be apart.
        slip_tolerance: half extents, a part of the task's limit that a contact may slip from touch to lift.
        reference: (4,) quaternion of the reference orientation.
        tool: (3,) object frame, or None when goals are poses.
        perturbation_force: (S, 3) m·g, world.
        perturbation_torque: (S, 3) m·g·length, world.
        link_radius: of all links.
        link_length: shortest and longest link.
        joint_limits: lower and upper, rad.
        torque_limit: of a joint in m·g·length, or inf.
        speed_limit: of a joint in rad/s, or inf.
        regrasp: planned, or None where fingers stay where they touch.
    """

    units: Units
    schedule: Schedule
    gravity: Array
    inertia: Array
    primitives: Array
    contact_names: tuple[str, ...]
    patches: Array
    capsules: Array
    friction: float
    ground: Ground | None
    palm_radius: float
    palm_position: Array
    palm_quaternion: Array
    palm_path: PalmPath
    goal_positions: Array
    goal_vectors: Array
    goal_tolerance: tuple[float, float]
    gap_tolerance: float
    slip_tolerance: float
    reference: Array
    tool: Array | None
    perturbation_force: Array
    perturbation_torque: Array
    link_radius: float
    link_length: tuple[float, float]
    joint_limits: tuple[float, float]
    torque_limit: float
    speed_limit: float
    regrasp: Regrasp | None = None

    @property
    def contacts(self) -> int:
        """Number of finger contacts."""
        return len(self.contact_names)

    @property
    def keyframe_patches(self) -> Array:
        """(N, C, 3) where contacts are wanted at the keyframes, object frame; the ground's, if any, last."""
        if self.regrasp is not None:
            return self.regrasp.patches
        patches = self.patches if self.ground is None else np.vstack([self.patches, self.ground.patch])
        return np.tile(patches, (len(self.schedule.keyframes), 1, 1))

    @property
    def ground_height(self) -> float:
        """Of the ground, or a height that no object reaches where there is none."""
        return _NO_GROUND if self.ground is None else self.ground.height

    def slides(self, contact: int) -> bool:
        """Whether a finger's contact is planned to move on the object without lifting."""
        if self.regrasp is None or self.lifts(contact):
            return False
        return bool(np.any(self.regrasp.patches[:, contact] != self.regrasp.patches[0, contact]))

    def lifts(self, contact: int) -> bool:
        """Whether a finger's contact is planned to lift and touch the object anew."""
        return self.regrasp is not None and bool(self.regrasp.lifted[:, contact].any())

    @property
    def held_back(self) -> bool:
        """Whether contacts are planned to stay behind while the object turns on beneath fingers that cannot let go."""
        return self.regrasp is not None and not self.regrasp.lifted.any()

    def point_spline(self, contact: int, offset: float = 0.0) -> Array:
        """(S, N) weights of a contact point at the samples, ``offset`` steps later.

        Around a planned regrasp it stays where it lifts and where it touches, and has not moved before it touches.
        """
        schedule = self.schedule
        if self.regrasp is None:
            return schedule.spline(offset)
        lifted = self.regrasp.lifted[:, contact]
        ends = np.union1d(np.flatnonzero(lifted), np.flatnonzero(lifted) + 1)
        weights = schedule.spline(offset, ends)
        now, then = (held(schedule.keyframes, schedule.samples + o * schedule.step) for o in (0.0, offset))
        touched = lifted[then] & ~lifted[now]
        weights[touched] = schedule.spline(0.0, ends)[touched]
        return weights

    @property
    def goal_poses(self) -> Array:
        """(G, 6) position and rotation vector from the reference at the goals, world."""
        return np.hstack([self.goal_positions, self.goal_vectors])

    @property
    def perturbed(self) -> bool:
        """Whether the task asks for a second scenario with external wrenches."""
        return bool(np.any(self.perturbation_force) or np.any(self.perturbation_torque))


def round_off(value: Any) -> Any:
    """Numbers to 12 significant digits."""
    array = np.asarray(value, float)
    magnitude = np.where(array == 0, 1.0, 10.0 ** np.floor(np.log10(np.abs(np.where(array == 0, 1.0, array)))))
    rounded = np.round(array / magnitude, _DIGITS) * magnitude
    return float(rounded) if array.ndim == 0 else rounded


def quaternion(rotation: ArrayLike) -> Array:
    """Unit quaternion [w, x, y, z] of a rotation matrix (3, 3)."""
    x, y, z, w = pin.Quaternion(np.asarray(rotation, float)).coeffs()
    return np.array([w, x, y, z]) * (1.0 if w >= 0 else -1.0)


def build_model(task: Task) -> Model:
    """Turn a task into nondimensional numbers."""
    gravity_size = float(np.linalg.norm(task.gravity))
    acceleration = gravity_size if gravity_size > 0 else STANDARD_GRAVITY
    length = task.object.half_extent
    units = Units(length, task.object.mass * acceleration, acceleration)
    times, places, turns = zip(*task.palm.waypoints, strict=True)
    goal_times = [goal.at for goal in task.motion]
    schedule = Schedule.of(goal_times, task.duration, task.keyframes_between, task.time_step, times)
    primitives = np.array([[*np.ravel(s.segment), s.radius] for s in task.object.shapes]) / length
    patches = np.array([finger.touches for finger in task.fingers.values()]) / length
    positions, vectors, reference = _goals(task)
    palm_path = PalmPath(np.array(times), round_off(np.array(places) / length), np.array(turns))
    palm = palm_path.at(schedule.samples)
    forces, torques = _perturbations(task, schedule)
    ground = None
    if task.ground is not None:
        patch = np.asarray(task.ground.touches, float) / length
        capsule = _nearest_primitive(patch, primitives)
        height = round_off(task.ground.height / length)
        ground = Ground(height, task.ground.friction, round_off(patch), round_off(capsule))
    actuator = task.actuator
    low, high = task.hand.joint_limits
    return Model(
        units=units,
        schedule=schedule,
        gravity=round_off(np.asarray(task.gravity) / acceleration),
        inertia=round_off(np.asarray(task.object.inertia) / (task.object.mass * length**2)),
        primitives=round_off(primitives),
        contact_names=tuple(task.fingers),
        patches=round_off(patches),
        capsules=round_off(np.array([_nearest_primitive(p, primitives) for p in patches])),
        friction=task.friction,
        ground=ground,
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
        perturbation_force=round_off(forces / units.force),
        perturbation_torque=round_off(torques / units.torque),
        link_radius=round_off(task.hand.link_radius / length),
        link_length=(round_off(task.hand.link_length[0] / length), round_off(task.hand.link_length[1] / length)),
        joint_limits=(math.radians(low), math.radians(high)),
        torque_limit=math.inf if actuator is None else round_off(actuator.torque / units.torque),
        speed_limit=math.inf if actuator is None else actuator.speed,
    )


def palm_from_world(model: Model, time: float) -> tuple[Array, Array]:
    """Rotation (3, 3) palm <- world and the palm's position (3,) in the world at a time."""
    sample = int(np.argmin(np.abs(model.schedule.samples - time)))
    return pin.Quaternion(*model.palm_quaternion[sample]).matrix().T, model.palm_position[sample]


def _nearest_primitive(point: Array, primitives: Array) -> Array:
    """The primitive (7,) whose surface is nearest to a point."""

    def distance(primitive: Array) -> float:
        return abs(float(np.linalg.norm(nearest_on_axis(point, primitive)[1])) - float(primitive[6]))

    return np.asarray(min(primitives, key=distance))


def _goals(task: Task) -> tuple[Array, Array, Array]:
    """Goal positions (m), rotation vectors from the reference, and the reference quaternion."""
    if task.draws:
        points = np.array([goal.tool_at for goal in task.motion], float)
        return points, np.zeros((len(points), 3)), np.array([1.0, 0.0, 0.0, 0.0])
    positions = np.array([goal.position for goal in task.motion], float)
    return positions, task.goal_turns(), quaternion(task.motion[0].rotation.matrix)


def _perturbations(task: Task, schedule: Schedule) -> tuple[Array, Array]:
    """External force (S, 3) in N and torque (S, 3) in N·m at the samples."""
    forces, torques = np.zeros((2, len(schedule.samples), 3))
    for push in task.perturbations:
        during = (schedule.samples >= push.start - 1e-9) & (schedule.samples <= push.end + 1e-9)
        if not during.any():  # a short one between two samples
            during[np.argmin(np.abs(schedule.samples - (push.start + push.end) / 2))] = True
        forces[during] += np.asarray(push.force)
        torques[during] += np.asarray(push.torque)
    return forces, torques
