"""Newton and Euler's laws in the refine stage: a free object from one knot to the next, and at rest."""

from __future__ import annotations

from functools import cache

import casadi as ca
from casadi import SX
from numpy.polynomial.legendre import leggauss

from casadi_hands.motion import conjugate, multiply, rotation_matrix
from casadi_hands.motion.pose import placed
from casadi_hands.nlp import Kernel
from casadi_hands.terms import body
from casadi_hands.terms import constraints as limits

# Gauss and Legendre's points and weights, for a step from 0 to 1.
GAUSS, GAUSS_WEIGHTS = (leggauss(3)[0] + 1) / 2, leggauss(3)[1] / 2


@cache
def physics(exerting: bool = False) -> Kernel:
    """Newton–Euler from one knot to the next; forces and contact points linear in the object's frame.

    What the world answers to an object that exerts something on it is linear in the world.

    The force is then linear in time and the torque quadratic: both ends and the middle say all of it. Orientation and
    spin between the knots are those of the quintic that has their values and first two derivatives at both, and
    accelerations are integrated over these by Gauss: sixth order in the step.
    """
    kernel = Kernel("physics")
    states = [(kernel.variable(f"pose{i}", 6, "pose", i), kernel.variable(f"rate{i}", 6, "rate", i)) for i in range(2)]
    wrenches = [kernel.variable(f"wrench{i}", 6, "wrench", i) for i in range(2)]
    middle = kernel.variable("middle_torque", 3)
    reference, step = kernel.parameter("reference", 4), kernel.parameter("step")
    gravity, inertial = kernel.parameter("gravity", 3), kernel.parameter("inertial")
    inertia = ca.reshape(kernel.parameter("inertia", 9), 3, 3)
    inverse = ca.reshape(kernel.parameter("inverse", 9), 3, 3)
    (torque0, torque1), change = (wrench[3:] for wrench in wrenches), wrenches[1][3:] - wrenches[0][3:]
    bend = 2 * (torque0 + torque1) - 4 * middle
    answers = [_answer(kernel, i) for i in range(2)] if exerting else []

    def answered(part: int, s: float) -> SX:
        return (1 - s) * answers[0][part] + s * answers[1][part]

    def angular(omega: SX, s: float, quaternion: SX) -> SX:
        torque = torque0 + s * change + s * (s - 1) * bend
        if exerting:
            torque += ca.mtimes(rotation_matrix(quaternion).T, answered(1, s))
        return ca.mtimes(inverse, torque / inertial - ca.cross(omega, ca.mtimes(inertia, omega)))

    def turning(quaternion: SX, omega: SX) -> SX:
        return multiply(quaternion, ca.vertcat(0, omega)) / 2

    turns, spins = [], []  # value, derivative and second derivative at both knots, by the share of the step
    for i, (pose, rate) in enumerate(states):
        (_, quaternion), omega = placed(pose, reference), rate[3:]
        alpha = step * angular(omega, i, quaternion)
        gyration = ca.cross(alpha, ca.mtimes(inertia, omega)) + ca.cross(omega, ca.mtimes(inertia, alpha))
        ahead = change + (2 * i - 1) * bend
        if exerting:
            turned_answer, to_object = answers[i][1], rotation_matrix(quaternion).T
            ahead += ca.mtimes(to_object, answers[1][1] - answers[0][1])
            ahead -= step * ca.cross(omega, ca.mtimes(to_object, turned_answer))
        jerk = step * ca.mtimes(inverse, ahead / inertial - gyration)
        turn = step * turning(quaternion, omega)
        turns.append((quaternion, turn, step * (turning(turn, omega) + turning(quaternion, alpha))))
        spins.append((omega, alpha, jerk))
    moved, sped, turned, spun = SX.zeros(3, 1), SX.zeros(3, 1), turns[0][0], SX.zeros(3, 1)
    for s, weight in zip(GAUSS.tolist(), GAUSS_WEIGHTS.tolist(), strict=True):
        quaternion, omega = (_quintic(start, end, s) for start, end in (turns, spins))
        force = (1 - s) * wrenches[0][:3] + s * wrenches[1][:3]
        pull = gravity + answered(0, s) if exerting else gravity
        acceleration = (ca.mtimes(rotation_matrix(quaternion), force) + pull) / inertial
        sped += weight * step * acceleration
        moved += weight * (1 - s) * step**2 * acceleration
        turned += weight * step * turning(quaternion, omega)
        spun += weight * step * angular(omega, s, quaternion)
    (before, rate0), (after, rate1) = states
    kernel.cost(body.KNOT_ACCELERATION, (rate1 - rate0) / step)
    off = (
        after[:3] - before[:3] - step * rate0[:3] - moved,
        2 * multiply(conjugate(turned), turns[1][0])[1:],
        rate1 - rate0 - ca.vertcat(sped, spun),
    )
    kernel.constrain(limits.DEFECT, ca.vertcat(*off))
    return kernel


def _answer(kernel: Kernel, place: int | None = None) -> tuple[SX, SX]:
    """Declare force and torque (3,), world, of the world's answer, at one of several knots if told so."""
    tag = "" if place is None else str(place)
    names = ("planned_force", "planned_torque")
    force, torque = (kernel.parameter(name + tag, 3, name, place) for name in names)
    return force, torque


def _quintic(start: tuple[SX, SX, SX], end: tuple[SX, SX, SX], s: float) -> SX:
    """At a share s of the step, the polynomial with given value, derivative and second derivative at both ends."""
    r = 1 - s
    return (
        r**3 * (1 + 3 * s + 6 * s**2) * start[0]
        + s**3 * (1 + 3 * r + 6 * r**2) * end[0]
        + r**3 * s * (1 + 3 * s) * start[1]
        - s**3 * r * (1 + 3 * r) * end[1]
        + (r**3 * s**2 * start[2] + s**3 * r**2 * end[2]) / 2
    )


@cache
def equilibrium(exerting: bool = False) -> Kernel:
    """The contacts' wrench that holds the object still at one knot: a motion starts and ends without a jolt."""
    kernel = Kernel("equilibrium")
    pose, total = kernel.variable("pose", 6), kernel.variable("wrench", 6)
    reference, gravity = kernel.parameter("reference", 4), kernel.parameter("gravity", 3)
    _, quaternion = placed(pose, reference)
    rotation, torque = rotation_matrix(quaternion), total[3:]
    if exerting:
        answer = _answer(kernel)
        gravity, torque = gravity + answer[0], torque + ca.mtimes(rotation.T, answer[1])
    kernel.constrain(limits.EQUILIBRIUM, ca.vertcat(ca.mtimes(rotation, total[:3]) + gravity, torque))
    return kernel
