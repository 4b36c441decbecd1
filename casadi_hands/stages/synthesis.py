"""Stage 2: morphology, joint angles and fingertip contacts of some fingers, everything in the palm frame (2.2.2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from casadi_hands.motion import linear
from casadi_hands.nlp import Kernel, Options, Problem, Rows, Solution, Solver
from casadi_hands.stages.finger_symbols import morphology, tip_point
from casadi_hands.stages.target import Target
from casadi_hands.terms import clearance, finger

Array = NDArray[np.float64]
# All but the first step start near their minimum, which a larger barrier leaves first.
OPTIONS = Options(max_iter=150, tol=1e-3, acceptable_tol=1e-2, mu_init=1e-3)
BETWEEN = 2  # collision samples between neighbouring keyframes
AXIS_RANGE = 2.2  # rad, how far an axis may turn from its seed
MARGIN = 0.03  # clearance asked of bodies that need not touch, half extents
LOOSE = 0.4  # how far the box bounds of angles and lengths are opened while annealing


@dataclass(frozen=True)
class FingerSeed:
    """A start for one finger, nondimensional, palm frame.

    Attributes:
        base: (2,).
        lengths: (n,).
        frames: (n, 3, 3) rotations whose third columns are the axes at ``axes`` = 0.
        axes: (n, 2) exponential coordinates from those.
        angles: (N, n) at the keyframes, rad.
        tips: (strings, 2) surface coordinates of the contact in each string of active keyframes.
    """

    base: Array
    lengths: Array
    frames: Array
    axes: Array
    angles: Array
    tips: Array

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.lengths)

    @property
    def axis_vectors(self) -> Array:
        """(n, 3) unit axes in parent frames."""
        angle = np.sqrt((self.axes**2).sum(axis=1) + 1e-10)
        local = np.column_stack([(np.sin(angle) / angle)[:, None] * self.axes, np.cos(angle)])
        return np.asarray(np.einsum("nij,nj->ni", self.frames, local))


@dataclass(frozen=True)
class Synthesised:
    """Fingers after a solve, and how well each serves its contact.

    Attributes:
        fingers: one for each contact in ``contacts``.
        contacts: index of each finger's contact.
        solution: the last solve; its objective ranks hands.
        runs: every solve: (annealing step, solution).
    """

    fingers: tuple[FingerSeed, ...]
    contacts: tuple[int, ...]
    solution: Solution
    runs: tuple[tuple[str, Solution], ...]


class SynthesisStage:
    """The problem of some fingers together; one finger alone is a hand of one."""

    def __init__(self, target: Target, contacts: tuple[int, ...], joints: tuple[int, ...]) -> None:
        """Build the problem.

        Args:
            target: what the fingers follow.
            contacts: index of the contact of each finger.
            joints: number of joints of each finger.
        """
        self.target, self.contacts, self.joints = target, contacts, joints
        self.problem = problem = Problem()
        shortest, longest = target.link_length
        count = len(target.times)
        rows: list[dict[str, Rows]] = []
        for contact, n in zip(contacts, joints, strict=True):
            reach = target.palm_radius
            rows.append(
                {
                    "base": problem.variable(f"base{contact}", (1, 2), -reach, reach),
                    "lengths": problem.variable(f"lengths{contact}", (1, n), shortest, longest),
                    "axes": problem.variable(f"axes{contact}", (1, 2 * n), -AXIS_RANGE, AXIS_RANGE),
                    "angles": problem.variable(f"angles{contact}", (count, n), *target.joint_limits),
                    "tips": problem.variable(
                        f"tips{contact}", (target.strings(contact), 2), -target.tip_arc, target.tip_arc
                    ),
                }
            )
        self._shared_parameters()
        for i in range(len(contacts)):
            self._bind_finger(i, rows[i])
            for j in range(i):
                self._bind_pair(i, j, rows[i], rows[j])
        self.solver = Solver(problem)

    def _shared_parameters(self) -> None:
        problem, target = self.problem, self.target
        samples = len(target.collision_times(BETWEEN))
        for name in ("link_radius", "palm_radius", "shortest", "longest", "lowest", "highest", "margin"):
            problem.parameter(name, (1, 1))
        problem.parameter("primitives", (samples, 7 * target.primitive_count))
        problem.parameter("up", (samples, 3))
        problem.parameter("ground", (samples, 1))

    def _bind_finger(self, index: int, rows: dict[str, Rows]) -> None:
        problem, target, contact, n = self.problem, self.target, self.contacts[index], self.joints[index]
        p, count = problem.parameters, len(target.times)
        frames = problem.parameter(f"frames{contact}", (1, 9 * n))
        wanted = [problem.parameter(f"{name}{contact}", (count, 3)) for name in ("target", "force")]
        wanted.append(problem.parameter(f"active{contact}", (count, 1)))
        body = [rows["base"], rows["lengths"], rows["axes"]]
        at_keyframes = [row.constant(count) for row in body]
        tips = rows["tips"].take(target.string_of(contact))
        limits = [p[name] for name in ("link_radius", "lowest", "highest")]
        problem.bind(_follow(n), [*at_keyframes, rows["angles"], tips], [frames, *wanted, *limits])
        problem.bind(_build(n), body[:2], [p["palm_radius"], p["link_radius"], p["shortest"], p["longest"]])
        times = target.collision_times(BETWEEN)
        angles = rows["angles"].combine(linear(target.times, times))
        scene = [p[name] for name in ("link_radius", "palm_radius", "margin", "primitives", "up", "ground")]
        kernel = _collide(n, target.primitive_count)
        problem.bind(kernel, [*[r.constant(len(times)) for r in body], angles], [frames, *scene])
        idle = np.flatnonzero(~target.active[1:-1, contact]) + 1
        if len(idle):
            three = [rows["angles"].take(idle + offset) for offset in (-1, 0, 1)]
            weights = problem.parameter(f"idle_step{contact}", (len(idle), 1))
            problem.bind(_travel(n), [*[r.constant(len(idle)) for r in body], *three], [frames, weights])

    def _bind_pair(self, i: int, j: int, rows: dict[str, Rows], others: dict[str, Rows]) -> None:
        times = self.target.collision_times(BETWEEN)
        weights = linear(self.target.times, times)
        bound: list[Rows] = []
        for r in (rows, others):
            bound += [
                *[r[name].constant(len(times)) for name in ("base", "lengths", "axes")],
                r["angles"].combine(weights),
            ]
        p = self.problem.parameters
        frames = [p[f"frames{self.contacts[k]}"] for k in (i, j)]
        self.problem.bind(_keep_apart(self.joints[i], self.joints[j]), bound, [*frames, p["link_radius"], p["margin"]])

    def solve(
        self, seeds: tuple[FingerSeed, ...], weights: Mapping[str, object], options: Options = OPTIONS
    ) -> Synthesised:
        """Take seeds through the annealing schedule of Table 2.3.

        Before the last step angles and lengths may leave their limits, which then cost (eq. 2.22, 2.27); in the
        last step the limits are bounds.
        """
        values = self._values(seeds)
        parameters = self._parameters(seeds)
        runs: list[tuple[str, Solution]] = []
        for step in range(3):
            last = step == 2
            given = {**parameters, **self._weights(weights, step)}
            solution = self.solver.solve(values, given, options, *(() if last else self._loosened()))
            values = solution.values
            runs.append((f"anneal {step}", solution))
        fingers = tuple(self._finger(solution, i, seed) for i, seed in enumerate(seeds))
        return Synthesised(fingers, self.contacts, solution, tuple(runs))

    def _loosened(self) -> tuple[dict[str, Array], dict[str, Array]]:
        low, high = self.target.joint_limits
        lower = {f"angles{c}": np.array(low - LOOSE) for c in self.contacts}
        upper = {f"angles{c}": np.array(high + LOOSE) for c in self.contacts}
        lower |= {f"lengths{c}": np.array(0.3 * self.target.link_length[0]) for c in self.contacts}
        return lower, upper

    def _values(self, seeds: tuple[FingerSeed, ...]) -> dict[str, Array]:
        values = {}
        for contact, seed in zip(self.contacts, seeds, strict=True):
            values[f"base{contact}"] = seed.base
            values[f"lengths{contact}"] = seed.lengths
            values[f"axes{contact}"] = seed.axes.reshape(1, -1)
            values[f"angles{contact}"] = seed.angles
            values[f"tips{contact}"] = seed.tips
        return values

    def _parameters(self, seeds: tuple[FingerSeed, ...]) -> dict[str, Array | float]:
        target = self.target
        primitives, up, ground = self._scene
        values: dict[str, Array | float] = {
            "link_radius": target.link_radius,
            "palm_radius": target.palm_radius,
            "shortest": target.link_length[0],
            "longest": target.link_length[1],
            "lowest": target.joint_limits[0],
            "highest": target.joint_limits[1],
            "margin": MARGIN,
            "primitives": primitives,
            "up": up,
            "ground": ground[:, None],
        }
        for contact, seed in zip(self.contacts, seeds, strict=True):
            values[f"frames{contact}"] = seed.frames.transpose(0, 2, 1).reshape(1, -1)
            values[f"target{contact}"] = target.points[:, contact]
            values[f"force{contact}"] = target.forces[:, contact]
            values[f"active{contact}"] = target.active[:, contact, None].astype(float)
            if f"idle_step{contact}" in self.problem.parameters:
                idle = np.flatnonzero(~target.active[1:-1, contact]) + 1
                values[f"idle_step{contact}"] = ((target.times[idle + 1] - target.times[idle - 1]) / 2)[:, None]
        return values

    @cached_property
    def _scene(self) -> tuple[Array, Array, Array]:
        """What fingers must keep clear of, at the times of the clearance's samples."""
        return self.target.scene(self.target.collision_times(BETWEEN))

    def _weights(self, weights: Mapping[str, object], step: int) -> dict[str, float]:
        samples = {"collision": len(self.target.collision_times(BETWEEN))}
        once = {"length", "minimum_length", "finger_base"}
        values = {}
        for term in self.problem.terms:
            weight = weights[term]
            weight = float(weight[step] if isinstance(weight, tuple | list) else weight)  # type: ignore[arg-type]
            values[f"weight.{term}"] = weight / (1 if term in once else samples.get(term, len(self.target.times)))
        return values

    def _finger(self, solution: Solution, index: int, seed: FingerSeed) -> FingerSeed:
        contact, values = self.contacts[index], solution.values
        return FingerSeed(
            base=values[f"base{contact}"][0],
            lengths=values[f"lengths{contact}"][0],
            frames=seed.frames,
            axes=values[f"axes{contact}"].reshape(-1, 2),
            angles=values[f"angles{contact}"],
            tips=values[f"tips{contact}"],
        )


@cache
def _follow(joints: int) -> Kernel:
    """One finger at one keyframe: eq. 2.18, 2.23, 2.24 and 2.27."""
    kernel = Kernel("follow")
    frames = kernel.parameter("frames", 9 * joints)
    symbols = morphology(kernel.variable, frames, joints)
    angles, tip = kernel.variable("angles", joints), kernel.variable("tip", 2)
    target, force, active, radius, lowest, highest = (
        kernel.parameter(name, size)
        for name, size in (("target", 3), ("force", 3), ("active", 1), ("radius", 1), ("lowest", 1), ("highest", 1))
    )
    point, _ = tip_point(tip, symbols.lengths[-1], radius)
    placed = symbols.placed(angles, radius, point)
    kernel.cost("tip_target", active * (placed.contact - target))
    kernel.cost("null_space", active * finger.null_space(placed.jacobian, force), "sum")
    kernel.cost("torque", active * finger.joint_torques(placed.jacobian, force))
    kernel.cost("joint_limits", finger.beyond_limits(angles, lowest, highest), "sum")
    return kernel


@cache
def _build(joints: int) -> Kernel:
    """One finger's shape: eq. 2.21, 2.22 and 2.25."""
    kernel = Kernel("build")
    base, lengths = kernel.variable("base", 2), kernel.variable("lengths", joints)
    palm_radius, radius, shortest, longest = (
        kernel.parameter(n) for n in ("palm_radius", "radius", "shortest", "longest")
    )
    kernel.cost("length", lengths)
    kernel.cost("minimum_length", finger.beyond_limits(lengths, shortest, longest), "sum")
    kernel.cost("finger_base", finger.off_palm(base, palm_radius - radius), "sum")
    return kernel


@cache
def _collide(joints: int, primitives: int) -> Kernel:
    """One finger against object, palm, ground and itself at one time (eq. 2.20)."""
    kernel = Kernel("collide")
    frames = kernel.parameter("frames", 9 * joints)
    symbols = morphology(kernel.variable, frames, joints)
    angles = kernel.variable("angles", joints)
    radius, palm_radius, margin = (kernel.parameter(name) for name in ("radius", "palm_radius", "margin"))
    shapes = ca.reshape(kernel.parameter("primitives", 7 * primitives), 7, primitives)
    up, ground = kernel.parameter("up", 3), kernel.parameter("ground")
    ends = symbols.placed(angles, radius).ends
    apart = [
        clearance.links_and_palm(ends, radius, palm_radius),
        clearance.links_and_ground(ends, radius, up, ground),
        clearance.links_of_one(ends, radius),
    ]
    if joints > 1:
        apart.append(clearance.links_and_object(ends[:-1], radius, shapes))
    touching = clearance.links_and_object(ends[-1:], radius, shapes)
    kernel.cost("collision", clearance.overlap(ca.vertcat(margin - ca.vertcat(*apart), -touching)), "sum")
    return kernel


@cache
def _keep_apart(joints: int, other_joints: int) -> Kernel:
    """Two fingers against each other at one time (eq. 2.20)."""
    kernel = Kernel("keep_apart")
    frames, other_frames = kernel.parameter("frames", 9 * joints), kernel.parameter("other_frames", 9 * other_joints)
    first = morphology(kernel.variable, frames, joints, "_a")
    angles = kernel.variable("angles_a", joints)
    second = morphology(kernel.variable, other_frames, other_joints, "_b")
    other_angles = kernel.variable("angles_b", other_joints)
    radius, margin = kernel.parameter("radius"), kernel.parameter("margin")
    ends = first.placed(angles, radius).ends, second.placed(other_angles, radius).ends
    distances = clearance.links_and_links(*ends, radius)
    kernel.cost("collision", clearance.overlap(margin - distances), "sum")
    return kernel


@cache
def _travel(joints: int) -> Kernel:
    """A fingertip's acceleration at a keyframe where it touches nothing (eq. 2.26)."""
    kernel = Kernel("travel")
    frames = kernel.parameter("frames", 9 * joints)
    symbols = morphology(kernel.variable, frames, joints)
    # Wherever it stands: only how its tip moves counts.
    before, now, after = (symbols.placed(kernel.variable(f"angles{i}", joints), ca.SX(0)).tip for i in range(3))
    acceleration = finger.tip_acceleration(before, now, after, kernel.parameter("step"))
    kernel.cost("fingertip_acceleration", acceleration)
    return kernel
