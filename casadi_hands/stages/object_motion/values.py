"""The object's motion, contacts and forces as a part of a problem: bounds, parameter values and weights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from casadi_hands.motion import linear, time_scaled
from casadi_hands.nlp import Problem
from casadi_hands.problem.attachment import MOVING, dry_friction
from casadi_hands.problem.model import Model, sizes
from casadi_hands.problem.palm_motion import carried_along, carried_by_palm, goals_seen_from_palm, poses_at
from casadi_hands.stages.own_terms import own_values

Array = NDArray[np.float64]
GOAL_TOLERANCE = 5e-4  # lengths and rad, each coordinate: the task's cost alone gives way to slow accelerations
REGRASP_ROOM = 0.15  # lengths about its patches, for a contact that is regrasped
LANDING_ROOM = 0.11  # lengths, each coordinate, about where the task has a finger touch again: the audit allows 0.2
MOST_TURN = 5.6  # rad, up to where the exponential map's coordinates are used where goals do not turn farther


def least_contacts(model: Model) -> int:
    """How many contacts act at every keyframe."""
    return min(2, model.contacts)


def tool_path(model: Model) -> Array:
    """Where a drawing's tool must be at the samples, (S, 3) world: on straight lines, at rest at every goal."""
    return _between_goals(model, model.schedule.samples) @ model.goal_positions


def _between_goals(model: Model, times: Array) -> Array:
    """Weights (T, G) of the goals on the straight way between them; a drawing slows down at its corners."""
    goals = model.schedule.keyframes[list(model.schedule.goals)]
    if model.tool is not None:
        times = time_scaled(goals, times)
    return linear(goals, times)


def straight_path(model: Model) -> Array:
    """Poses (N, 6) at the keyframes on the straight way between goals, as a palm that moves sees it.

    A drawing's object stays upright, and its tool on the straight way in the world. Where it is planned to rest
    between two keyframes it does, and is the faster between others.
    """
    between, schedule = _between_goals(model, _time_moved(model)), model.schedule
    if model.attachment is not None:
        return model.attachment.poses(between @ model.attachment.goals)
    if model.tool is not None:
        return between @ np.hstack([model.goal_positions - model.tool, model.goal_vectors])
    return carried_by_palm(model, between @ goals_seen_from_palm(model), schedule.keyframe_samples)


def _time_moved(model: Model) -> Array:
    """Times (N,) at which the object would be where it is at the keyframes, did it never rest on its way."""
    keyframes = model.schedule.keyframes
    if model.regrasp is None or model.regrasp.still is None:
        return keyframes
    times = keyframes.copy()
    moved = np.append(0.0, np.cumsum(np.diff(keyframes) * ~model.regrasp.still[:-1]))
    for begin, end in pairwise(model.schedule.goals):
        share = (moved[begin : end + 1] - moved[begin]) / (moved[end] - moved[begin])
        times[begin : end + 1] = keyframes[begin] + share * (keyframes[end] - keyframes[begin])
    return times


def carried_acceleration(model: Model) -> Array:
    """Acceleration (S, 3), lengths/s², at the samples, that the palm's motion gives an object it carries."""
    schedule = model.schedule
    before, now, after = (carried_along(model, schedule.at(offset))[:, :3] for offset in (-1, 0, 1))
    return np.asarray((after - 2 * now + before) / schedule.step**2)


def most_turn(model: Model) -> float:
    """Bound of each coordinate of the object's orientation, rad."""
    return max(MOST_TURN, 1.02 * float(np.abs(model.goal_vectors).max()))


def pose_bounds(model: Model) -> tuple[Array, Array]:
    """Box bounds (N, 6) of the keyframe poses: close to the goals, else as far as coordinates serve.

    An attached object goes its one way, and when is left to the refinement.
    """
    if model.attachment is not None:
        return straight_path(model), straight_path(model)
    widest = np.tile([np.inf] * 3 + [most_turn(model)] * 3, (sizes(model)[0], 1))
    lower, upper = -widest, widest
    if model.tool is None:
        goals = model.goal_poses
        chosen = list(model.schedule.goals)
        lower[chosen], upper[chosen] = goals - GOAL_TOLERANCE, goals + GOAL_TOLERANCE
    return lower, upper


def point_bounds(model: Model) -> tuple[Array, Array]:
    """Bounds (N, 3C) of contact points at the keyframes: near their patches, of contacts that are to touch elsewhere.

    Free, such a contact would touch near where it was and slide there.
    """
    patches = model.keyframe_patches
    moved = np.any(patches != patches[0], axis=(0, 2))
    room = np.where(moved, REGRASP_ROOM, np.inf)[None, :, None]
    return (patches - room).reshape(len(patches), -1), (patches + room).reshape(len(patches), -1)


def landing_bounds(model: Model, contacts: Sequence[int]) -> tuple[Array, Array]:
    """Bounds (S, 3C) of some contacts' points at the samples: near where fingers shall touch again."""
    samples, chosen = len(model.schedule.samples), list(contacts)
    high = np.full((samples, len(chosen), 3), np.inf)
    low = -high
    if model.regrasp is not None:
        # Elsewhere than planned a finger may have no lever to go on with.
        room = LANDING_ROOM if model.regrasp.asked else REGRASP_ROOM
        lifted, patches = model.regrasp.lifted[:, chosen], model.regrasp.patches[:, chosen]
        k, c = np.nonzero(lifted[:-1] & ~lifted[1:])
        at = model.schedule.keyframe_samples[k + 1]
        low[at, c], high[at, c] = patches[k + 1, c] - room, patches[k + 1, c] + room
    return low.reshape(samples, -1), high.reshape(samples, -1)


def object_parameters(model: Model) -> dict[str, Array | float]:
    """Values of all parameters of the object's side but the weights."""
    values: dict[str, Array | float] = {
        "reference": model.reference,
        "step": model.schedule.step,
        "gravity": model.gravity,
        "inertia": model.inertia.reshape(1, 9),
        "inertial": model.units.inertial,
        "friction": model.friction,
        "clearance": model.clearance,
        "ground_height": model.ground_height,
        "patches": model.keyframe_patches[model.schedule.sample_keyframes].reshape(sizes(model)[1], -1),
        "palm_position": model.palm_position,
        "palm_quaternion": model.palm_quaternion,
        "palm_radius": model.palm_radius,
        "targets": model.goal_positions,
        "straight": straight_path(model),
        "carried_acceleration": carried_acceleration(model),
    }
    values |= {f"object{i}": body.parameters for i, body in enumerate(model.bodies)}
    if model.tool is not None:
        values["tool"], values["targets"] = model.tool, tool_path(model)
    else:
        values["vectors"] = model.goal_vectors
    if model.attachment is not None:
        values["freedom"], values["resistance"] = model.attachment.twist, _resistance(model)
    for scenario in model.scenarios:
        suffix = scenario.suffix
        for i, body in enumerate(model.touched[: model.contacts]):
            values[f"body{i}{suffix}"] = body.parameters
        if model.ground is not None:
            values[f"ground_body{suffix}"] = model.touched[-1].parameters
            values[f"ground_friction{suffix}"] = float(model.frictions[-1])
        # Of the motion as planned all rows are the same, where nothing is exerted on the world.
        rows = slice(None) if suffix or model.exerted else slice(1)
        values[f"external_force{suffix}"], values[f"external_torque{suffix}"] = (
            scenario.force[rows],
            scenario.torque[rows],
        )
    return values


def _resistance(model: Model) -> Array:
    """What spring, damper and friction of the joint exert along it at the samples, (S, 1)."""
    joint, schedule = model.attachment, model.schedule
    assert joint is not None
    before, now, after = (poses_at(model, straight_path(model), offset) for offset in (-1, 0, 1))
    coordinates = [joint.coordinates(rows[:, :3], rows[:, 3:]) for rows in (before, now, after)]
    speeds = (coordinates[2] - coordinates[0]) / (2 * schedule.step)
    return np.asarray((joint.resistance(coordinates[1], speeds) + dry_friction(joint, speeds, MOVING))[:, None])


def term_weights(problem: Problem, model: Model, weights: Mapping[str, float]) -> dict[str, Array | float]:
    """Weight parameters of a stage: each a mean over the goals, or a drawing's samples, or the keyframes.

    A person's own terms are means over the samples, and come with the values of their parameters.
    """
    keyframes, samples, _ = sizes(model)
    goals = samples if model.tool is not None else len(model.goal_positions)
    values, own = own_values(problem, model), {term.name for term in model.own_terms}
    for name, term in problem.declared_terms.items():
        per_goal = any(weight.per == "goal" for weight in term.weights.values())
        count = samples if name in own else goals if per_goal else keyframes
        values[f"weight.{name}"] = float(weights[term.weighs_as or term.name]) / count
    return {**values, "sharpness": float(weights["friction_sharpness"])}
