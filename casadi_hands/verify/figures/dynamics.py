"""Does the object's motion follow from the forces stated for it?

Between samples the file says nothing, so physics fills the gap: contact forces, moments and points are linear in the
object's frame from a sample's row to the next (a contact that is not active at the sample bears nothing until the
next), the external force and torque are linear in the world, gravity is constant. From every sample the object is
shot to the next: the launch velocity is the one that makes it arrive at the next sample's pose. In an exact motion the
velocity it arrives with is the one it is launched with again. The jump between them is an impulse nobody stated;
divided by the time between samples it is the residual force (over m·g) and torque (over m·g·l).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.verify.held import held
from casadi_hands.verify.reading.folder import Folder

AT_REST = 1e-4
"""Of the unit of speed: an object that moves so slowly is at rest, with a few billionths of its weight's energy."""
FARTHEST_SHOT = 2 * np.pi
"""rad that a shot may be corrected by."""
FASTEST = 100.0
"""rad from one sample to the next, to which rates are cut: faster ones would overflow."""
SUBSTEPS = 8
"""Runge-Kutta steps from one sample to the next; at 0.1 s the integration error is far below 1e-9 m·g."""


@dataclass(frozen=True)
class Shots:
    """The object's physics between samples, ``K = S - 1`` intervals.

    Attributes:
        launch_velocity, arrival_velocity: (K, 3) m/s, world.
        launch_rate, arrival_rate: (K, 3) rad/s, the object's angular velocity in its own frame.
    """

    launch_velocity: np.ndarray
    arrival_velocity: np.ndarray
    launch_rate: np.ndarray
    arrival_rate: np.ndarray


@dataclass(frozen=True)
class Loads:
    """What acts on the object in each of K intervals; every pair is (at its start, at its end).

    Attributes:
        time: (K,) s, lengths of the intervals.
        force: two (K, C, 3) contact forces in the object's frame, N.
        point: two (K, C, 3) contact points in the object's frame, m.
        moment: two (K, 3) torsional moments of all contacts together in the object's frame, N·m.
        external_force, external_torque: two (K, 3) in the world, N and N·m.
    """

    time: np.ndarray
    force: tuple[np.ndarray, np.ndarray]
    point: tuple[np.ndarray, np.ndarray]
    moment: tuple[np.ndarray, np.ndarray]
    external_force: tuple[np.ndarray, np.ndarray]
    external_torque: tuple[np.ndarray, np.ndarray]

    def at(self, fraction: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return total contact force and moment (K, 3), object frame, and external force and torque (K, 3), world."""
        force, point = _blend(self.force, fraction), _blend(self.point, fraction)
        moment = np.cross(point, force).sum(axis=1) + _blend(self.moment, fraction)
        return (
            force.sum(axis=1),
            moment,
            _blend(self.external_force, fraction),
            _blend(self.external_torque, fraction),
        )


def _blend(pair: tuple[np.ndarray, np.ndarray], fraction: float) -> np.ndarray:
    return (1.0 - fraction) * pair[0] + fraction * pair[1]


def object_rotation(folder: Folder) -> Rotation:
    """Return the object's S orientations, normalised."""
    return Rotation.from_quat(folder.motion.object_orientation, scalar_first=True)


def read_loads(folder: Folder) -> Loads:
    """Return what the file states to act on the object between samples."""
    motion = folder.motion
    turned = np.swapaxes(object_rotation(folder).as_matrix(), 1, 2)
    force = np.einsum("sij,scj->sci", turned, motion.contact_force)
    active = motion.contact_active[:-1, :, None]
    point = motion.contact_point_object
    moment = np.zeros_like(force) if motion.contact_moment is None else motion.contact_moment
    moment = np.einsum("sij,scj->sci", turned, moment)
    return Loads(
        time=np.diff(motion.time),
        force=(force[:-1] * active, force[1:] * active),
        point=(point[:-1], point[1:]),
        moment=((moment[:-1] * active).sum(axis=1), (moment[1:] * active).sum(axis=1)),
        external_force=(motion.external_force[:-1], motion.external_force[1:]),
        external_torque=(motion.external_torque[:-1], motion.external_torque[1:]),
    )


def shoot(folder: Folder) -> Shots:
    """Shoot the object from every sample to the next under the stated forces.

    Where they whirl it so that no shot arrives, it is launched at its mean rate; rates then jump by all that is wrong.
    """
    loads, rotation = read_loads(folder), object_rotation(folder)
    start, end, time = rotation[:-1], rotation[1:], loads.time[:, None]
    mean = rate = (start.inv() * end).as_rotvec() / time
    lost = np.zeros(len(rate), bool)
    for _ in range(20):
        miss, jacobian = _miss(folder, loads, start, end, rate)
        # A shot that is whirled as fast as can be arrives alike, however it is launched.
        deaf = np.linalg.det(jacobian) == 0
        step = np.linalg.solve(np.where(deaf[:, None, None], np.eye(3), jacobian), miss[..., None])[..., 0]
        lost |= deaf
        lost |= np.linalg.norm(step * time, axis=1) > FARTHEST_SHOT
        rate = np.where(lost[:, None], mean, rate - step)
        if np.max(np.abs(step * time)[~lost], initial=0.0) < 1e-14:
            break
    travelled, gained, arrival_rate, _ = _integrate(folder, loads, start, rate)
    launch = (np.diff(folder.motion.object_position, axis=0) - travelled) / time
    return Shots(launch, launch + gained, rate, arrival_rate)


def _miss(
    folder: Folder, loads: Loads, start: Rotation, end: Rotation, rate: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return by how much (K, 3) the shots miss the next orientation, and its Jacobian (K, 3, 3) in the launch rate."""
    step = 1e-4
    # The seven shots of all intervals at once: many small arrays take longer than a large one.
    rates = rate + step * np.vstack([np.zeros((1, 3)), np.eye(3), -np.eye(3)])[:, None]
    arrived = _integrate(folder, loads, start, rates)[3]
    # SciPy before 1.17 has rotations in a row only.
    row = Rotation.from_quat(arrived.reshape(-1, 4), scalar_first=True)
    miss = (Rotation.concatenate([end.inv()] * len(rates)) * row).as_rotvec().reshape(rates.shape)
    return miss[0], np.moveaxis((miss[1:4] - miss[4:]) / (2 * step), 0, -1)


def _integrate(
    folder: Folder, loads: Loads, start: Rotation, rate: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Integrate all intervals at once from rest at the origin with launch rates (..., K, 3).

    Returns:
        distance travelled and velocity gained in the world, arrival rate, each as ``rate``, and arrival orientation
        (..., K, 4), [w, x, y, z].
    """
    mass, inertia = folder.object.mass, folder.object.inertia
    inverse, fastest = np.linalg.inv(inertia), FASTEST / loads.time[:, None]

    def slope(fraction: float, state: np.ndarray) -> np.ndarray:
        velocity, quaternion, omega = state[..., 3:6], state[..., 6:10], np.clip(state[..., 10:13], -fastest, fastest)
        turn = _matrices(quaternion)
        force, moment, external_force, external_torque = loads.at(fraction)
        acceleration = folder.gravity + ((turn @ force[..., None])[..., 0] + external_force) / mass
        torque = moment + (external_torque[..., None, :] @ turn)[..., 0, :] - np.cross(omega, omega @ inertia)
        return np.concatenate([velocity, acceleration, _quaternion_rate(quaternion, omega), torque @ inverse], axis=-1)

    quaternion = np.broadcast_to(start.as_quat(scalar_first=True), (*rate.shape[:-1], 4))
    state = np.concatenate([np.zeros((*rate.shape[:-1], 6)), quaternion, rate], axis=-1)
    step, share = loads.time[:, None] / SUBSTEPS, 1.0 / SUBSTEPS
    for i in range(SUBSTEPS):
        at = i * share
        k1 = slope(at, state)
        k2 = slope(at + share / 2, state + step / 2 * k1)
        k3 = slope(at + share / 2, state + step / 2 * k2)
        k4 = slope(at + share, state + step * k3)
        state = state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return state[..., :3], state[..., 3:6], state[..., 10:13], state[..., 6:10]


def _matrices(quaternion: np.ndarray) -> np.ndarray:
    """Return the rotation matrices (..., 3, 3) of quaternions (..., 4), which are normalised first."""
    row = Rotation.from_quat(quaternion.reshape(-1, 4), scalar_first=True).as_matrix()
    matrices: np.ndarray = row.reshape(*quaternion.shape[:-1], 3, 3)
    return matrices


def _quaternion_rate(quaternion: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Return dq/dt (..., 4) of unit quaternions [w, x, y, z] turning at body rates (..., 3)."""
    w, v = quaternion[..., :1], quaternion[..., 1:]
    turned = -np.sum(v * omega, axis=-1, keepdims=True)
    return 0.5 * np.concatenate([turned, w * omega + np.cross(v, omega)], axis=-1)


def end_speeds(folder: Folder, shots: Shots) -> np.ndarray:
    """Return the speeds (2,) of the object's fastest point at the motion's start and end, m/s."""
    velocities = np.linalg.norm([shots.launch_velocity[0], shots.arrival_velocity[-1]], axis=1)
    rates = np.linalg.norm([shots.launch_rate[0], shots.arrival_rate[-1]], axis=1)
    speeds: np.ndarray = velocities + folder.length * rates
    return speeds


def still(folder: Folder) -> float:
    """Return the speed, m/s, up to which the object is at rest."""
    return AT_REST * folder.speed_unit


def sample_residual(folder: Folder, shots: Shots) -> tuple[np.ndarray, np.ndarray]:
    """Return the residual force over m·g and torque over m·g·l at the S - 2 inner samples, each (S - 2,)."""
    time = 0.5 * (np.diff(folder.motion.time)[1:] + np.diff(folder.motion.time)[:-1])
    jump = shots.launch_velocity[1:] - shots.arrival_velocity[:-1]
    spin = (shots.launch_rate[1:] - shots.arrival_rate[:-1]) @ folder.object.inertia
    force = folder.object.mass * np.linalg.norm(jump, axis=1) / time / folder.weight
    torque = np.linalg.norm(spin, axis=1) / time / (folder.weight * folder.length)
    return force, torque


def between_residual(folder: Folder) -> np.ndarray:
    """Return the largest residual torque over m·g·l inside each of the K intervals, (K,).

    The shots apply each force on the chord between two stored contact points; the real contact stays on the surface.
    What the same forces turn more or less there is what the file leaves unsaid between its samples.
    """
    loads = read_loads(folder)
    worst, joint = np.zeros(len(loads.time)), held(folder)
    for fraction in (0.25, 0.5, 0.75):
        force, chord = _blend(loads.force, fraction), _blend(loads.point, fraction)
        surface = np.array([[folder.object.project(point) for point in row] for row in chord])
        more = np.cross(surface - chord, force).sum(axis=1)
        torque = np.linalg.norm(more, axis=1) if joint is None else np.abs(more @ joint.twist[3:])
        worst = np.maximum(worst, torque / (folder.weight * folder.length))
    return worst
