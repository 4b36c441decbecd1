"""What acts on an object from outside, of a task: disturbances, what it exerts, and the joint that holds it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from casadi_hands.motion import Schedule
from casadi_hands.problem.attachment import Attachment
from casadi_hands.problem.exerted import Exerted, planned
from casadi_hands.problem.model import Model
from casadi_hands.problem.scenario import Scenario
from casadi_hands.problem.units import Units, round_off
from casadi_hands.task import Task
from casadi_hands.task.on_joint import coordinates

Array = NDArray[np.float64]


def scenarios_of(task: Task, schedule: Schedule, units: Units) -> tuple[Scenario, ...]:
    """The motion as planned and, if the task disturbs it, the same with the forces and torques that do."""
    forces, torques = np.zeros((2, len(schedule.samples), 3))
    for each in task.perturbations:
        during = (schedule.samples >= each.start - 1e-9) & (schedule.samples <= each.end + 1e-9)
        if not during.any():  # a short one between two samples
            during[np.argmin(np.abs(schedule.samples - (each.start + each.end) / 2))] = True
        forces[during] += np.asarray(each.force)
        torques[during] += np.asarray(each.torque)
    disturbed = Scenario("_perturbed", round_off(forces / units.force), round_off(torques / units.torque))
    plan = planned(schedule.samples, exerted_of(task, units))
    return plan, *([disturbed.plus(plan)] if disturbed.acts.any() else [])


def exerted_of(task: Task, units: Units) -> tuple[Exerted, ...]:
    """What the task's goals ask the object to exert on the way to them."""
    return tuple(
        Exerted(
            before.at,
            goal.at,
            task.time_step,
            round_off(np.array(goal.exert.force) / units.force),
            round_off(np.array(goal.exert.torque) / units.torque),
        )
        for before, goal in pairwise(task.motion)
        if goal.exert is not None
    )


def attachment_of(task: Task, units: Units, reference: Array) -> Attachment:
    """The joint of an attached object."""
    assert task.object.attached is not None
    joint, length = task.object.attached.joint, units.length
    coordinate, force = (1.0, units.torque) if joint.turns else (length, units.force)
    found = Attachment(
        axis=round_off(joint.direction),
        point=round_off(joint.pivot / length),
        turning=joint.turns,
        advance=round_off(joint.advance / length) if joint.turns else 1.0,
        start=round_off(np.array(task.motion[0].position) / length),
        reference=reference,
        goals=round_off(coordinates(joint, task.motion, task.goal_turns()) / coordinate),
        mass=1.0,
        friction=round_off(joint.friction / force),
        stiffness=round_off(joint.stiffness * coordinate / force),
        damping=round_off(joint.damping * coordinate / force),
    )
    inertia = np.array(task.object.inertia) / (task.object.mass * length**2)
    velocity, spin = found.twist[:3], found.twist[3:]
    return replace(found, mass=round_off(velocity @ velocity + spin @ inertia @ spin))


def attached(model: Model, attachment: Attachment) -> Model:
    """The task with its object on a joint, whose goals are the task's."""
    poses = attachment.poses(attachment.goals)
    return replace(model, attachment=attachment, goal_positions=poses[:, :3], goal_vectors=poses[:, 3:])
