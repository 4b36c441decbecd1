"""The object's blocks of the refine stage, bound to its knots."""

from __future__ import annotations

import numpy as np

from casadi_hands.problem.palm_motion import carried_velocity
from casadi_hands.stages.object_motion.values import GOAL_TOLERANCE
from casadi_hands.stages.refine import attached, newton_euler
from casadi_hands.stages.refine import object_kernels as kernels
from casadi_hands.stages.refine.declaration import FREE, IN_CONE, Declaration

ANSWER = "planned_force", "planned_torque"


def bind_physics(of: Declaration) -> None:
    """Newton–Euler from knot to knot, rest at both ends, disturbances, and what keeps the motion smooth."""
    held = of.structure.model.attachment
    problem, columns, soft = of.problem, len(of.structure.columns), bool(of.structure.model.torsion)
    every, now, later = np.arange(of.knots), np.arange(of.knots - 1), np.arange(1, of.knots)
    _bind_newton_euler(of) if held is None else attached.bind(of)
    twist = {"twist_torque": of.twist_torque} if soft else {}
    kernel = kernels.wrench(columns, soft)
    of.bind(every, kernel, {"sum": (0, 0)}, wrench=of.wrench, point=of.point, force=of.force, **twist)
    inner = np.arange(of.knots - 2)
    carried = np.hstack([carried_velocity(of.structure.model), np.zeros((of.knots, 3))])
    rates = [of.rate.plus(-carried).take(inner + k) for k in range(3)]
    problem.bind(kernels.object_jerk(), rate=rates, step=of.steps(inner, inner + 1))
    _bind_rest(of) if held is None else attached.bind_rest(of)
    of.bind(
        now,
        kernels.middle_torque(columns, soft),
        {"sum": (0, 0)},
        **{name: (rows.take(now), rows.take(later)) for name, rows in twist.items()},
        middle_torque=of.middle_torque,
        point=(of.point.take(now), of.point.take(later)),
        force=(of.force.take(now), of.force.take(later)),
    )
    problem.bind(kernels.force_change(columns), force=(of.force.take(now), of.force.take(later)))
    problem.bind(kernels.near_path(), pose=of.pose, wanted_pose=problem["wanted_pose"])
    if len(of.disturbed):
        for kind in ("force", "torque"):
            problem.parameter(f"external_{kind}", (len(of.disturbed), 3))
        of.bind(
            of.disturbed,
            kernels.disturbed(columns, soft) if held is None else attached.disturbed(columns, soft),
            {"sum": (0, 0)},
            **{name: rows.take(of.disturbed) for name, rows in twist.items()},
            pose=of.pose.take(of.disturbed),
            wrench=of.wrench.take(of.disturbed),
            point=of.point.take(of.disturbed),
            force=of.force_disturbed,
            **problem.given("reference", "external_force", "external_torque", *(("freedom",) if held else ())),
        )


def _bind_newton_euler(of: Declaration) -> None:
    """Physics of a free object from knot to knot."""
    problem, exerting = of.problem, bool(of.structure.model.exerted)
    now, later, names = np.arange(of.knots - 1), np.arange(1, of.knots), ANSWER if exerting else ()
    of.bind(
        now,
        newton_euler.physics(exerting),
        {"defect": (0, 0)},
        pose=(of.pose.take(now), of.pose.take(later)),
        rate=(of.rate.take(now), of.rate.take(later)),
        wrench=(of.wrench.take(now), of.wrench.take(later)),
        middle_torque=of.middle_torque,
        **{name: (problem[name].take(now), problem[name].take(later)) for name in names},
        **of.at(now, "reference", "step", "gravity", "inertial", "inertia", "inverse"),
    )


def _bind_rest(of: Declaration) -> None:
    """A free object at both ends, and where it is held, at rest."""
    exerting, held = bool(of.structure.model.exerted), of.structure.model.schedule.hold_samples
    ends = np.unique([0, *held, of.knots - 1])
    still = {"pose": of.pose.take(ends), "wrench": of.wrench.take(ends)}
    given = of.at(ends, "reference", "gravity", *(ANSWER if exerting else ()))
    of.bind(ends, newton_euler.equilibrium(exerting), {"sum": (0, 0)}, **still, **given)


def bind_object(of: Declaration) -> None:
    """The object clear of palm and ground, and at its goals."""
    problem, model, every = of.problem, of.structure.model, np.arange(of.knots)
    of.bind(
        every,
        kernels.object_apart(model.kinds, model.ground is not None),
        {"palm": (model.clearance, np.inf), "ground": (-GOAL_TOLERANCE, np.inf)},
        pose=of.pose,
        **of.at(every, "reference", "palm_position", "palm_quaternion", "palm_radius", "ground_height", "bodies"),
    )
    if model.tool is None:
        goals = problem.parameter("goals", (len(model.goal_positions), 6), quantity="goal_pose")
        problem.bind(kernels.meet_goal(), pose=of.pose.take(model.schedule.goal_samples), goal_pose=goals)
    else:
        problem.parameter("tool", (1, 3))
        target = problem.parameter("tool_path", (of.knots, 3), quantity="target")
        given = problem.given("reference", "tool")
        of.bind(every, kernels.tool_point(), {"on_path": FREE}, pose=of.pose, target=target, **given)


def bind_ground(of: Declaration) -> None:
    """The object's contact with the ground: on both surfaces, in its cone, rolling."""
    problem, structure = of.problem, of.structure
    friction = problem.parameter("ground_friction", (1, 1), quantity="friction")
    column, c = len(structure.contacts), structure.columns[-1]
    span, kind = (3 * column, 3 * column + 3, c), type(structure.model.touched[c])
    point, force = of.point.entries(*span), of.force.entries(*span)
    touching = np.flatnonzero(structure.touching[:, column])
    of.bind(
        touching,
        kernels.ground_contact(kind),
        {"on_surfaces": (0, 0), "opposed": (0, 0), "facing": (-np.inf, -0.5), **IN_CONE},
        pose=of.pose.take(touching),
        point=point.take(touching),
        force=force.take(touching),
        friction=friction,
        **of.at(touching, "reference", "ground_height"),
        **of.of(c, touching, "body", "wanted_point", "wanted_force"),
    )
    start = np.flatnonzero(structure.active[:-1, column])
    of.bind(
        start,
        kernels.ground_rolling(kind),
        {"no_slip": FREE},
        pose=(of.pose.take(start), of.pose.take(start + 1)),
        point=(point.take(start), point.take(start + 1)),
        **of.at(start, "reference", "step"),
        **of.of(c, start, "body"),
    )
    first = np.intersect1d(start, start - 1)  # of three knots at which it touches
    points = [point.take(first + k) for k in range(3)]
    problem.bind(kernels.ground_wander(), point=points, step=of.steps(first, first + 1))
    disturbed = np.flatnonzero(structure.active[of.disturbed, column])
    if len(disturbed):
        knots = of.disturbed[disturbed]
        forces = of.force_disturbed.take(disturbed).entries(*span)
        reference = problem["reference"]
        kernel = kernels.disturbed_ground()
        of.bind(knots, kernel, IN_CONE, pose=of.pose.take(knots), force=forces, reference=reference, friction=friction)
