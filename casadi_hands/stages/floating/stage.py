"""Stage 1: the object's motion with disembodied contacts (section 2.2.1), and its defuzzification."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from casadi_hands.motion import linear
from casadi_hands.nlp import Options, Problem, Solution, Solver
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.model import Model, sizes
from casadi_hands.problem.regrasp import Regrasp
from casadi_hands.stages.floating.gait import ROLLED, farthest_turn, gait
from casadi_hands.stages.floating.gate import least_squares_forces, passes_gate
from casadi_hands.stages.floating.regrasp import limited_travel, planned_regrasp
from casadi_hands.stages.object_motion.binding import bind_object, declare_object
from casadi_hands.stages.object_motion.values import (
    least_contacts,
    object_parameters,
    point_bounds,
    straight_path,
    term_weights,
)
from casadi_hands.stages.own_terms import bind_own, contact_names, own_missed

Array = NDArray[np.float64]
THRESHOLDS = (0.1, 0.2, 0.3)
OPTIONS = Options(max_iter=300, tol=1e-4, acceptable_tol=1e-3)
# An adaptive barrier is quickest, but without a bound it was seen to grow until nothing converged; a small one that
# only shrinks is for where it still does not.
BARRIERS: tuple[Options, ...] = (
    replace(OPTIONS, extra=(("mu_strategy", "adaptive"), ("mu_max", 0.1))),
    replace(OPTIONS, mu_init=1e-2),
)
# Where contacts travel less: an adaptive barrier grew and shrank there until its cap in three of eight tasks.
LIMITED_TRAVEL: tuple[Options, ...] = (replace(OPTIONS, mu_init=1e-3), *BARRIERS)


class Kind(NamedTuple):
    """A way to plan contacts that move on the object, and the barriers that such plans are solved with."""

    name: str
    planner: Callable[[Model, Array], Regrasp | None]
    barriers: tuple[Options, ...]


REGRASP = Kind("regrasp", planned_regrasp, BARRIERS)
LIMITED = Kind("limited contact travel", limited_travel, LIMITED_TRAVEL)
# More happens in a gait than in other motions.
WALKING = Kind("gait", gait, tuple(replace(options, max_iter=1000) for options in LIMITED_TRAVEL))
BROKEN = 1e-3  # violation of friction's cones: forces of zero meet them, so what leaves more has broken down


def solve_floating(model: Model, weights: Mapping[str, float]) -> Floating:
    """Stage 1; contacts that would travel too far around the object are regrasped if others can hold it meanwhile.

    Where they cannot at once, they do so one after the other, or contacts have their travel limited, which fingers at
    least can follow; first what is likelier to succeed with how far the object turns.
    """
    floating = FloatingStage(model).solve(weights)
    if model.regrasp is not None:  # as the task says
        return floating
    first = planned_regrasp(model, floating.pose, floating.active)
    if first is None:
        return floating
    others = (LIMITED, WALKING) if farthest_turn(model, floating.pose) <= ROLLED else (WALKING, LIMITED)
    for kind in (REGRASP, *others):
        plan = first if kind is REGRASP else kind.planner(model, floating.pose)
        if plan is None:
            continue
        replanned = FloatingStage(replace(model, regrasp=plan)).solve_planned(floating, weights, kind)
        if replanned is not None:
            return replanned
    return floating


class FloatingStage:
    """The stage's problem, built once for a task's structure."""

    def __init__(self, model: Model) -> None:
        """Build the problem of a model's structure."""
        self.model = model
        problem = Problem()
        side = declare_object(problem, model)
        bind_object(problem, model, side)
        rows = {"pose": side.pose[1], "point": side.point[1], "force": side.force, "invariant": side.invariant}
        bind_own(problem, model, "floating", contact_names(model), {}, **rows)
        self.solver = Solver(problem)

    def start(self) -> dict[str, Array]:
        """Goals interpolated, contacts fixed in the object, forces of a least-squares grasp."""
        model, schedule = self.model, self.model.schedule
        keyframes, samples, contacts = sizes(model)
        pose = straight_path(model)
        turned = (linear(schedule.keyframes, schedule.samples) @ pose)[:, 3:]
        reference = pin.Quaternion(*model.reference).matrix()
        force = np.array([least_squares_forces(model, pin.exp3(v) @ reference) for v in turned])
        start = {
            "pose": pose,
            "point": model.keyframe_patches.reshape(keyframes, -1),
            "force": force.reshape(samples, -1),
            "invariant": np.full((keyframes, contacts), 0.9),
        }
        for scenario in model.scenarios[1:]:
            start[f"force{scenario.suffix}"] = start["force"]
        return start

    def solve(self, weights: Mapping[str, float]) -> Floating:
        """Solve with free contact invariants, then with each threshold's flags, and keep the best that passes the gate.

        The gate: at every keyframe the active contacts can produce the wrench that the motion needs. Where no
        threshold passes, all contacts stay active.
        """
        parameters = object_parameters(self.model) | term_weights(self.solver.problem, self.model, weights)
        least, most = self._touching()
        start = self.start()
        start["invariant"] = np.clip(start["invariant"], least, most)
        free = self._solved(start, parameters, *self._bounds(least, most))
        runs = [("free", free)]
        best: tuple[float, float, Solution] | None = None
        pivots = self.model.regrasp is not None
        for flags, threshold in self._candidates(free.values["invariant"]):
            solution = self._with_flags(np.clip(flags, least, most), free.values, parameters)
            runs.append((f"threshold {threshold}", solution))
            better = solution.objective < (np.inf if best is None else best[1])
            if better and passes_gate(self.model, solution.values, pivots) and not own_missed(solution):
                best = (threshold, solution.objective, solution)
        if best is None:
            solution = self._with_flags(most, free.values, parameters)
            best = (0.0, solution.objective, solution)
            runs.append(("all active", solution))
        threshold, _, chosen = best
        values, contacts = chosen.values, sizes(self.model)[2]
        return Floating(
            pose=values["pose"],
            point=values["point"].reshape(-1, contacts, 3),
            force=values["force"].reshape(-1, contacts, 3),
            active=values["invariant"] > 0.5,
            invariant=free.values["invariant"],
            threshold=threshold,
            solution=chosen,
            runs=tuple(runs),
            model=self.model,
        )

    def solve_planned(self, before: Floating, weights: Mapping[str, float], kind: Kind) -> Floating | None:
        """Solve again with the model's planned regrasp, from the motion without it; None where it fails the gate."""
        assert self.model.regrasp is not None
        parameters = object_parameters(self.model) | term_weights(self.solver.problem, self.model, weights)
        keyframes = len(before.pose)
        start = {**before.solution.values, "point": self.model.keyframe_patches.reshape(keyframes, -1)}
        flags = (before.active & ~self.model.regrasp.lifted).astype(float)
        if flags.sum(axis=1).min() < least_contacts(self.model):
            return None
        lower, upper = self._bounds(flags, flags)
        solution = self._solved({**start, "invariant": flags}, parameters, lower, upper, kind.barriers)
        if not passes_gate(self.model, solution.values, pivots=True):
            return None
        return self._like(before, flags, solution, (*before.runs, (kind.name, solution)))

    def solve_as(self, other: Floating, weights: Mapping[str, float]) -> Floating:
        """Solve for another task's motion of the same object, with the contacts active that are in a given one."""
        parameters = object_parameters(self.model) | term_weights(self.solver.problem, self.model, weights)
        flags = other.active.astype(float)
        solution = self._with_flags(flags, self.start(), parameters)
        return self._like(other, flags, solution, (("part of the way", solution),))

    def _touching(self) -> tuple[Array, Array]:
        """Least and largest contact invariants (N, C): fingers that regrasp touch all the time else."""
        least = np.zeros((sizes(self.model)[0], sizes(self.model)[2]))
        regrasp = self.model.regrasp
        if regrasp is None:
            return least, least + 1
        return np.where(regrasp.lifted.any(axis=0), ~regrasp.lifted, least), (~regrasp.lifted).astype(float)

    def _bounds(self, least: Array, most: Array) -> tuple[dict[str, Array], dict[str, Array]]:
        """Bounds of the invariants (N, C), and of contacts that are planned to touch elsewhere."""
        lower, upper = point_bounds(self.model)
        return {"invariant": least, "point": lower}, {"invariant": most, "point": upper}

    def _solved(
        self,
        start: Mapping[str, ArrayLike],
        parameters: Mapping[str, Array | float],
        lower: Mapping[str, Array] | None = None,
        upper: Mapping[str, Array] | None = None,
        barriers: tuple[Options, ...] = BARRIERS,
    ) -> Solution:
        """The solution by the first barrier that does not break down, or the one that breaks down least."""
        solutions: list[Solution] = []
        for options in barriers:
            solutions.append(self.solver.solve(start, parameters, options, lower, upper))
            if solutions[-1].violation <= BROKEN:
                break
        return min(solutions, key=lambda solution: solution.violation)

    def _like(
        self, other: Floating, flags: Array, solution: Solution, runs: tuple[tuple[str, Solution], ...]
    ) -> Floating:
        """A solution as a motion whose contact invariants are another's."""
        values, contacts = solution.values, sizes(self.model)[2]
        return replace(
            other,
            pose=values["pose"],
            point=values["point"].reshape(-1, contacts, 3),
            force=values["force"].reshape(-1, contacts, 3),
            active=flags > 0.5,
            solution=solution,
            runs=runs,
            model=self.model,
        )

    def _candidates(self, invariant: Array) -> list[tuple[Array, float]]:
        """Distinct flags (N, C) of the thresholds; a keyframe left with too few contacts keeps its strongest."""
        candidates: list[tuple[Array, float]] = []
        least = least_contacts(self.model)
        for threshold in THRESHOLDS:
            flags = invariant > threshold
            for row, strengths in zip(flags, invariant, strict=True):
                row[np.argsort(-strengths, kind="stable")[:least]] = True
            if not any(np.array_equal(flags, other) for other, _ in candidates):
                candidates.append((flags.astype(float), threshold))
        return candidates

    def _with_flags(
        self, flags: Array, start: Mapping[str, ArrayLike], parameters: Mapping[str, Array | float]
    ) -> Solution:
        return self._solved({**start, "invariant": flags}, parameters, *self._bounds(flags, flags))
