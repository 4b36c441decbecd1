"""Continuation to an exact motion: on few knots before many, and where fingers must roll far, by a homotopy.

An exact motion on few knots is near the one on twice as many, and costs half as much or less: it is looked for on
sparse knots and made exact on ever denser ones. Where contacts cannot go with the object, its whole motion is too far
from anything a hand can do for a solver to get there. A homotopy parameter scales the motion from its first goal, 0, to
all of it, 1: exact motions for larger and larger parameters lead to the goals.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from casadi_hands.motion import zero_order_hold
from casadi_hands.problem.commands import coupled
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.resampling import at_rest, extrapolated, on_palm, resampled, resampled_model
from casadi_hands.problem.structure import mobility
from casadi_hands.stages.refine.result import Refined, Run
from casadi_hands.stages.refine.settings import (
    ALL_STEPS,
    COUPLING_FROM_AFAR,
    COUPLING_STEPS,
    LAST_STEP,
    NEARBY_STEPS,
    RENEWED_STEPS,
    SHARP,
    STIFF_PENALTY,
    Step,
)
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.stages.refine.values import Margin

SPARSE, COARSE = 0.4, 0.2  # s between knots, at most
NEARLY_EXACT = 0.1  # cost of slip and of forces that no joint actuates, of a start that is nearly exact
FAR_OFF_LINES = 1e-3  # of any constraint: a coupled motion that misses more on sparse knots does on more of them, too
LEAST_STEP = 0.05  # of the homotopy parameter
LEAST = 0.1  # homotopy parameter for which a first exact motion is looked for


class Continuation:
    """Refines motions of one structure.

    Args:
        model: the task.
        contacts: index of each finger's contact.
        joints: of each finger.
        active: (S, C) when each contact, the ground's included, touches.
    """

    def __init__(
        self, model: Model, contacts: tuple[int, ...], joints: tuple[int, ...], active: NDArray[np.bool_]
    ) -> None:
        self.model, self.contacts, self.joints, self.active = model, contacts, joints, active

    @cached_property
    def fine(self) -> RefineStage:
        """The stage with the task's own samples as knots."""
        return RefineStage(self.model, self.contacts, self.joints, self.active)

    @cached_property
    def coarse(self) -> RefineStage:
        """The stage with fewer knots."""
        return self._stepped(COARSE, self.fine)

    @cached_property
    def sparse(self) -> RefineStage:
        """The stage with fewest knots."""
        return self._stepped(SPARSE, self.coarse)

    def _stepped(self, step: float, finer: RefineStage) -> RefineStage:
        """The stage with knots at most ``step`` s apart, or a finer one where that has no more of them."""
        model = resampled_model(self.model, self.model.schedule.stepped(step))
        if len(model.schedule.samples) >= len(finer.model.schedule.samples):
            return finer
        active = self.active[zero_order_hold(self.model.schedule.samples, model.schedule.samples)]
        return RefineStage(model, self.contacts, self.joints, active)

    def begin(self, start: WholeHand, margin: Margin, homotopy: float = 1.0) -> Refined:
        """What a refinement from afar tries first: all steps on the sparsest knots."""
        return self.sparse.take(ALL_STEPS, self._at(self.sparse, start), margin, homotopy)

    def solve(self, start: WholeHand, margin: Margin, near: bool = False) -> Refined:
        """Refine a motion.

        Args:
            start: the motion.
            margin: to keep to the limits.
            near: whether the motion is nearly exact already, and the hand shall stay nearly what it is: then shorter
                ways are tried first.
        """
        if self.model.motors:
            return self._on_few(COUPLING_STEPS if near else COUPLING_FROM_AFAR, start, margin)
        sequences: list[tuple[Step, ...]] = [ALL_STEPS]
        if near:
            sequences.insert(0, NEARBY_STEPS)
            costs = self.fine.costs(NEARBY_STEPS[0], start, margin)
            if costs.get("slip", 0.0) + costs.get("passive_force", 0.0) < NEARLY_EXACT:
                sequences.insert(0, LAST_STEP)
        return _until_met(
            partial(self.fine.take, steps, start, margin)
            if steps == LAST_STEP
            else partial(self._on_few, steps, start, margin)
            for steps in sequences
        )

    def renew(self, start: WholeHand, sharpness: int, margin: Margin) -> Refined:
        """Refine a motion that was exact at other samples.

        Args:
            start: the motion, at the task's samples.
            sharpness: how many times it was sharpened.
            margin: to keep to the limits.
        """
        steps = (RENEWED_STEPS, LAST_STEP)
        renewed = _until_met(partial(self.fine.take, each, start, margin, sharpness=sharpness) for each in steps)
        return replace(renewed, sharpness=sharpness)

    @property
    def sharpest(self) -> int:
        """How many times motions can be sharpened."""
        return len(SHARP) - 1 - self.fine.structure.pinched

    def sharpened(self, exact: Refined, sharpness: int, margin: Margin) -> Refined:
        """Refine an exact motion such that contacts which spin slowly have their torsion at its limit, too.

        How far those slip that spin counts then.

        Args:
            exact: the motion, at the task's samples.
            sharpness: how many times it has been sharpened then, at most ``sharpest``.
            margin: to keep to the limits.
        """
        sharp = self.fine.take(LAST_STEP, exact.hand, margin, sharpness=sharpness)
        return replace(sharp, barely_rolls=exact.barely_rolls, sharpness=sharpness)

    def with_margin(self, exact: Refined, margin: Margin) -> Refined:
        """Refine a motion that is exact with another margin.

        Args:
            exact: the motion, at the task's samples.
            margin: to keep to the limits.
        """
        return self._on_few(NEARBY_STEPS, self._pressing(exact, margin), margin)

    def continue_from(self, start: WholeHand, homotopy: float, margin: Margin, larger: Margin | None = None) -> Refined:
        """Refine a motion for a homotopy parameter, and continue from there until it reaches its goals.

        Args:
            start: the motion to this homotopy parameter.
            homotopy: the parameter: 0 where the object stays at its first goal, 1 where it reaches all of them.
            margin: to keep to the limits.
            larger: a larger one, kept where an exact motion with it is found near the one without.

        Returns:
            The whole motion, or the exact one for the largest parameter that was found.
        """
        stage, found = self._found(partial(self._continued, start, homotopy, margin))
        if larger is not None and found.exact:
            tight = self._named(stage, stage.take(NEARBY_STEPS, self._pressing(found, larger), larger))
            tight = _after("larger normal forces,", self._denser(stage, tight, start, larger))
            found = replace(found, runs=found.runs + tight.runs)
            if tight.exact:
                return replace(tight, runs=found.runs)
        return self._denser(stage, found, start, margin)

    def passes_through(self, refined: Refined) -> bool:
        """Whether fingers of a motion at the task's samples pass through each other between these."""
        return self.fine.passes_through(refined)

    def _pressing(self, exact: Refined, margin: Margin) -> WholeHand:
        """A motion with its fingers' forces as another margin asks for: a start that presses enough, and no more."""
        force, contacts = exact.hand.force.copy(), list(self.contacts)
        pressing = np.linalg.norm(force[:, contacts], axis=2)[exact.hand.active[:, contacts]]
        firmer = margin.normal_force / max(float(np.quantile(pressing, 0.1)), exact.margin.normal_force)
        force[:, contacts] *= max(firmer, exact.margin.friction / margin.friction)
        hand = replace(exact.hand, force=force)
        return coupled(self.model, hand, self.model.motors) if self.model.motors else hand

    def _on_few(self, steps: tuple[Step, ...], start: WholeHand, margin: Margin) -> Refined:
        """A motion solved on few knots and made exact at the task's samples, near the same motion all the while."""
        stage, found = self._found(lambda stage: stage.take_clear(steps, self._at(stage, start), margin))
        return self._denser(stage, found, start, margin, wanted=start)

    def _found(self, find: Callable[[RefineStage], Refined]) -> tuple[RefineStage, Refined]:
        """A motion found on sparse knots, or on coarse ones where that fails, and the stage with these knots.

        Few knots may be too few for a quick motion, but where one on them obeys physics and still slips far, one on
        more knots does, too. A hand that leaves the object one way to go at most is not worth a second try.
        """
        stage, found = self.sparse, self._named(self.sparse, find(self.sparse))
        surely_slips = found.slips_hopelessly and found.worst.violation <= STIFF_PENALTY.constr_viol_tol
        off_lines = bool(self.model.motors) and found.worst.violation > FAR_OFF_LINES
        ways = mobility(self.joints, self.active[:, list(self.contacts)])
        if found.exact or surely_slips or off_lines or self.coarse is self.sparse or ways < 2:
            return stage, found
        again = self._named(self.coarse, find(self.coarse))
        runs = found.runs + again.runs
        if again.misses_less_than(found):
            stage, found = self.coarse, again
        return stage, replace(found, runs=runs)

    def _continued(self, start: WholeHand, homotopy: float, margin: Margin, stage: RefineStage) -> Refined:
        """The longest motion found on the knots of a stage."""
        model, begun = stage.model, self._at(stage, start)
        still = at_rest(model, begun)
        refined = _after(f"homotopy {homotopy:.0%},", stage.take(ALL_STEPS, begun, margin, homotopy))
        runs = refined.runs
        while not refined.met and homotopy / 2 >= LEAST:
            homotopy, begun = homotopy / 2, extrapolated(model, still, begun, -0.5)
            refined = _after(f"homotopy {homotopy:.0%},", stage.take(ALL_STEPS, begun, margin, homotopy))
            runs += refined.runs
        longest, before, step = refined, at_rest(model, refined.hand), max((1 - homotopy) / 3, LEAST_STEP)
        before_homotopy, barely_rolls = 0.0, refined.barely_rolls
        while longest.met and longest.homotopy < 1 and step >= LEAST_STEP:
            homotopy = longest.homotopy + step
            homotopy = 1.0 if homotopy > 1 - LEAST_STEP / 2 else homotopy
            by = (homotopy - longest.homotopy) / (longest.homotopy - before_homotopy)
            farther = extrapolated(model, before, longest.hand, by)
            refined = _after(f"homotopy {homotopy:.0%},", stage.take(NEARBY_STEPS, farther, margin, homotopy))
            runs += refined.runs
            if refined.met:
                before, before_homotopy, longest = longest.hand, longest.homotopy, refined
            else:
                step /= 2
        return replace(longest, runs=runs, barely_rolls=barely_rolls)

    def _denser(
        self, stage: RefineStage, found: Refined, start: WholeHand, margin: Margin, wanted: WholeHand | None = None
    ) -> Refined:
        """A motion on a stage's knots at the task's samples, made exact on ever denser knots if it is on these.

        Args:
            stage: with the knots.
            found: the motion.
            start: what it is found from, at the task's samples; the palm goes as it does there.
            margin: to keep to the limits.
            wanted: the motion, at the task's samples, to stay near; by default what is found.
        """
        goal = wanted or resampled(found.hand, stage.model, self.model)
        for denser in (self.coarse, self.fine):
            if len(denser.model.schedule.samples) <= len(stage.model.schedule.samples):
                continue
            begun, near = self._at(denser, start), self._at(denser, goal)
            closer = resampled(found.hand, stage.model, denser.model)
            hand = replace(on_palm(closer, begun.palm_position, begun.palm_quaternion), active=begun.active)
            stage, before = denser, found
            found = replace(before, hand=hand)
            if not before.met:
                continue
            take = denser.take if wanted is None else denser.take_clear
            found, runs = take(RENEWED_STEPS, hand, margin, before.homotopy, near), before.runs
            if not found.met:
                again = denser.take(NEARBY_STEPS, hand, margin, before.homotopy, near)
                better = again if again.misses_less_than(found) else found
                found = replace(better, runs=found.runs + again.runs)
            found = self._named(denser, found)
            found = replace(found, runs=runs + found.runs, barely_rolls=before.barely_rolls)
        return found

    def _at(self, stage: RefineStage, hand: WholeHand) -> WholeHand:
        """A motion with the task's samples on a stage's knots."""
        return hand if stage is self.fine else resampled(hand, self.model, stage.model)

    def _named(self, stage: RefineStage, refined: Refined) -> Refined:
        """The same with its solves named after the stage's knots."""
        if stage is self.fine:
            return refined
        return _after("coarse" if stage is self.coarse else "sparse", refined)


def _until_met(attempts: Iterable[Callable[[], Refined]]) -> Refined:
    """What the first attempt gives that leads to an exact motion, or the last one, with the solves of all."""
    runs: tuple[Run, ...] = ()
    for attempt in attempts:
        refined = attempt()
        runs += refined.runs
        if refined.met:
            break
    return replace(refined, runs=runs)


def _after(words: str, refined: Refined) -> Refined:
    """The same with words before the name of each solve."""
    return replace(refined, runs=tuple(run._replace(what=f"{words} {run.what}") for run in refined.runs))
