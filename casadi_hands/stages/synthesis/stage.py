"""Stage 2: morphology, joint angles and fingertip contacts of some fingers, everything in the palm frame (2.2.2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from casadi_hands.geometry.bodies import width_of
from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.kinematics.symbols import morphology_sizes
from casadi_hands.motion import linear
from casadi_hands.nlp import Options, Parameter, Problem, Rows, Solution, Solver
from casadi_hands.stages.buildable import buildable, buildable_bounds
from casadi_hands.stages.synthesis.kernels import (
    build,
    collide,
    follow,
    keep_apart,
    travel,
)
from casadi_hands.stages.synthesis.target import Target

Array = NDArray[np.float64]
# All but the first step start near their minimum, which a larger barrier leaves first.
OPTIONS = Options(max_iter=150, tol=1e-3, acceptable_tol=1e-2, mu_init=1e-3)
BETWEEN = 2  # collision samples between neighbouring keyframes
AXIS_RANGE = 2.2  # rad, how far an axis may turn from its seed
MARGIN = 0.03  # clearance asked of bodies that need not touch, lengths
MORPHOLOGY = tuple(morphology_sizes(0))
_RADII, _LENGTHS = ("link_radius", "tip_radius"), ("shortest", "shortest_last", "longest")
LOOSE = 0.4  # how far the box bounds of angles and lengths are opened while annealing


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
        longest = target.link_length[1]
        count = len(target.times)
        rows: list[dict[str, Rows]] = []
        for c, n in zip(contacts, joints, strict=True):
            reach, arc = target.palm_radius, target.tip_arc
            shapes: dict[str, tuple[tuple[int, int], ArrayLike, float]] = {
                "base": ((1, 2), -reach, reach),
                "lengths": ((1, n), target.least_lengths(n), longest),
                "axes": ((1, 2 * n), -AXIS_RANGE, AXIS_RANGE),
                "bends": ((1, 2 * n), -target.model.bend, target.model.bend),
                "angles": ((count, n), *target.joint_limits),
                "tips": ((target.strings(c), 2), -arc, arc),
            }
            rows.append(
                {name: problem.variable(f"{name}{c}", *given, quantity=name, owner=c) for name, given in shapes.items()}
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
        for name in (*_RADII, *_LENGTHS, "palm_radius", "lowest", "highest", "margin"):
            problem.parameter(name, (1, 1))
        if target.model.servo:
            problem.parameter("servo_radius", (1, 1))
        problem.parameter("bodies", (samples, width_of(target.kinds)))
        problem.parameter("up", (samples, 3))
        problem.parameter("ground", (samples, 1))

    def _bind_finger(self, index: int, rows: dict[str, Rows]) -> None:
        problem, target, c, n = self.problem, self.target, self.contacts[index], self.joints[index]
        count = len(target.times)

        def own(name: str, shape: tuple[int, int]) -> Parameter:
            return problem.parameter(f"{name}{c}", shape, quantity=name, owner=c)

        frames = own("frames", (1, 9 * n))
        wanted = {name: own(name, (count, width)) for name, width in (("target", 3), ("force", 3), ("active", 1))}
        body = {name: rows[name] for name in MORPHOLOGY}

        def constant(instances: int) -> dict[str, Rows]:
            return {name: row.constant(instances) for name, row in body.items()}

        problem.bind(
            follow(n),
            **constant(count),
            angles=rows["angles"],
            tips=rows["tips"].take(target.string_of(c)),
            frames=frames,
            **wanted,
            **problem.given(*_RADII, "lowest", "highest"),
        )
        limits = problem.given("palm_radius", *_RADII, *_LENGTHS)
        problem.bind(build(n), base=rows["base"], lengths=rows["lengths"], bends=rows["bends"], **limits)
        if target.model.hinged or target.model.bend:
            kernel, bounds = buildable(n, target.model.hinged, bool(target.model.bend)), buildable_bounds(target.model)
            problem.bind(kernel, bounds, f"buildable{c}", axes=rows["axes"], bends=rows["bends"], frames=frames)
        times = target.collision_times(BETWEEN)
        around = (*_RADII, "palm_radius", "margin", "bodies", "up", "ground", *self._servos)
        problem.bind(
            collide(n, target.kinds, bool(self._servos)),
            **constant(len(times)),
            angles=rows["angles"].combine(linear(target.times, times)),
            frames=frames,
            **problem.given(*around),
        )
        idle = np.flatnonzero(~target.active[1:-1, c]) + 1
        if len(idle):
            three = [rows["angles"].take(idle + offset) for offset in (-1, 0, 1)]
            step = own("idle_step", (len(idle), 1))
            problem.bind(travel(n), **constant(len(idle)), angles=three, frames=frames, idle_step=step)

    def _bind_pair(self, i: int, j: int, rows: dict[str, Rows], others: dict[str, Rows]) -> None:
        times = self.target.collision_times(BETWEEN)
        weights = linear(self.target.times, times)
        both = rows, others
        shapes = {name: [r[name].constant(len(times)) for r in both] for name in MORPHOLOGY}
        self.problem.bind(
            keep_apart(self.joints[i], self.joints[j], bool(self._servos)),
            **shapes,
            angles=[r["angles"].combine(weights) for r in both],
            frames=[self.problem[f"frames{self.contacts[k]}"] for k in (i, j)],
            **self.problem.given(*_RADII, "margin", *self._servos),
        )

    @property
    def _servos(self) -> tuple[str, ...]:
        """The parameter that fingers with servos in their joints have more."""
        return ("servo_radius",) if self.target.model.servo else ()

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
            values[f"bends{contact}"] = seed.bends.reshape(1, -1)
            values[f"angles{contact}"] = seed.angles
            values[f"tips{contact}"] = seed.tips
        return values

    def _parameters(self, seeds: tuple[FingerSeed, ...]) -> dict[str, Array | float]:
        target = self.target
        bodies, up, ground = self._scene
        values: dict[str, Array | float] = {
            "link_radius": target.model.link_radius,
            "tip_radius": target.model.tip_radius,
            "palm_radius": target.palm_radius,
            "shortest": target.link_length[0],
            "shortest_last": target.model.shortest_last,
            "longest": target.link_length[1],
            "lowest": target.joint_limits[0],
            "highest": target.joint_limits[1],
            "margin": MARGIN,
            "bodies": bodies,
            "up": up,
            "ground": ground[:, None],
        }
        if target.model.servo:
            values["servo_radius"] = target.model.servo
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
        counts = {"once": 1, "sample": len(self.target.collision_times(BETWEEN)), "keyframe": len(self.target.times)}
        values = {}
        for name, term in self.problem.declared_terms.items():
            weight = weights[name]
            weight = float(weight[step] if isinstance(weight, tuple | list) else weight)  # type: ignore[arg-type]
            values[f"weight.{name}"] = weight / counts[term.weights["synthesis"].per]
        return values

    def _finger(self, solution: Solution, index: int, seed: FingerSeed) -> FingerSeed:
        contact, values = self.contacts[index], solution.values
        return FingerSeed(
            base=values[f"base{contact}"][0],
            lengths=values[f"lengths{contact}"][0],
            frames=seed.frames,
            axes=values[f"axes{contact}"].reshape(-1, 2),
            bends=values[f"bends{contact}"].reshape(-1, 2),
            angles=values[f"angles{contact}"],
            tips=values[f"tips{contact}"],
        )
