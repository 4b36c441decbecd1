"""Joints that share motors in the refine stage: the commands of all joints on N lines, at every knot.

A joint's command is its angle and what its spring gives by to exert its torque, q + τ / k: τ of contact force and
torsional moment, by the contact's Jacobian. It is q₀ + C s: the offsets q₀, the ratios C and the motors' positions s
are variables. A finger that touches nothing exerts nothing, and its commands are its angles.
"""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import ArrayLike, NDArray

from casadi_hands.geometry.bodies import Body
from casadi_hands.geometry.bodies.capsule import Segment
from casadi_hands.motion import derivative
from casadi_hands.nlp import Kernel
from casadi_hands.problem.coupling import Coupling
from casadi_hands.stages.refine.declaration import Declaration
from casadi_hands.stages.refine.finger_kernels import Scene, free_morphology
from casadi_hands.terms import constraints as limits
from casadi_hands.terms import finger

Array = NDArray[np.float64]
# rad that commands may be off their lines: with penalties, and at last.
OFF_LINES = {"penalty": 0.3, "stiff penalty": 0.05, "hard constraints": 1e-5}


def _lines(kernel: Kernel, joints: int, motors: int) -> SX:
    """Commands (n,) that the motors give a finger's joints."""
    ratios = ca.reshape(kernel.variable("ratios", joints * motors), motors, joints)
    return kernel.variable("offsets", joints) + ca.mtimes(ratios.T, kernel.variable("motors", motors))


@cache
def idle(joints: int, motors: int) -> Kernel:
    """A finger that touches nothing, at one knot."""
    kernel = Kernel("coupling_idle")
    kernel.constrain(limits.ON_LINES, kernel.variable("angles", joints) - _lines(kernel, joints, motors))
    return kernel


@cache
def pressing(joints: int, kind: type[Body], soft: bool, motors: int) -> Kernel:
    """A finger that touches, at one knot.

    Args:
        joints: of the finger.
        kind: of the body that it touches.
        soft: whether its tip resists a twist.
        motors: of the hand.
    """
    kernel = Kernel("coupling")
    symbols = free_morphology(kernel, joints)
    pose, point, force = kernel.variable("pose", 6), kernel.variable("point", 3), kernel.variable("force", 3)
    angles = kernel.variable("angles", joints)
    scene, stiffness = Scene.declare(kernel, kind), kernel.parameter("stiffness")
    touch = scene.touch(pose, point, angles, symbols)
    # Where the force acts on the link: its own surface, which may be a little off the object's.
    from_axis = Segment(ca.vertcat(0, 0, scene.hinge), ca.vertcat(0, 0, symbols.lengths[-1])).offset(touch.on_link)
    on_surface = touch.on_link - from_axis + scene.radii[1] * touch.link_normal
    here = symbols.placed(angles, scene.radii, on_surface)
    torque = ca.mtimes(here.jacobian.T, ca.mtimes(touch.rotation, force))
    if soft:
        moment = kernel.parameter("torsion_radius") * kernel.variable("torsion", 1) * touch.normal
        # A joint's own turn leaves its axis where it is.
        axes = [ca.mtimes(here.rotations[:, 3 * j : 3 * j + 3], symbols.axes[:, j]) for j in range(joints)]
        torque += ca.mtimes(ca.horzcat(*axes).T, ca.mtimes(touch.rotation, moment))
    kernel.constrain(limits.ON_LINES, angles + torque / stiffness - _lines(kernel, joints, motors))
    return kernel


@cache
def motor_motion(motors: int, limited: bool) -> Kernel:
    """The motors' positions at three knots: smooth, and within the speed limit if there is one."""
    kernel = Kernel("motor_motion")
    positions = [kernel.variable(f"motors{i}", motors, "motors", i) for i in range(3)]
    steps = [kernel.parameter(f"step{i}", 1, "step", i) for i in range(2)]
    kernel.cost(finger.MOTOR_ACCELERATION, derivative(positions, steps))
    if limited:
        speeds = [(positions[i + 1] - positions[i]) / steps[i] for i in range(2)]
        kernel.constrain(limits.MOTOR_SPEED, ca.vertcat(*speeds))
    return kernel


@cache
def motor_torque(joints: tuple[int, ...], motors: int) -> Kernel:
    """The torques of all motors at one knot, by virtual work of the springs of all fingers' joints."""
    kernel = Kernel("motor_torque")
    positions, stiffness = kernel.variable("motors", motors), kernel.parameter("stiffness")
    total = SX.zeros(motors, 1)
    for i, n in enumerate(joints):
        ratios = ca.reshape(kernel.variable(f"ratios{i}", n * motors, "ratios", i), motors, n)
        stretch = kernel.variable(f"offsets{i}", n, "offsets", i) + ca.mtimes(ratios.T, positions)
        total += stiffness * ca.mtimes(ratios, stretch - kernel.variable(f"angles{i}", n, "angles", i))
    kernel.constrain(limits.MOTOR_TORQUE, total)
    return kernel


def bind(of: Declaration) -> None:
    """Bind the commands of all fingers' joints to the motors' lines."""
    structure, problem, count = of.structure, of.problem, of.structure.model.motors
    soft = bool(structure.model.torsion)
    for i, (c, n) in enumerate(zip(structure.contacts, structure.joints, strict=True)):
        touching = structure.touching[:, i]
        for on, knots in ((True, np.flatnonzero(touching)), (False, np.flatnonzero(~touching))):
            if not len(knots):
                continue
            lines = {name: rows.constant(len(knots)) for name, rows in of.lines[i].items()}
            lines |= {"motors": of.motors.take(knots), "angles": of.angles[i].take(knots)}
            if not on:
                of.bind(knots, idle(n, count), {"on_lines": (0, 0)}, (c,), f"coupling_idle{c}", **lines)
                continue
            point, force = (rows.entries(3 * i, 3 * i + 3, c).take(knots) for rows in (of.point, of.force))
            twist = {"torsion": of.torsion.entries(i, i + 1, c).take(knots)} if soft else {}
            of.bind(
                knots,
                pressing(n, type(structure.model.touched[c]), soft, count),
                {"on_lines": (0, 0)},
                (c,),
                f"coupling{c}",
                **{name: rows.constant(len(knots)) for name, rows in of.shape[i].items()},
                **lines,
                **twist,
                pose=of.pose.take(knots),
                point=point,
                force=force,
                stiffness=problem["stiffness"],
                **(problem.given("torsion_radius") if soft else {}),
                **of.scene(c, knots),
                **of.of(c, knots, "frames"),
            )
    first = np.arange(of.knots - 2)
    three = [of.motors.take(first + offset) for offset in range(3)]
    torque, speed = structure.model.torque_limit, structure.model.speed_limit
    kernel = motor_motion(count, bool(np.isfinite(speed)))
    of.bind(first, kernel, {"speed": (-speed, speed)}, motors=three, step=of.steps(first, first + 1))
    if np.isfinite(torque):
        every = np.arange(of.knots)
        of.bind(
            every,
            motor_torque(structure.joints, count),
            {"torque": (-torque, torque)},
            motors=of.motors,
            angles=of.angles,
            stiffness=problem["stiffness"],
            **{name: [rows[name].constant(of.knots) for rows in of.lines] for name in ("ratios", "offsets")},
        )


def constraint_bounds(of: Declaration, what: str, scale: float = 1.0) -> dict[str, tuple[ArrayLike, ArrayLike]]:
    """How far commands may be off their lines in a step."""
    off = scale * OFF_LINES[what]
    return {name: (-off, off) for name in of.problem.constraint_rows if name.endswith(".on_lines")}


def start(of: Declaration, coupling: Coupling) -> dict[str, Array]:
    """Values of the coupling's variables."""
    values = {"motors": coupling.positions}
    for c, rows in zip(of.structure.contacts, _rows(of), strict=True):
        values[f"ratios{c}"] = coupling.ratios[rows].reshape(1, -1)
        values[f"offsets{c}"] = coupling.offsets[rows].reshape(1, -1)
    return values


def bounds(
    of: Declaration, coupling: Coupling, sizes: tuple[float, float], exact: bool
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Lower and upper bounds of ratios and positions.

    Args:
        of: the problem.
        coupling: as it is.
        sizes: the smallest and the largest size of a ratio, of joints that a motor turns at all.
        exact: whether each ratio is to be one of these sizes, or zero; else it is free up to the largest.
    """
    least, most = sizes
    ratios = coupling.ratios
    lower, upper = np.full_like(ratios, -most), np.full_like(ratios, most)
    if exact:
        turned = np.abs(ratios) >= 0.5 * least
        lower = np.where(turned, np.where(ratios > 0, least, -most), 0.0)
        upper = np.where(turned, np.where(ratios > 0, most, -least), 0.0)
    leaders = list(coupling.leaders)
    lower[leaders] = upper[leaders] = np.eye(coupling.motors)
    free = np.full(coupling.positions.shape, np.inf)
    free[0] = 0.0
    found: list[dict[str, Array]] = [{"motors": -free}, {"motors": free}]
    for bound, values in zip((lower, upper), found, strict=True):
        for c, rows in zip(of.structure.contacts, _rows(of), strict=True):
            values[f"ratios{c}"] = bound[rows].reshape(1, -1)
    return found[0], found[1]


def result(of: Declaration, values: dict[str, Array], leaders: tuple[int, ...]) -> Coupling:
    """The coupling that a solve found."""
    count = of.structure.model.motors
    ratios = np.vstack([values[f"ratios{c}"].reshape(-1, count) for c in of.structure.contacts])
    offsets = np.concatenate([values[f"offsets{c}"].reshape(-1) for c in of.structure.contacts])
    return Coupling(ratios, offsets, values["motors"], leaders)


def _rows(of: Declaration) -> list[slice]:
    """Which joints of the hand are each finger's."""
    ends = np.cumsum([0, *of.structure.joints])
    return [slice(a, b) for a, b in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True)]
