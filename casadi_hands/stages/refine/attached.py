"""An object on a joint in the refine stage: its pose is the joint's, and physics is asked along the one coordinate.

The joint neither moves in the world nor in the object, so that the contacts' part of what moves it along is a constant
row, the twist, times their wrench in the object's frame. Dry friction acts against the motion, which goes where
the next goal is; at rest up to ``HOLDING`` of it does what balance asks. Between knots the coordinate is the cubic
that has its values and speeds at both.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import ArrayLike, NDArray

from casadi_hands.motion import conjugate, exponential, multiply, rotation_matrix
from casadi_hands.nlp import Kernel
from casadi_hands.problem.attachment import directions
from casadi_hands.problem.hand_motion import OnJoint
from casadi_hands.problem.model import Model
from casadi_hands.stages.refine.declaration import Declaration
from casadi_hands.stages.refine.newton_euler import GAUSS, GAUSS_WEIGHTS
from casadi_hands.stages.refine.torsion import twist_torque
from casadi_hands.terms import body
from casadi_hands.terms import constraints as limits

Array = NDArray[np.float64]
HOLDING = 0.5  # share of its dry friction that a joint at rest may need: who knows how much there is
_JOINT = (("turn_axis", 3), ("joint_axis", 3), ("pivot", 3), ("joint_start", 3), ("advance", 1), ("freedom", 6))
_LOADS = (("joint_mass", 1), ("joint_friction", 1), ("joint_stiffness", 1), ("joint_damping", 1))
_WORLD = (("reference", 4), ("gravity", 3))


def _given(kernel: Kernel, names: tuple[tuple[str, int], ...]) -> dict[str, SX]:
    return {name: kernel.parameter(name, size) for name, size in names}


@cache
def on_joint() -> Kernel:
    """Pose and velocities at a knot are those of the joint at its coordinate and speed, (12,)."""
    kernel = Kernel("on_joint")
    pose, rate = kernel.variable("pose", 6), kernel.variable("rate", 6)
    coordinate, speed = kernel.variable("coordinate", 1), kernel.variable("coordinate_speed", 1)
    joint, reference = _given(kernel, _JOINT), kernel.parameter("reference", 4)
    vector = coordinate * joint["turn_axis"]
    turned = exponential(vector)
    lever = ca.mtimes(rotation_matrix(turned), joint["joint_start"] - joint["pivot"])
    position = joint["pivot"] + lever + coordinate * joint["advance"] * joint["joint_axis"]
    velocity = ca.mtimes(rotation_matrix(multiply(turned, reference)), joint["freedom"][:3])
    due = ca.vertcat(position, vector, speed * velocity, speed * joint["freedom"][3:])
    kernel.constrain(limits.ON_JOINT, ca.vertcat(pose, rate) - due)
    return kernel


def _outside(given: dict[str, SX], coordinate: SX, force: SX, torque: SX) -> SX:
    """What weight, and a force and a torque (3,) in the world, do along the coordinate, its spring's force added."""
    to_object = rotation_matrix(conjugate(multiply(exponential(coordinate * given["turn_axis"]), given["reference"])))
    free, pull = given["freedom"], given["gravity"] + force
    work = ca.dot(free[:3], ca.mtimes(to_object, pull)) + ca.dot(free[3:], ca.mtimes(to_object, torque))
    return work - given["joint_stiffness"] * coordinate


@cache
def physics() -> Kernel:
    """Newton and Euler along the coordinate from one knot to the next, as `newton_euler.physics` has them."""
    kernel = Kernel("physics")
    q, speeds, drags = (
        [kernel.variable(f"{name}{i}", 1, name, i) for i in range(2)]
        for name in ("coordinate", "coordinate_speed", "drag")
    )
    rates, wrenches = ([kernel.variable(f"{name}{i}", 6, name, i) for i in range(2)] for name in ("rate", "wrench"))
    middle, step = kernel.variable("middle_torque", 3), kernel.parameter("step")
    given = _given(kernel, (("turn_axis", 3), ("freedom", 6), *_LOADS, *_WORLD, ("inertial", 1)))
    forces, torques = (
        [kernel.parameter(f"{name}{i}", 3, name, i) for i in range(2)] for name in ("planned_force", "planned_torque")
    )
    free, inertia = given["freedom"], given["inertial"] * given["joint_mass"]
    bend = 2 * (wrenches[0][3:] + wrenches[1][3:]) - 4 * middle

    def blend(ends: list[SX], s: float) -> SX:
        return (1 - s) * ends[0] + s * ends[1]

    sped, moved, mean = SX(0), SX(0), SX(0)
    for s, weight in zip(GAUSS.tolist(), GAUSS_WEIGHTS.tolist(), strict=True):
        launched, arriving = step * s * (1 - s) ** 2 * speeds[0], step * s**2 * (s - 1) * speeds[1]
        there = q[0] + s**2 * (3 - 2 * s) * (q[1] - q[0]) + launched + arriving
        pushed = ca.dot(free, blend(wrenches, s)) + s * (s - 1) * ca.dot(free[3:], bend)
        pushed += given["joint_friction"] * blend(drags, s)
        acceleration = (pushed + _outside(given, there, blend(forces, s), blend(torques, s))) / inertia
        sped += weight * step * acceleration
        moved += weight * (1 - s) * step**2 * acceleration
        mean += weight * there
    damped = given["joint_damping"] / inertia
    sped -= damped * (q[1] - q[0])
    moved -= damped * step * (mean - q[0])
    kernel.cost(body.KNOT_ACCELERATION, (rates[1] - rates[0]) / step)
    defect = ((q[1] - q[0] - step * speeds[0] - moved) / step, speeds[1] - speeds[0] - sped)
    # As the forces that nothing exerts: of a light object, motions would be too much of a lever.
    kernel.constrain(limits.DEFECT, inertia / step * ca.vertcat(*defect))
    return kernel


@cache
def equilibrium() -> Kernel:
    """What holds the object still at one knot along its coordinate, friction helping as far as it may, (1,)."""
    kernel = Kernel("equilibrium")
    coordinate, total = kernel.variable("coordinate", 1), kernel.variable("wrench", 6)
    drag = kernel.variable("drag", 1)
    given = _given(kernel, (("turn_axis", 3), ("freedom", 6), *_LOADS[1:3], *_WORLD))
    force, torque = kernel.parameter("planned_force", 3), kernel.parameter("planned_torque", 3)
    outside = _outside(given, coordinate, force, torque) + given["joint_friction"] * drag
    kernel.constrain(limits.EQUILIBRIUM, ca.dot(given["freedom"], total) + outside)
    return kernel


@cache
def disturbed(contacts: int, soft: bool) -> Kernel:
    """Second forces at a knot that, with a push and the same torsion, do along the joint what the first do."""
    kernel = Kernel("disturbed")
    pose, total = kernel.variable("pose", 6), kernel.variable("wrench", 6)
    points, forces = (ca.reshape(kernel.variable(name, 3 * contacts), 3, contacts) for name in ("point", "force"))
    names = (("reference", 4), ("external_force", 3), ("external_torque", 3), ("freedom", 6))
    reference, push, turn, free = (kernel.parameter(n, k) for n, k in names)
    to_object = rotation_matrix(conjugate(multiply(exponential(pose[3:]), reference)))
    torque = sum((ca.cross(points[:, i], forces[:, i]) for i in range(contacts)), SX.zeros(3, 1))
    made = ca.vertcat(ca.sum2(forces), torque + twist_torque(kernel, soft))
    pushed = ca.vertcat(ca.mtimes(to_object, push), ca.mtimes(to_object, turn))
    kernel.constrain(limits.DISTURBED_WRENCH, ca.dot(free, made + pushed - total))
    kernel.cost(body.DISTURBED_FORCE, forces)
    return kernel


def bind(of: Declaration) -> None:
    """Bind the object to its joint, and physics along it."""
    problem, now, later = of.problem, np.arange(of.knots - 1), np.arange(1, of.knots)
    every, rows = np.arange(of.knots), of.rows
    joint = {name: problem[name] for name, _ in _JOINT}
    loads = {name: problem[name] for name, _ in (*_LOADS, ("turn_axis", 3), ("freedom", 6))}
    of.bind(
        every,
        on_joint(),
        {"on_joint": (0, 0)},
        pose=of.pose,
        rate=of.rate,
        coordinate=rows["coordinate"],
        coordinate_speed=rows["coordinate_speed"],
        reference=problem["reference"],
        **joint,
    )
    both = {"rate": of.rate, "wrench": of.wrench, **rows}
    of.bind(
        now,
        physics(),
        {"defect": (0, 0)},
        **{name: (each.take(now), each.take(later)) for name, each in both.items()},
        middle_torque=of.middle_torque,
        **{name: (problem[name].take(now), problem[name].take(later)) for name in ("planned_force", "planned_torque")},
        **loads,
        **of.at(now, "reference", "step", "gravity", "inertial"),
    )


def bind_rest(of: Declaration) -> None:
    """Bind that the object rests at both ends without a jolt."""
    problem, rows, ends = of.problem, of.rows, np.array([0, of.knots - 1])
    still = {name: problem[name] for name in ("turn_axis", "freedom", "joint_friction", "joint_stiffness")}
    of.bind(
        ends,
        equilibrium(),
        {"sum": (0, 0)},
        coordinate=rows["coordinate"].take(ends),
        drag=rows["drag"].take(ends),
        wrench=of.wrench.take(ends),
        **still,
        **of.at(ends, "reference", "gravity", "planned_force", "planned_torque"),
    )


def parameters(model: Model) -> dict[str, ArrayLike]:
    """Values of the parameters of the joint, if any, and of the world's answer to what is exerted on it."""
    joint, plan = model.attachment, model.scenarios[0]
    if joint is None and not model.exerted:
        return {}
    answer: dict[str, ArrayLike] = {"planned_force": plan.force, "planned_torque": plan.torque}
    if joint is None:
        return answer
    return answer | {
        "turn_axis": joint.turn_axis,
        "joint_axis": joint.world_axis,
        "pivot": joint.pivot,
        "joint_start": joint.start,
        "advance": joint.advance,
        "freedom": joint.twist,
        "joint_mass": joint.mass,
        "joint_friction": joint.friction,
        "joint_stiffness": joint.stiffness,
        "joint_damping": joint.damping,
    }


def bounds(model: Model) -> tuple[dict[str, Array], dict[str, Array]]:
    """Lower and upper bounds of the joint's speed and friction; none of a free object.

    It rests at both ends and where no goal leads on. With friction it goes where goals are, against all of it.
    """
    joint, schedule = model.attachment, model.schedule
    if joint is None:
        return {}, {}
    ways = directions(joint, schedule.samples[schedule.goal_samples], schedule.samples)[:, None]
    ends = np.zeros_like(ways, bool)
    ends[[0, -1]] = True
    if not joint.friction:
        speed = np.where(ends, 0.0, np.inf)
        none = np.zeros_like(speed)
        return {"coordinate_speed": -speed, "drag": none}, {"coordinate_speed": speed, "drag": none}
    room = np.where(ways == 0, HOLDING, 0.0)
    slow, fast = np.where(ways < 0, -np.inf, 0.0), np.where(ways > 0, np.inf, 0.0)
    return {"coordinate_speed": slow, "drag": -ways - room}, {"coordinate_speed": fast, "drag": -ways + room}


def result(model: Model, values: Mapping[str, Array]) -> OnJoint | None:
    """The joint's coordinate, speed and friction of a solve; None of a free object."""
    joint = model.attachment
    if joint is None:
        return None
    coordinate, speed, drag = (values[name][:, 0] for name in ("coordinate", "coordinate_speed", "drag"))
    return OnJoint(coordinate, speed, joint.friction * drag)
