"""Stage 4, beyond the thesis: the same motion as a hard-constrained problem at dense knots, the morphology free.

Newton–Euler from knot to knot, contact on both surfaces with opposed normals, rolling without slip, friction cones with
a margin, lower bounds on normal forces, forces that joints actuate, clearance: all constraints. Reached by
continuation: rolling and actuation first as penalties, then as stiffer ones, then as constraints. (Straight from soft
to hard, the solver was seen to turn fingers to the object's other side.)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from casadi_hands.nlp import Solution, Solver
from casadi_hands.problem.coupling import Coupling
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.resampling import shortened
from casadi_hands.problem.structure import Structure
from casadi_hands.stages.own_terms import own_weights
from casadi_hands.stages.refine import attached, coupling
from casadi_hands.stages.refine.declaration import Bounds
from casadi_hands.stages.refine.inter_knot import pass_through
from casadi_hands.stages.refine.problem import RefineProblem
from casadi_hands.stages.refine.result import Refined, Run, Worst
from casadi_hands.stages.refine.settings import (
    ACCEPTED,
    FALLING,
    GOOD,
    HOPELESS,
    MET,
    RESTORATION,
    SPIN_SCALE,
    SPIN_WEIGHT,
    Step,
    closing,
    graded,
)
from casadi_hands.stages.refine.sliding import SLIP_SCALE
from casadi_hands.stages.refine.tightest import tightest
from casadi_hands.stages.refine.values import Margin, RefineValues
from casadi_hands.terms import contact as contact_terms


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
        steps: tuple[Step, ...],
        start: WholeHand,
        margin: Margin,
        homotopy: float = 1.0,
        wanted: WholeHand | None = None,
    ) -> Refined:
        """``take``, and where fingers pass through each other between knots again, with them kept clear there, too."""
        refined = self.take(steps, start, margin, homotopy, wanted)
        if not refined.met or not pass_through(self.structure, refined.hand, self.structure.inner):
            return refined
        guarded = self._guarded.take(steps, start, margin, homotopy, wanted)
        return replace(guarded, runs=refined.runs + guarded.runs)

    def passes_through(self, refined: Refined) -> bool:
        """Whether fingers of a motion on the stage's knots pass through each other between them."""
        return pass_through(self.structure, refined.hand, self.structure.close_times)

    @cached_property
    def _guarded(self) -> RefineStage:
        return RefineStage(*self._given, guarded=True)

    def take(
        self,
        steps: tuple[Step, ...],
        start: WholeHand,
        margin: Margin,
        homotopy: float = 1.0,
        wanted: WholeHand | None = None,
        sharpness: int = 0,
    ) -> Refined:
        """Solve step by step; not to the end where stiff penalties show rolling to be out of reach.

        Args:
            steps: solves, each from where the one before ended.
            start: the motion to begin with.
            margin: to keep to the limits.
            homotopy: the parameter: 0 where the object stays at its first goal, 1 where it reaches all of them.
            wanted: the motion, of the same hand, that costs hold near to; by default that to begin with.
            sharpness: how many times the spin was lowered beyond which contacts have their torsion at its limit.
        """
        given = self.given if homotopy == 1 else RefineValues(self.built, shortened(self.model, homotopy))
        values, parameters = given.start(start, sharpness), given.parameters(start, margin, wanted)
        lower, upper = given.bounds()
        always, exact = given.constraint_bounds(margin)
        directions, regular = given.singularity_margins(start)
        parameters, always = parameters | directions, always | regular
        runs: list[Run] = []
        slips: dict[str, float] = {}
        most, hopeless = 0.0, max(HOPELESS, self.model.sliding)
        graded_steps = tuple((step, 1.0) for step in steps)
        if self.model.sliding:
            graded_steps = graded(steps)
        elif start.coupling is not None and len(steps) > 1:
            graded_steps = closing(steps)
        for (what, given_weights, options), scale in graded_steps:
            weights = self._all_weights(what, given_weights, sharpness)
            most, before = max(slips.values(), default=0.0), most
            if what == "stiffer penalty" and not hopeless < most < FALLING * before:
                continue
            if what == "hard constraints" and not most <= hopeless:  # nor where a solve broke down
                break
            if runs and runs[-1].what == what and not runs[-1].solution.violation <= ACCEPTED:
                break
            bounds = always | exact if what == "hard constraints" else always
            if start.coupling is not None:
                off = 1.0 if self.model.sliding else scale
                low, high, lines = self._coupled(what, values, start.coupling, off)
                lower, upper, bounds = lower | low, upper | high, {**bounds, **lines}
            parameters |= self._weighted(weights) | self._slip_scale(scale) | self._spin_scale(what, sharpness)
            solution = self.solver.solve(values, parameters, options, lower, upper, bounds)
            if what == "hard constraints" and not solution.violation <= MET:
                solution = self._restored(solution, parameters, lower, upper, bounds)
            runs.append(Run(what, solution, margin))
            values, used = solution.values, weights
            if what != "hard constraints":
                slips = self._slips(solution)
        return replace(self._result(start, runs, slips or self._slips(solution), used), homotopy=homotopy)

    def _coupled(
        self, what: str, values: dict[str, NDArray[np.float64]], begun: Coupling, scale: float
    ) -> tuple[dict[str, NDArray[np.float64]], dict[str, NDArray[np.float64]], Bounds]:
        """Bounds of motors and ratios in a step, and how far commands may be off their lines."""
        now = coupling.result(self.built, values, begun.leaders)
        low, high = coupling.bounds(self.built, now, self.model.ratios, what == "hard constraints")
        return low, high, coupling.constraint_bounds(self.built, what, scale)

    def _restored(
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
        proximal = {**parameters, **self.built.proximity.at(near)}
        nearest = self.solver.solve(near, proximal, RESTORATION, lower, upper, bounds)
        solves = (solution, good, nearest)
        iterations, seconds = sum(s.iterations for s in solves), sum(s.seconds for s in solves)
        if not nearest.violation < solution.violation:
            return replace(solution, iterations=iterations, seconds=seconds)
        terms = self.solver.evaluate(nearest.values, parameters)
        objective = sum(terms.values())
        return replace(nearest, terms=terms, objective=objective, iterations=iterations, seconds=seconds)

    def costs(self, step: Step, start: WholeHand, margin: Margin) -> dict[str, float]:
        """The weighted terms of a motion, as a step weights them."""
        weights = self._all_weights(step[0], step[1], sharpness=0)
        parameters = self.given.parameters(start, margin) | self._weighted(weights)
        return self.solver.evaluate(self.given.start(start), parameters)

    def _all_weights(self, what: str, weights: Mapping[str, float], sharpness: int) -> dict[str, float]:
        """A step's weights, those of soft fingertips, and those of a person's own terms.

        How far contacts slip that spin counts once a motion is sharpened: from afar it was seen to lead astray.
        """
        soft = {"spin": SPIN_WEIGHT[what]} if self.model.torsion else {}
        early = {} if sharpness else {contact_terms.PIVOT_SLIP.name: 0.0}
        return {**weights, **soft, **early, **own_weights(self.model, "refine")}

    def _weighted(self, weights: Mapping[str, float]) -> dict[str, ArrayLike]:
        return {f"weight.{term}": weights[term] / self.given.knots for term in self.problem.terms}

    def _spin_scale(self, what: str, sharpness: int) -> dict[str, ArrayLike]:
        if not self.model.torsion:
            return {}
        return {"spin_scale": self.given.spin_scale(sharpness) if what == "hard constraints" else SPIN_SCALE[what]}

    def _slip_scale(self, times: float) -> dict[str, ArrayLike]:
        return {"slip_scale": times * SLIP_SCALE / self.model.units.length} if self.model.sliding else {}

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
        disturbed, torsion = None, None
        if self.model.torsion:
            torsion = np.zeros(start.force.shape[:2])
            torsion[:, list(self.contacts)] = values["torsion"]
        if len(knots := self.built.disturbed):
            disturbed = force.copy()
            disturbed[knots[:, None], columns] = values["force_disturbed"].reshape(len(knots), -1, 3)
        fingers = tuple(
            replace(
                old,
                base=values[f"base{c}"][0],
                lengths=values[f"lengths{c}"][0],
                axes=values[f"axes{c}"].reshape(-1, 2),
                bends=values[f"bends{c}"].reshape(-1, 2),
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
            torsion=torsion,
            on_joint=attached.result(self.model, values),
            coupling=start.coupling and coupling.result(self.built, values, start.coupling.leaders),
        )
        worst = self._worst(solution)
        hopeless = what != "hard constraints"
        met = not hopeless and worst.violation <= ACCEPTED
        barely = hopeless or any(run.what == "stiffer penalty" for run in runs)
        tight = None if met else tightest(self.built, solution, worst.constraint)
        return Refined(hand, met, worst, slips, hopeless, barely, tuple(runs), weights, margin, tightest=tight)

    def _worst(self, solution: Solution) -> Worst:
        name, violation = max(solution.violations.items(), key=lambda item: item[1])
        block_name, constraint = name.split(".")
        block = self.built.blocks[block_name]
        about = block.contacts, block.kernel.declared[constraint]
        if block.knots is None or violation == 0:
            return Worst(name, violation, None, *about)
        excess = solution.excess[name]
        instance = int(excess.reshape(len(block.knots), -1).max(axis=1).argmax())
        return Worst(name, violation, float(self.model.schedule.samples[block.knots[instance]]), *about)
