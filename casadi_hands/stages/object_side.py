"""The object's motion, contacts and forces as a part of a problem: variables, kernels, parameter values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from casadi_hands.motion import eased, linear
from casadi_hands.nlp import Problem, Rows
from casadi_hands.stages import soft_object
from casadi_hands.stages.model import Model
from casadi_hands.stages.palm_motion import added_to_spline, carried_along, carried_by_palm, goals_seen_from_palm

Array = NDArray[np.float64]
CLEARANCE = 0.02  # half extents, asked of object and palm, and in exact motions of all bodies that do not touch
GOAL_TOLERANCE = 5e-4  # half extents and rad, each coordinate: the task's cost alone gives way to slow accelerations
MOST_FORCE = 20.0  # m·g, a bound on each component of a contact force
MOST_TURN = 5.6  # rad, up to where the exponential map's coordinates are used

_WEIGHT_OF = {  # terms of the ground's contact take the weights of the fingers' ones
    "ground_friction_cone": "friction_cone",
    "contact_on_ground": "contact_on_object",
    "slip_on_ground": "tangential_slip",
}


@dataclass(frozen=True)
class ObjectSide:
    """Rows that kernels read, at the samples unless said otherwise; the ground's contact, if any, is the last.

    Attributes:
        pose: (S, 6) at time offsets of -1, 0 and +1 steps.
        point: (S, 3C) contact points at the same offsets, object frame.
        force: (S, 3C) in the object's frame, at every sample a variable of its own.
        perturbed: (S, 3C) forces of the second scenario, or None.
        activity: (S, C) contact invariants, held from each keyframe to the next.
        keyframe_pose: (N, 6).
        keyframe_activity: (N, C).
    """

    pose: tuple[Rows, Rows, Rows]
    point: tuple[Rows, Rows, Rows]
    force: Rows
    perturbed: Rows | None
    activity: Rows
    keyframe_pose: Rows
    keyframe_activity: Rows


def sizes(model: Model) -> tuple[int, int, int]:
    """Number of keyframes, samples and contacts (the ground's included)."""
    schedule = model.schedule
    return len(schedule.keyframes), len(schedule.samples), model.contacts + (model.ground is not None)


def declare_object(problem: Problem, model: Model) -> ObjectSide:
    """Declare ``pose`` (N, 6), ``point`` (N, 3C), ``force`` (S, 3C), ``activity`` (N, C), ``force_perturbed``."""
    schedule = model.schedule
    keyframes, samples, contacts = sizes(model)
    pose = problem.variable("pose", (keyframes, 6), *pose_bounds(model))
    point = problem.variable("point", (keyframes, 3 * contacts))
    force = problem.variable("force", (samples, 3 * contacts), -MOST_FORCE, MOST_FORCE)
    activity = problem.variable("activity", (keyframes, contacts), 0, 1)
    perturbed = None
    if model.perturbed:
        perturbed = problem.variable("force_perturbed", (samples, 3 * contacts), -MOST_FORCE, MOST_FORCE)
    return ObjectSide(
        pose=tuple(  # type: ignore[arg-type]
            pose.combine(schedule.spline(offset)).plus(added_to_spline(model, offset)) for offset in (-1, 0, 1)
        ),
        point=tuple(_points(model, point, offset) for offset in (-1, 0, 1)),  # type: ignore[arg-type]
        force=force,
        perturbed=perturbed,
        activity=activity.take(schedule.sample_keyframes),
        keyframe_pose=pose,
        keyframe_activity=activity,
    )


def _points(model: Model, keyframes: Rows, offset: float) -> Rows:
    """Contact points (S, 3C) at the samples, ``offset`` steps later."""
    if model.regrasp is None:
        return keyframes.combine(model.schedule.spline(offset))
    contacts = range(sizes(model)[2])
    return Rows.beside([keyframes.entries(3 * c, 3 * c + 3).combine(model.point_spline(c, offset)) for c in contacts])


def sampled_points(model: Model, keyframes: Array) -> Array:
    """Contact points (S, C, 3) at the samples from those at the keyframes (N, C, 3)."""
    return np.stack([model.point_spline(c) @ keyframes[:, c] for c in range(keyframes.shape[1])], axis=1)


def bind_object(problem: Problem, model: Model, side: ObjectSide, palm: Rows | None = None) -> None:
    """Bind every kernel of the object's side; parameters are those of ``object_parameters``.

    ``palm`` is the offset (N, 6) of a palm that may move.
    """
    for name, width in (("reference", 4), ("step", 1), ("gravity", 3), ("nothing", 3), ("inertia", 9), ("inertial", 1)):
        problem.parameter(name, (1, width))
    for name in ("friction", "sharpness", "clearance", "ground_height"):
        problem.parameter(name, (1, 1))
    _bind_scenario(problem, model, side, side.force, "")
    if side.perturbed is not None:
        _bind_scenario(problem, model, side, side.perturbed, "_perturbed")
    _bind_points(problem, model, side)
    _bind_goals(problem, model, side)
    _bind_clearance(problem, model, side, palm)


def _bind_scenario(problem: Problem, model: Model, side: ObjectSide, force: Rows, suffix: str) -> None:
    """Physics and contact forces, without and with the task's perturbations."""
    p = problem.parameters
    _, samples, contacts = sizes(model)
    if suffix:
        external = [problem.parameter(f"perturbation_{kind}", (samples, 3)) for kind in ("force", "torque")]
    else:
        external = [p["nothing"], p["nothing"]]
    common = [p["reference"], p["step"], p["gravity"], *external, p["inertia"], p["inertial"]]
    if not suffix:
        common.append(problem.parameter("carried_acceleration", (samples, 3)))
    kernel = soft_object.dynamics(contacts, suffix, regularise=not suffix)
    problem.bind(kernel, [*side.pose, side.point[1], force, side.activity], common)
    capsules = problem.parameter(f"capsules{suffix}", (model.contacts, 7))
    for i in range(model.contacts):
        span = (3 * i, 3 * i + 3)
        rows = [force.entries(*span), side.activity.entries(i, i + 1), side.point[1].entries(*span)]
        parameters = [capsules[i : i + 1], p["friction"], p["sharpness"], p["step"]]
        rows.append(side.point[0].entries(*span))
        kernel, bounds = soft_object.contact_forces(suffix), {"in_cone": (0, np.inf)}
        problem.bind(kernel, rows, parameters, bounds, f"contact{i}{suffix}")
    if model.ground is not None:
        i, span = contacts - 1, (3 * contacts - 3, 3 * contacts)
        rows = [side.pose[1], side.pose[0], side.point[1].entries(*span), force.entries(*span)]
        rows.append(side.activity.entries(i, i + 1))
        capsule = problem.parameter(f"ground_capsule{suffix}", (1, 7))
        friction = problem.parameter(f"ground_friction{suffix}", (1, 1))
        parameters = [p["reference"], capsule, p["ground_height"], friction, p["sharpness"], p["step"]]
        problem.bind(soft_object.ground_contact(suffix), rows, parameters, {"in_cone": (0, np.inf)})


def _bind_points(problem: Problem, model: Model, side: ObjectSide) -> None:
    p, contacts = problem.parameters, sizes(model)[2]
    patches = problem.parameter("patches", (sizes(model)[1], 3 * contacts))
    kernel = soft_object.contact_motion()
    for i in range(contacts):
        rows = [points.entries(3 * i, 3 * i + 3) for points in side.point]
        problem.bind(kernel, rows, [patches[:, 3 * i : 3 * i + 3], p["step"]])
    least = least_contacts(model), np.inf
    problem.bind(soft_object.enough_contacts(contacts), [side.keyframe_activity], [], {"sum": least})


def least_contacts(model: Model) -> int:
    """How many contacts act at every keyframe."""
    return min(2, model.contacts)


def _bind_goals(problem: Problem, model: Model, side: ObjectSide) -> None:
    p = problem.parameters
    if model.tool is not None:
        targets, tool = problem.parameter("targets", (sizes(model)[1], 3)), problem.parameter("tool", (1, 3))
        problem.bind(soft_object.goal_point(), [side.pose[1]], [p["reference"], targets, tool])
    else:
        shape = model.goal_positions.shape
        targets, vectors = problem.parameter("targets", shape), problem.parameter("vectors", shape)
        rows = side.keyframe_pose.take(model.schedule.goals)
        problem.bind(soft_object.goal_pose(), [rows], [p["reference"], targets, vectors])
    straight = problem.parameter("straight", (sizes(model)[0], 6))
    problem.bind(soft_object.straight_path(), [side.keyframe_pose], [straight])


def _bind_clearance(problem: Problem, model: Model, side: ObjectSide, palm: Rows | None) -> None:
    p, samples = problem.parameters, sizes(model)[1]
    given = [problem.parameter(f"palm_{n}", (samples, k)) for n, k in (("position", 3), ("quaternion", 4))]
    radius = problem.parameter("palm_radius", (1, 1))
    primitives = problem.parameter("primitives", (len(model.primitives), 7))
    kernel = soft_object.palm_clearance(moves=palm is not None)
    rows = [side.pose[1]] if palm is None else [side.pose[1], palm.combine(model.schedule.spline())]
    for i in range(len(model.primitives)):
        parameters = [*given, p["reference"], primitives[i : i + 1], radius, p["ground_height"], p["clearance"]]
        problem.bind(kernel, rows, parameters)


def tool_path(model: Model) -> Array:
    """Where a drawing's tool must be at the samples, (S, 3) world: on straight lines, at rest at every goal."""
    return _between_goals(model, model.schedule.samples) @ model.goal_positions


def _between_goals(model: Model, times: Array) -> Array:
    """Weights (T, G) of the goals on the straight way between them; a drawing slows down at its corners."""
    goals = model.schedule.keyframes[list(model.schedule.goals)]
    if model.tool is not None:
        times = eased(goals, times)
    return linear(goals, times)


def straight_path(model: Model) -> Array:
    """Poses (N, 6) at the keyframes on the straight way between goals, as a palm that moves sees it.

    A drawing's object stays upright, and its tool on the straight way in the world.
    """
    between, schedule = _between_goals(model, model.schedule.keyframes), model.schedule
    if model.tool is not None:
        return between @ np.hstack([model.goal_positions - model.tool, model.goal_vectors])
    return carried_by_palm(model, between @ goals_seen_from_palm(model), schedule.keyframe_samples)


def carried_acceleration(model: Model) -> Array:
    """Acceleration (S, 3), lengths/s², at the samples, that the palm's motion gives an object it carries."""
    schedule = model.schedule
    before, now, after = (carried_along(model, schedule.at(offset))[:, :3] for offset in (-1, 0, 1))
    return np.asarray((after - 2 * now + before) / schedule.step**2)


def pose_bounds(model: Model) -> tuple[Array, Array]:
    """Box bounds (N, 6) of the keyframe poses: close to the goals, else as far as coordinates serve."""
    widest = np.tile([np.inf] * 3 + [MOST_TURN] * 3, (sizes(model)[0], 1))
    lower, upper = -widest, widest
    if model.tool is None:
        goals = model.goal_poses
        chosen = list(model.schedule.goals)
        lower[chosen], upper[chosen] = goals - GOAL_TOLERANCE, goals + GOAL_TOLERANCE
    return lower, upper


def object_parameters(model: Model) -> dict[str, Array | float]:
    """Values of all parameters of the object's side but the weights."""
    ground = model.ground
    values: dict[str, Array | float] = {
        "reference": model.reference,
        "step": model.schedule.step,
        "gravity": model.gravity,
        "nothing": 0.0,
        "inertia": model.inertia.reshape(1, 9),
        "inertial": model.units.inertial,
        "friction": model.friction,
        "clearance": CLEARANCE,
        "ground_height": model.ground_height,
        "patches": model.keyframe_patches[model.schedule.sample_keyframes].reshape(sizes(model)[1], -1),
        "palm_position": model.palm_position,
        "palm_quaternion": model.palm_quaternion,
        "palm_radius": model.palm_radius,
        "primitives": model.primitives,
        "targets": model.goal_positions,
        "straight": straight_path(model),
        "carried_acceleration": carried_acceleration(model),
    }
    if model.tool is not None:
        values["tool"], values["targets"] = model.tool, tool_path(model)
    else:
        values["vectors"] = model.goal_vectors
    for suffix in ("", "_perturbed") if model.perturbed else ("",):
        values[f"capsules{suffix}"] = model.capsules
        if ground is not None:
            values[f"ground_capsule{suffix}"] = ground.capsule
            values[f"ground_friction{suffix}"] = ground.friction
    if model.perturbed:
        values["perturbation_force"] = model.perturbation_force
        values["perturbation_torque"] = model.perturbation_torque
    return values


def term_weights(problem: Problem, model: Model, weights: Mapping[str, float]) -> dict[str, float]:
    """Weight parameters of a stage: all terms but the task's are divided by the number of keyframes."""
    keyframes, samples, _ = sizes(model)
    count = samples if model.tool is not None else len(model.goal_positions)
    values = {}
    for term in problem.terms:
        plain = term.removesuffix("_perturbed")
        weight = float(weights[_WEIGHT_OF.get(plain, plain)])
        values[f"weight.{term}"] = weight / (count if plain == "task" else keyframes)
    return {**values, "sharpness": float(weights["friction_sharpness"])}
