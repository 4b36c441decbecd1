"""The whole scene between samples: every body's placement at dense times.

The object moves by the velocities its physics gives it at the samples, the palm by velocities read off five samples,
both cubic in between. The joints move as a smooth
controller would move them: a twice differentiable cubic spline through the samples of every joint, one spline for each
stretch in which the finger's contacts neither begin nor end, because there its speed may jump. Where the object is at
rest at the motion's first or last sample, so are the joints.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from casadi_hands.verify.figures.dynamics import Shots, end_speeds, object_rotation, still
from casadi_hands.verify.reading.folder import Folder

DENSITY = 8
"""Dense times from a sample to the next: 12.5 ms apart at 0.1 s."""


@dataclass(frozen=True)
class Trajectory:
    """Dense placements, ``T`` times.

    Attributes:
        time: (T,) s.
        interval: (T,) index of the sample each time belongs to; the last time belongs to the last interval.
        joints, speeds: (T, J) rad and rad/s, in the order of the motion's joint names.
        placed: body name (links, ``object``, ``ground``) -> rotations (T, 3, 3) and positions (T, 3) in the world.
    """

    time: np.ndarray
    interval: np.ndarray
    joints: np.ndarray
    speeds: np.ndarray
    placed: dict[str, tuple[np.ndarray, np.ndarray]]

    def at(self, body: str, index: int) -> tuple[np.ndarray, np.ndarray]:
        """Return rotation (3, 3) and position (3,) of a body in the world at a dense time."""
        rotation, position = self.placed[body]
        return rotation[index], position[index]


def build_trajectory(folder: Folder, shots: Shots) -> Trajectory:
    """Place every body of the folder at dense times."""
    samples = folder.motion.time
    steps = np.diff(samples)
    count = len(steps)
    fraction = np.tile(np.arange(DENSITY) / DENSITY, count)
    interval = np.append(np.repeat(np.arange(count), DENSITY), count - 1)
    fraction = np.append(fraction, 1.0)
    time = samples[interval] + fraction * steps[interval]
    joints, speeds = _joints(folder, time, _rests(folder, shots))
    base_rotation, base_position = _base(folder, interval, fraction)
    placed = place_links(folder, joints, base_rotation, base_position)
    placed["object"] = _object(folder, shots, interval, fraction)
    placed["ground"] = np.tile(np.eye(3), (len(time), 1, 1)), np.zeros((len(time), 3))
    return Trajectory(time, interval, joints, speeds, placed)


def joint_velocities(folder: Folder) -> np.ndarray:
    """Return the joints' velocities (S, J), rad/s, at the samples of a motion that starts and ends at rest."""
    return _joints(folder, folder.motion.time, (True, True))[1]


def sample_placements(folder: Folder) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return body name -> rotations (S, 3, 3) and positions (S, 3) in the world at the samples."""
    motion = folder.motion
    base = Rotation.from_quat(motion.base_orientation, scalar_first=True).as_matrix()
    placed = place_links(folder, motion.joint_angles, base, motion.base_position)
    placed["object"] = object_rotation(folder).as_matrix(), motion.object_position
    placed["ground"] = np.tile(np.eye(3), (len(base), 1, 1)), np.zeros_like(motion.base_position)
    return placed


def place_links(
    folder: Folder, joints: np.ndarray, base_rotation: np.ndarray, base_position: np.ndarray
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return link name -> rotations (T, 3, 3) and positions (T, 3) in the world, by Pinocchio's forward kinematics.

    Args:
        folder: the design.
        joints: (T, J) rad, in the order of the motion's joint names.
        base_rotation: (T, 3, 3), world <- palm.
        base_position: (T, 3) m, the palm's origin in the world.
    """
    model, data, columns = folder.model, folder.model.createData(), folder.joint_columns()
    frames = {name: model.getFrameId(name) for name in folder.links}
    rotation = {name: np.empty_like(base_rotation) for name in frames}
    position = {name: np.empty_like(base_position) for name in frames}
    configuration = pin.neutral(model)
    for i, angles in enumerate(joints):
        configuration[columns] = angles
        pin.framesForwardKinematics(model, data, configuration)
        for name, frame in frames.items():
            rotation[name][i] = base_rotation[i] @ data.oMf[frame].rotation
            position[name][i] = base_position[i] + base_rotation[i] @ data.oMf[frame].translation
    return {name: (rotation[name], position[name]) for name in frames}


def _rests(folder: Folder, shots: Shots) -> tuple[bool, bool]:
    """Return whether the object is at rest at the first and at the last sample."""
    first, last = end_speeds(folder, shots) <= still(folder)
    return bool(first), bool(last)


def _joints(folder: Folder, time: np.ndarray, rests: tuple[bool, bool]) -> tuple[np.ndarray, np.ndarray]:
    motion = folder.motion
    angles, speeds = np.empty((len(time), len(motion.joint_names))), np.empty((len(time), len(motion.joint_names)))
    for column, name in enumerate(motion.joint_names):
        finger = name.partition("_joint")[0]
        mine = [c for c, link in enumerate(motion.contact_link) if link.startswith(f"{finger}_link")]
        switches = np.any(motion.contact_active[1:, mine] != motion.contact_active[:-1, mine], axis=1)
        breaks = [0, *[int(k) + 1 for k in np.flatnonzero(switches)], len(motion.time) - 1]
        for first, last in pairwise(breaks):
            if first == last:
                continue
            still = rests[0] and first == 0, rests[1] and last == breaks[-1]
            ends = [(1, 0.0) if rest else "not-a-knot" for rest in still]
            stretch = slice(first, last + 1)
            spline = CubicSpline(motion.time[stretch], motion.joint_angles[stretch, column], bc_type=(ends[0], ends[1]))
            inside = (time >= motion.time[first]) & (time <= motion.time[last])
            angles[inside, column], speeds[inside, column] = spline(time[inside]), spline(time[inside], 1)
    return angles, speeds


def _base(folder: Folder, interval: np.ndarray, fraction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the palm's rotations (T, 3, 3) and positions (T, 3): cubic, with velocities from five samples each."""
    motion, count = folder.motion, len(folder.motion.time)
    orientation = Rotation.from_quat(motion.base_orientation, scalar_first=True)
    velocity, rate = np.empty((count, 3)), np.empty((count, 3))
    for k in range(count):
        window = np.arange(5) + min(max(k - 2, 0), count - 5) if count >= 5 else np.arange(count)
        powers = np.vander(motion.time[window] - motion.time[k], increasing=True)
        turned = (orientation[k].inv() * orientation[window]).as_rotvec()
        velocity[k] = np.linalg.solve(powers, motion.base_position[window])[1]
        rate[k] = np.linalg.solve(powers, turned)[1]
    return _cubic(motion.time, motion.base_position, orientation, velocity, rate, interval, fraction)


def _object(folder: Folder, shots: Shots, interval: np.ndarray, fraction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the object's rotations (T, 3, 3) and positions (T, 3): cubic, with the shots' velocities."""
    velocity = _at_samples(shots.launch_velocity, shots.arrival_velocity)
    rate = _at_samples(shots.launch_rate, shots.arrival_rate)
    motion = folder.motion
    return _cubic(motion.time, motion.object_position, object_rotation(folder), velocity, rate, interval, fraction)


def _cubic(
    time: np.ndarray,
    position: np.ndarray,
    orientation: Rotation,
    velocity: np.ndarray,
    rate: np.ndarray,
    interval: np.ndarray,
    fraction: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Interpolate poses by Hermite's cubic; orientations in the rotation vector from the interval's first sample.

    Args:
        time: (S,) s.
        position: (S, 3) m, world.
        orientation: S rotations, world <- body.
        velocity: (S, 3) m/s, world.
        rate: (S, 3) rad/s, body's frame.
        interval: (T,) which interval each dense time lies in.
        fraction: (T,) how far through it.

    Returns:
        rotations (T, 3, 3) and positions (T, 3).
    """
    step, s = np.diff(time)[interval, None], fraction[:, None]
    rise, launch, arrive = s * s * (3 - 2 * s), step * s * (1 - s) ** 2, step * s * s * (s - 1)
    moved = position[interval] + rise * (position[interval + 1] - position[interval])
    moved = moved + launch * velocity[interval] + arrive * velocity[interval + 1]
    turn = (orientation[:-1].inv() * orientation[1:]).as_rotvec()
    end_rate = np.einsum("kij,kj->ki", _inverse_right_jacobian(turn), rate[1:])
    local = rise * turn[interval] + launch * rate[interval] + arrive * end_rate[interval]
    return (orientation[interval] * Rotation.from_rotvec(local)).as_matrix(), moved


def _at_samples(launch: np.ndarray, arrival: np.ndarray) -> np.ndarray:
    """Return (S, 3) velocities: where a sample is both arrived at and launched from, the mean.

    Taking half the jump off at either end as well keeps a motion that breaks physics from bulging there.
    """
    jump = launch[1:] - arrival[:-1]
    return np.concatenate([launch[:1] - 0.5 * jump[:1], launch[1:] - 0.5 * jump, arrival[-1:] + 0.5 * jump[-1:]])


def _inverse_right_jacobian(turn: np.ndarray) -> np.ndarray:
    """Return (K, 3, 3) maps from body rates to rates of the rotation vectors ``turn`` (K, 3), |turn| < 2 pi."""
    return np.array([pin.Jlog3(pin.exp3(vector)) for vector in turn])
