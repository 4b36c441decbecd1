"""Stage 4, beyond the thesis: the same motion as a hard-constrained problem at dense knots, the morphology free.

Newton–Euler from knot to knot, contact on both surfaces with opposed normals, rolling without slip, friction cones with
a margin, a floor on normal forces, forces that joints supply with a lever, clearance: all constraints. Reached by
continuation: rolling and supply first as soft costs, then as firm ones, then as constraints. (Straight from soft to
hard, the solver was seen to turn fingers to the object's other side.)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from casadi_hands.nlp import Options, Solution, Solver
from casadi_hands.stages.model import Model
from casadi_hands.stages.passing import pass_through
from casadi_hands.stages.refine_problem import RefineProblem
from casadi_hands.stages.refine_values import Margin, RefineValues
from casadi_hands.stages.sampling import shortened
from casadi_hands.stages.structure import Structure
from casadi_hands.stages.whole_hand import WholeHand

_NEAR = (("nlp_scaling_method", "none"), ("bound_push", 1e-6), ("bound_frac", 1e-6))
_MOST = 1e7  # of a multiplier; a regular one was seen to reach a tenth of that
# Barriers are monotone: an adaptive one was seen to leap away from good starts. Small ones stay near them, where a
# large one first wanders to the middle of all bounds and back; too small ones crawl along every bound they meet.
SOFT = Options(150, tol=1e-3, acceptable_tol=1e-2, mu_init=1e-3, most_multiplier=_MOST, extra=_NEAR)
FIRM_SOLVE = replace(SOFT, constr_viol_tol=1e-6, mu_init=1e-4)
_MET = 1e-8  # largest violation with which a solve may end before it is optimal, where it must be exact
HARD = replace(
    FIRM_SOLVE,
    max_iter=300,
    tol=1e-4,
    acceptable_tol=1e-3,
    constr_viol_tol=1e-10,
    extra=(*_NEAR, ("acceptable_constr_viol_tol", _MET)),
)
# From an exact motion of the same margins: a larger barrier would first push it off every bound that it rests on.
NEARBY = replace(HARD, max_iter=40, mu_init=1e-5)
# Where the best of all motions takes long to find, one that is good and nearly exact has an exact one very near it.
_LOOSE = (("dual_inf_tol", 1e3), ("compl_inf_tol", 1e-3))
GOOD = replace(NEARBY, max_iter=60, tol=0.3, acceptable_tol=0.3, constr_viol_tol=1e-4, extra=(*_NEAR, *_LOOSE))
PROJECTION = replace(NEARBY, max_iter=60)
ACCEPTED = 1e-7  # largest violation with which a refined motion is handed on
HOPELESS = 0.1  # half extents of slip: where firm solves leave more, rolling is out of the structure's reach
FALLING = 0.5  # of the soft solve's slip: where the firm one leaves more than hopeless, but less than this, it goes on
WEIGHTS = {
    "slip": 3.0,
    "passive_force": 3.0,
    "spin": 0.1,
    "stay_point": 1.0,
    "stay_force": 0.02,
    "friction_margin": 0.02,
    "force_change": 0.5,
    "joint_acceleration": 1e-3,
    "joint_jerk": 3e-3,
    "object_acceleration": 1e-2,
    "object_jerk": 1e-3,
    "stay_design": 5.0,  # or fingers grow long and turn elsewhere for next to nothing
    "stay_path": 1.0,
    "goal": 300.0,
    "force_regularisation": 1e-3,
    "anchor": 0.0,  # but in projections
}
FIRM = {"slip": 100.0, "passive_force": 30.0}
FIRMER = FIRM | {"slip": 1000.0}
EXACT = {"slip": 100.0}  # its tolerance is there for where it is needed
Step = tuple[str, dict[str, float], Options]
LONG_WAY: tuple[Step, ...] = (
    ("soft", WEIGHTS, SOFT),
    ("firm", WEIGHTS | FIRM, FIRM_SOLVE),
    ("firmer", WEIGHTS | FIRMER, FIRM_SOLVE),
    ("exact", WEIGHTS | EXACT, HARD),
)
# From an exact motion to one nearby; the first step can be left out where joints can follow and supply their forces.
SHORT_WAY: tuple[Step, ...] = (LONG_WAY[1], LONG_WAY[-1])
LAST: tuple[Step, ...] = SHORT_WAY[-1:]
RENEWED: tuple[Step, ...] = (("exact", WEIGHTS | EXACT, NEARBY),)


@dataclass(frozen=True)
class Worst:
    """The constraint that a solve violates most.

    Attributes:
        constraint: ``kernel.constraint``.
        violation: in the constraint's own unit.
        time: s, of the knot where it is; None where the constraint has no time.
    """

    constraint: str
    violation: float
    time: float | None


class Run(NamedTuple):
    """A solve: its step, what came out, and the margin to the limits that it kept."""

    what: str
    solution: Solution
    margin: Margin


@dataclass(frozen=True)
class Refined:
    """A motion that was refined.

    Attributes:
        hand: as the whole-hand stage's, with the design as it is now.
        met: whether every constraint is met within ``ACCEPTED``.
        worst: of the motion's constraints.
        slips: for each contact, half extents, what the last solve left that did not forbid slip, or else the last.
        slips_hopelessly: whether the firm solves were left with so much slip that no exact one was tried.
        barely_rolls: whether rolling is out of the structure's reach, or so nearly that a firmer solve had to look
            for it.
        runs: every solve.
        weights: of the terms of the motion's solve.
        margin: to keep to the limits, that the motion was solved with.
        share: of the way to its goals that the motion goes.
    """

    hand: WholeHand
    met: bool
    worst: Worst
    slips: dict[str, float]
    slips_hopelessly: bool
    barely_rolls: bool
    runs: tuple[Run, ...]
    weights: dict[str, float]
    margin: Margin
    share: float = 1.0

    @property
    def exact(self) -> bool:
        """Whether the motion meets its constraints and goes all the way to its goals."""
        return self.met and self.share == 1

    def misses_less_than(self, other: Refined) -> bool:
        """Whether the motion is exact where the other is not, goes farther, rolls where it slips, or violates less."""

        def missed(refined: Refined) -> tuple[bool, float, bool, float]:
            return not refined.met, -refined.share, refined.slips_hopelessly, refined.worst.violation

        return missed(self) < missed(other)


class RefineStage:
    """The stage for one structure: joints of each finger and when each contact, the ground's included, touches."""

    def __init__(
        self,
        model: Model,
        contacts: tuple[int, ...],
        joints: tuple[int, ...],
        active: NDArray[np.bool_],
        guarded: bool = False,
    ) -> None:
        """Build the problem.

        Args:
            model: the task.
            contacts: index of each finger's contact.
            joints: of each finger.
            active: (S, C) when each contact, the ground's included, touches.
            guarded: whether fingers are kept clear of each other between knots, too, which takes twice as long.
        """
        self.model, self.contacts = model, contacts
        self._given = model, contacts, joints, active
        self.structure = Structure.of(model, contacts, joints, active)
        self.built = RefineProblem(self.structure, guarded)
        self.problem, self.given = self.built.problem, RefineValues(self.built, model)
        self.solver = Solver(self.problem)

    def take_clear(
        self,
        way: tuple[Step, ...],
        start: WholeHand,
        margin: Margin,
        share: float = 1.0,
        wanted: WholeHand | None = None,
    ) -> Refined:
        """``take``, and where fingers pass through each other between knots again, with them kept clear there, too."""
        refined = self.take(way, start, margin, share, wanted)
        if not refined.met or not self.passes_through(refined):
            return refined
        guarded = self._guarded.take(way, start, margin, share, wanted)
        return replace(guarded, runs=refined.runs + guarded.runs)

    def passes_through(self, refined: Refined) -> bool:
        """Whether fingers of a motion on the stage's knots pass through each other between them."""
        return pass_through(self.structure, refined.hand)

    @cached_property
    def _guarded(self) -> RefineStage:
        return RefineStage(*self._given, guarded=True)

    def take(
        self,
        way: tuple[Step, ...],
        start: WholeHand,
        margin: Margin,
        share: float = 1.0,
        wanted: WholeHand | None = None,
    ) -> Refined:
        """Solve step by step; not to the end where firm solves show rolling to be out of reach.

        Args:
            way: solves, each from where the one before ended.
            start: the motion to begin with.
            margin: to keep to the limits.
            share: of the way from the first goal to each of the others.
            wanted: the motion, of the same hand, that costs hold near to; by default that to begin with.
        """
        given = self.given if share == 1 else RefineValues(self.built, shortened(self.model, share))
        values, parameters = given.start(start), given.parameters(start, margin, wanted)
        lower, upper = given.bounds()
        always, exact = given.constraint_bounds(margin)
        branches, regular = given.regular(start)
        parameters, always = parameters | branches, always | regular
        runs: list[Run] = []
        slips: dict[str, float] = {}
        most = 0.0
        for what, weights, options in way:
            most, before = max(slips.values(), default=0.0), most
            if what == "firmer" and not HOPELESS < most < FALLING * before:
                continue
            if what == "exact" and not most <= HOPELESS:  # nor where a solve broke down
                break
            bounds = always | exact if what == "exact" else always
            parameters |= self._weighted(weights)
            solution = self.solver.solve(values, parameters, options, lower, upper, bounds)
            if what == "exact" and not solution.violation <= _MET:
                solution = self._projected(solution, parameters, lower, upper, bounds)
            runs.append(Run(what, solution, margin))
            values, used = solution.values, weights
            if what != "exact":
                slips = self._slips(solution)
        return replace(self._result(start, runs, slips or self._slips(solution), used), share=share)

    def _projected(
        self,
        solution: Solution,
        parameters: Mapping[str, ArrayLike],
        lower: Mapping[str, ArrayLike],
        upper: Mapping[str, ArrayLike],
        bounds: Mapping[str, tuple[ArrayLike, ArrayLike]],
    ) -> Solution:
        """A motion that meets all constraints, nearest to a good one near a solution; the solution if none is found."""
        if not np.isfinite(solution.violation):
            return solution
        good = self.solver.solve(solution.values, parameters, GOOD, lower, upper, bounds)
        near = (good if np.isfinite(good.violation) else solution).values
        anchored = {**parameters, **self.built.anchors.at(near)}
        nearest = self.solver.solve(near, anchored, PROJECTION, lower, upper, bounds)
        solves = (solution, good, nearest)
        iterations, seconds = sum(s.iterations for s in solves), sum(s.seconds for s in solves)
        if not nearest.violation < solution.violation:
            return replace(solution, iterations=iterations, seconds=seconds)
        terms = self.solver.evaluate(nearest.values, parameters)
        objective = sum(terms.values())
        return replace(nearest, terms=terms, objective=objective, iterations=iterations, seconds=seconds)

    def costs(self, step: Step, start: WholeHand, margin: Margin) -> dict[str, float]:
        """The weighted terms of a motion, as a step weights them."""
        parameters = self.given.parameters(start, margin) | self._weighted(step[1])
        return self.solver.evaluate(self.given.start(start), parameters)

    def _weighted(self, weights: Mapping[str, float]) -> dict[str, ArrayLike]:
        return {f"weight.{term}": weights[term] / self.given.knots for term in self.problem.terms}

    def _slips(self, solution: Solution) -> dict[str, float]:
        """Path length of each finger contact's slip."""
        names = {self.model.contact_names[c]: f"rolling{c}.no_slip" for c in self.contacts}
        return {who: float(np.linalg.norm(solution.constraints[name], axis=1).sum()) for who, name in names.items()}

    def _result(self, start: WholeHand, runs: list[Run], slips: dict[str, float], weights: dict[str, float]) -> Refined:
        what, solution, margin = runs[-1]
        values, count = solution.values, len(self.model.schedule.samples)
        point, force, active = start.point.copy(), np.zeros_like(start.force), np.zeros_like(start.active)
        columns = self.structure.columns
        active[:, columns] = self.structure.active
        point[:, columns] = values["point"].reshape(count, -1, 3)
        force[:, columns] = values["force"].reshape(count, -1, 3)
        disturbed = None
        if len(pushed := self.built.pushed):
            disturbed = force.copy()
            disturbed[pushed[:, None], columns] = values["force_pushed"].reshape(len(pushed), -1, 3)
        fingers = tuple(
            replace(
                old,
                base=values[f"base{c}"][0],
                lengths=values[f"lengths{c}"][0],
                axes=values[f"axes{c}"].reshape(-1, 2),
                angles=values[f"angles{c}"][self.model.schedule.keyframe_samples],
            )
            for c, old in zip(self.contacts, start.fingers, strict=True)
        )
        hand = replace(
            start,
            fingers=fingers,
            angles=tuple(values[f"angles{c}"] for c in self.contacts),
            position=values["pose"][:, :3],
            vector=values["pose"][:, 3:],
            point=point,
            force=force,
            active=active,
            solution=solution,
            disturbed=disturbed,
        )
        worst = self._worst(solution)
        hopeless = what != "exact"
        met = not hopeless and worst.violation <= ACCEPTED
        barely = hopeless or any(run.what == "firmer" for run in runs)
        return Refined(hand, met, worst, slips, hopeless, barely, tuple(runs), weights, margin)

    def _worst(self, solution: Solution) -> Worst:
        name, violation = max(solution.violations.items(), key=lambda item: item[1])
        knots = self.built.knots_of.get(name.split(".")[0])
        if knots is None or violation == 0:
            return Worst(name, violation, None)
        excess = solution.excess[name]
        instance = int(excess.reshape(len(knots), -1).max(axis=1).argmax())
        return Worst(name, violation, float(self.model.schedule.samples[knots[instance]]))
