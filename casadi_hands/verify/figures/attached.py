"""Does an object on a joint move as the forces along it say, and does the joint resist as it should?"""

from __future__ import annotations

import numpy as np

from casadi_hands.verify.figures.dynamics import Shots, object_rotation, read_loads, shoot
from casadi_hands.verify.held import SHARES, WEIGHTS, Course, Held, course, held
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.report import Figure, worse


def object_shots(folder: Folder) -> Shots:
    """Return the object's physics between samples, free or on a joint."""
    joint = held(folder)
    return shoot(folder) if joint is None else joint_shots(folder, joint)


def joint_shots(folder: Folder, joint: Held) -> Shots:
    """Return the object's velocities where it leaves and reaches samples, as momentum along its joint asks for."""
    launch, arrival = joint_speeds(folder, joint)
    turns = object_rotation(folder)
    velocity = turns.apply(joint.twist[:3])
    return Shots(
        velocity[:-1] * launch[:, None],
        velocity[1:] * arrival[:, None],
        np.outer(launch, joint.twist[3:]),
        np.outer(arrival, joint.twist[3:]),
    )


def joint_speeds(folder: Folder, joint: Held) -> tuple[np.ndarray, np.ndarray]:
    """Return the coordinate's speed (K,) where the object leaves a sample and where it arrives at the next."""
    along, step = course(folder, joint), np.diff(folder.motion.time)
    early, all_of_it = np.zeros_like(step), np.zeros_like(step)
    for share, weight in zip(SHARES.tolist(), WEIGHTS.tolist(), strict=True):
        acceleration = _force(folder, joint, along, share) / joint.mass
        early += weight * (1 - share) * step * acceleration
        all_of_it += weight * step * acceleration
    launch = np.diff(along.position) / step - early
    return launch, launch + all_of_it


def _force(folder: Folder, joint: Held, along: Course, share: float) -> np.ndarray:
    """Return what acts along the coordinate in the intervals (K,), a share of them through."""
    loads = read_loads(folder)
    step, q, speed = loads.time, along.position, along.velocity
    rise, fall = share**2 * (3 - 2 * share), share * (1 - share)
    there = q[:-1] + rise * np.diff(q) + step * fall * ((1 - share) * speed[:-1] - share * speed[1:])
    pace = 6 * fall * np.diff(q) / step
    pace += (1 - share) * (1 - 3 * share) * speed[:-1] + share * (3 * share - 2) * speed[1:]
    force, moment, external_force, external_torque = loads.at(share)
    back = joint.place(there)[1].inv()
    force = force + back.apply(folder.object.mass * folder.gravity + external_force)
    moment = moment + back.apply(external_torque)
    friction = (1 - share) * along.friction[:-1] + share * along.friction[1:]
    work = force @ joint.twist[:3] + moment @ joint.twist[3:]
    return np.asarray(work + friction - joint.stiffness * there - joint.damping * pace)


def joint_residual(folder: Folder, joint: Held) -> tuple[np.ndarray, np.ndarray]:
    """Return force over m·g and torque over m·g·l that nothing exerts along the joint at the inner samples (S - 2,).

    It is what the speeds of arrival and departure, and the speed that the file states, differ by.
    """
    launch, arrival = joint_speeds(folder, joint)
    step, stated = np.diff(folder.motion.time), course(folder, joint).velocity[1:-1]
    differences = np.abs([launch[1:] - arrival[:-1], launch[1:] - stated, arrival[:-1] - stated])
    along = joint.mass * differences.max(axis=0) / (0.5 * (step[1:] + step[:-1])) / joint.unit(folder)
    none = np.zeros_like(along)
    return (none, along) if joint.turns else (along, none)


def attachment_figures(folder: Folder, joint: Held) -> list[Figure]:
    """Return the share by which the joint's friction is off what its motion makes of it.

    Where the joint moves that is all of it, against the motion; where it rests at most all of it.
    """
    along, time = course(folder, joint), folder.motion.time
    worst = (0.0, "the joint's friction acts against its motion")
    limit = folder.task.limits.attachment_shortfall
    for k, (speed, friction) in enumerate(zip(along.velocity.tolist(), along.friction.tolist(), strict=True)):
        share = friction / joint.friction if joint.friction else float(np.inf if friction else 0.0)
        off = abs(share) - 1.0
        if abs(speed) > joint.fast(folder) and joint.friction:
            off = abs(share + np.sign(speed))
        if off > 1e-9:
            words = (
                f"the friction of the object's joint is {{value}} off all of it against its motion at {time[k]:.3g} s"
            )
            worst = worse(worst, (float(off), words))
    return [Figure("attachment_shortfall", worst[0], limit, "share", worst[1])]


def along_world(folder: Folder, joint: Held) -> np.ndarray:
    """Return the twist (S, 6) at the samples in the world: velocity of the centre of mass, angular velocity."""
    turns = object_rotation(folder)
    return np.hstack([turns.apply(joint.twist[:3]), turns.apply(joint.twist[3:])])
