"""The object's motion, contacts and forces as a part of a problem: its variables, and every kernel bound to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from casadi_hands.nlp import Problem, Rows
from casadi_hands.problem.model import Model, sizes
from casadi_hands.problem.palm_motion import added_to_spline
from casadi_hands.stages.object_motion import kernels
from casadi_hands.stages.object_motion.values import least_contacts, point_bounds, pose_bounds

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ObjectSide:
    """Rows that kernels read, at the samples unless said otherwise; the ground's contact, if any, is the last.

    Attributes:
        pose: (S, 6) at time offsets of -1, 0 and +1 steps.
        point: (S, 3C) contact points at the same offsets, object frame.
        forces: of each scenario (S, 3C) in the object's frame, at every sample a variable of its own.
        invariant: (S, C) contact invariants, held from each keyframe to the next.
        keyframe_pose: (N, 6).
        keyframe_invariant: (N, C).
    """

    pose: tuple[Rows, Rows, Rows]
    point: tuple[Rows, Rows, Rows]
    forces: tuple[Rows, ...]
    invariant: Rows
    keyframe_pose: Rows
    keyframe_invariant: Rows

    @property
    def force(self) -> Rows:
        """Forces of the motion as planned."""
        return self.forces[0]


def declare_object(problem: Problem, model: Model) -> ObjectSide:
    """Declare ``pose`` (N, 6), ``point`` (N, 3C), ``invariant`` (N, C), and each scenario's ``force`` (S, 3C)."""
    schedule, most = model.schedule, model.force_limit
    keyframes, samples, contacts = sizes(model)
    pose = problem.variable("pose", (keyframes, 6), *pose_bounds(model))
    asked = model.regrasp is not None and model.regrasp.asked
    point = problem.variable("point", (keyframes, 3 * contacts), *(point_bounds(model) if asked else ()))
    force = problem.variable("force", (samples, 3 * contacts), -most, most)
    invariant = problem.variable("invariant", (keyframes, contacts), 0, 1)
    disturbed = [
        problem.variable(f"force{each.suffix}", (samples, 3 * contacts), -most, most, quantity="force")
        for each in model.scenarios[1:]
    ]

    def poses(offset: int) -> Rows:
        return pose.combine(schedule.spline(offset), offset).plus(added_to_spline(model, offset))

    return ObjectSide(
        pose=(poses(-1), poses(0), poses(1)),
        point=(_points(model, point, -1), _points(model, point, 0), _points(model, point, 1)),
        forces=(force, *disturbed),
        invariant=invariant.take(schedule.sample_keyframes),
        keyframe_pose=pose,
        keyframe_invariant=invariant,
    )


def _points(model: Model, keyframes: Rows, offset: float) -> Rows:
    """Contact points (S, 3C) at the samples, ``offset`` steps later."""
    if model.regrasp is None:
        return keyframes.combine(model.schedule.spline(offset), offset)
    contacts = range(sizes(model)[2])
    return Rows.beside(
        [keyframes.entries(3 * c, 3 * c + 3).combine(model.point_spline(c, offset), offset) for c in contacts]
    )


def bind_object(problem: Problem, model: Model, side: ObjectSide, palm: Rows | None = None) -> None:
    """Bind every kernel of the object's side; parameters are those of ``object_parameters``.

    ``palm`` is the offset (N, 6) of a palm that may move.
    """
    for name, width in (("reference", 4), ("step", 1), ("gravity", 3), ("inertia", 9), ("inertial", 1)):
        problem.parameter(name, (1, width))
    for name in ("friction", "sharpness", "clearance", "ground_height"):
        problem.parameter(name, (1, 1))
    if model.attachment is not None:
        problem.parameter("freedom", (1, 6))
        problem.parameter("resistance", (sizes(model)[1], 1))
    for scenario, force in zip(model.scenarios, side.forces, strict=True):
        _bind_scenario(problem, model, side, force, scenario.suffix)
    _bind_points(problem, model, side)
    _bind_goals(problem, model, side)
    _bind_clearance(problem, model, side, palm)


def _bind_scenario(problem: Problem, model: Model, side: ObjectSide, force: Rows, suffix: str) -> None:
    """Physics and contact forces of one scenario; only the first pays for the motion, which all share."""
    samples, contacts = sizes(model)[1:]
    joint = "" if model.attachment is None else "turning" if model.attachment.turning else "sliding"
    external = {
        f"external_{kind}": problem.parameter(
            f"external_{kind}{suffix}", (samples if suffix or model.exerted else 1, 3), quantity=f"external_{kind}"
        )
        for kind in ("force", "torque")
    }
    if not suffix:
        external["carried_acceleration"] = problem.parameter("carried_acceleration", (samples, 3))
    problem.bind(
        kernels.dynamics(contacts, suffix, not suffix, joint),
        pose=side.pose,
        points=side.point[1],
        forces=force,
        invariant=side.invariant,
        **problem.given("reference", "step", "gravity", "inertia", "inertial"),
        **external,
        **({} if model.attachment is None else problem.given("freedom", "resistance")),
    )
    for i, body in enumerate(model.touched[: model.contacts]):
        problem.bind(
            kernels.contact_forces(type(body), suffix),
            {"in_cone": (0, np.inf)},
            f"contact{i}{suffix}",
            force=force.entries(3 * i, 3 * i + 3, i),
            invariant=side.invariant.entries(i, i + 1, i),
            point=side.point[1].entries(3 * i, 3 * i + 3, i),
            point_before=side.point[0].entries(3 * i, 3 * i + 3, i),
            body=problem.parameter(f"body{i}{suffix}", (1, body.width), quantity="body", owner=i),
            **problem.given("friction", "sharpness", "step"),
        )
    if model.ground is not None:
        i, body = contacts - 1, model.touched[-1]
        problem.bind(
            kernels.ground_contact(type(body), suffix),
            {"in_cone": (0, np.inf)},
            pose=side.pose[1],
            pose_before=side.pose[0],
            point=side.point[1].entries(3 * i, 3 * i + 3, i),
            force=force.entries(3 * i, 3 * i + 3, i),
            invariant=side.invariant.entries(i, i + 1, i),
            body=problem.parameter(f"ground_body{suffix}", (1, body.width), quantity="body", owner=i),
            friction=problem.parameter(f"ground_friction{suffix}", (1, 1), quantity="friction", owner=i),
            **problem.given("reference", "ground_height", "sharpness", "step"),
        )


def _bind_points(problem: Problem, model: Model, side: ObjectSide) -> None:
    _, samples, contacts = sizes(model)
    patches = problem.parameter("patches", (samples, 3 * contacts), quantity="patch")
    for i in range(contacts):
        span = 3 * i, 3 * i + 3, i
        points = [points.entries(*span) for points in side.point]
        kernel = kernels.contact_motion()
        problem.bind(kernel, point=points, patch=patches.entries(*span), step=problem["step"])
    least = least_contacts(model), np.inf
    problem.bind(kernels.enough_contacts(contacts), {"sum": least}, invariant=side.keyframe_invariant)


def _bind_goals(problem: Problem, model: Model, side: ObjectSide) -> None:
    keyframes, samples, _ = sizes(model)
    reference = problem["reference"]
    if model.tool is not None:
        target, tool = problem.parameter("targets", (samples, 3), quantity="target"), problem.parameter("tool", (1, 3))
        problem.bind(kernels.goal_point(), pose=side.pose[1], reference=reference, target=target, tool=tool)
    else:
        shape = model.goal_positions.shape
        target = problem.parameter("targets", (shape[0], 3), quantity="target")
        vector = problem.parameter("vectors", (shape[0], 3), quantity="goal_vector")
        rows = side.keyframe_pose.take(model.schedule.goals)
        problem.bind(kernels.goal_pose(), pose=rows, reference=reference, target=target, vector=vector)
    straight = problem.parameter("straight", (keyframes, 6))
    problem.bind(kernels.straight_path(), pose=side.keyframe_pose, straight=straight)


def _bind_clearance(problem: Problem, model: Model, side: ObjectSide, palm: Rows | None) -> None:
    samples = sizes(model)[1]
    for name, width in (("palm_position", 3), ("palm_quaternion", 4)):
        problem.parameter(name, (samples, width), when=0)
    problem.parameter("palm_radius", (1, 1))
    moved = {} if palm is None else {"palm": palm.combine(model.schedule.spline(), 0)}
    shared = ("palm_position", "palm_quaternion", "reference", "palm_radius", "ground_height", "clearance")
    for i, body in enumerate(model.bodies):
        problem.bind(
            kernels.palm_clearance(type(body), moves=palm is not None),
            pose=side.pose[1],
            **moved,
            body=problem.parameter(f"object{i}", (1, body.width), quantity="body"),
            **problem.given(*shared),
        )
