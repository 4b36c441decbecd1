"""Ways to an exact motion: on few knots before many, and where fingers must roll far, a part of the way before all.

An exact motion on few knots is near the one on twice as many, and costs half as much or less: it is looked for on
sparse knots and made exact on ever denser ones. Where contacts cannot go with the object, its whole motion is too far
from anything a hand can do for a solver to find its way; a shorter one is not, and exact motions over more and more of
the way lead from there to the goals.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from casadi_hands.motion import held
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.resampling import at_rest, extrapolated, on_palm, resampled, resampled_model
from casadi_hands.stages.refine.result import Refined, Run
from casadi_hands.stages.refine.settings import FIRM_SOLVE, LAST, LONG_WAY, RENEWED, SHORT_WAY, Step
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.stages.refine.values import Margin

SPARSE, COARSE = 0.4, 0.2  # s between knots, at most
SERVES = 0.1  # cost of slip and of forces that no joint supplies, of a start that is nearly exact
SHORTEST = 0.05  # of the way, by which a motion is lengthened at least
LEAST = 0.1  # of the way, over which a first exact motion is looked for


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
        active = self.active[held(self.model.schedule.samples, model.schedule.samples)]
        return RefineStage(model, self.contacts, self.joints, active)

    def solve(self, start: WholeHand, margin: Margin, near: bool = False) -> Refined:
        """Refine a motion.

        Args:
            start: the motion.
            margin: to keep to the limits.
            near: whether the motion is nearly exact already, and the hand shall stay nearly what it is: then shorter
                ways are tried first.
        """
        ways: list[tuple[Step, ...]] = [LONG_WAY]
        if near:
            ways.insert(0, SHORT_WAY)
            costs = self.fine.costs(SHORT_WAY[0], start, margin)
            if costs.get("slip", 0.0) + costs.get("passive_force", 0.0) < SERVES:
                ways.insert(0, LAST)
        return _until_met(
            partial(self.fine.take, way, start, margin) if way == LAST else partial(self._on_few, way, start, margin)
            for way in ways
        )

    def renew(self, start: WholeHand, margin: Margin) -> Refined:
        """Refine a motion that was exact at other samples.

        Args:
            start: the motion, at the task's samples.
            margin: to keep to the limits.
        """
        return _until_met(partial(self.fine.take, way, start, margin) for way in (RENEWED, LAST))

    def regrip(self, exact: Refined, margin: Margin) -> Refined:
        """Refine a motion that is exact with another margin.

        Args:
            exact: the motion, at the task's samples.
            margin: to keep to the limits.
        """
        return self._on_few(SHORT_WAY, self._gripped(exact, margin), margin)

    def lengthen(self, start: WholeHand, share: float, margin: Margin, firmer: Margin | None = None) -> Refined:
        """Refine a motion over a share of the way to its goals, and lengthen it until it reaches them.

        Args:
            start: the motion over this share of the way.
            share: of the way.
            margin: to keep to the limits.
            firmer: a larger one, kept where an exact motion with it is found near the one without.

        Returns:
            The motion over the whole way, or the longest exact one that was found.
        """
        stage, found = self._found(partial(self._lengthened, start, share, margin))
        if firmer is not None and found.exact:
            tight = self._named(stage, stage.take(SHORT_WAY, self._gripped(found, firmer), firmer))
            tight = _after("firmer grip,", self._denser(stage, tight, start, firmer))
            found = replace(found, runs=found.runs + tight.runs)
            if tight.exact:
                return replace(tight, runs=found.runs)
        return self._denser(stage, found, start, margin)

    def passes_through(self, refined: Refined) -> bool:
        """Whether fingers of a motion at the task's samples pass through each other between these."""
        return self.fine.passes_through(refined)

    def _gripped(self, exact: Refined, margin: Margin) -> WholeHand:
        """A motion with its fingers' forces as much larger as another margin asks for: a start that presses enough."""
        force = exact.hand.force.copy()
        force[:, list(self.contacts)] *= max(1.0, margin.normal_force / exact.margin.normal_force)
        return replace(exact.hand, force=force)

    def _on_few(self, way: tuple[Step, ...], start: WholeHand, margin: Margin) -> Refined:
        """A motion solved on few knots and made exact at the task's samples, near the same motion all the while."""
        stage, found = self._found(lambda stage: stage.take_clear(way, self._at(stage, start), margin))
        return self._denser(stage, found, start, margin, wanted=start)

    def _found(self, find: Callable[[RefineStage], Refined]) -> tuple[RefineStage, Refined]:
        """A motion found on sparse knots, or on coarse ones where that fails, and the stage with these knots.

        Few knots may be too few for a quick motion, but where one on them obeys physics and still slips far, one on
        more knots does, too. A hand that leaves the object one way to go at most is not worth a second try.
        """
        stage, found = self.sparse, self._named(self.sparse, find(self.sparse))
        surely_slips = found.slips_hopelessly and found.worst.violation <= FIRM_SOLVE.constr_viol_tol
        if found.exact or surely_slips or self.coarse is self.sparse or self._mobility < 2:
            return stage, found
        again = self._named(self.coarse, find(self.coarse))
        runs = found.runs + again.runs
        if again.misses_less_than(found):
            stage, found = self.coarse, again
        return stage, replace(found, runs=runs)

    @property
    def _mobility(self) -> int:
        """How many ways object and joints can go at once while all fingers that touch roll, where fewest (Grübler)."""
        touching = self.active[:, list(self.contacts)]
        return int(6 + (touching @ (np.array(self.joints, int) - 3)).min())

    def _lengthened(self, start: WholeHand, share: float, margin: Margin, stage: RefineStage) -> Refined:
        """The longest motion found on the knots of a stage."""
        model, begun = stage.model, self._at(stage, start)
        still = at_rest(model, begun)
        refined = _after(f"{share:.0%} of the way,", stage.take(LONG_WAY, begun, margin, share))
        runs = refined.runs
        while not refined.met and share / 2 >= LEAST:
            share, begun = share / 2, extrapolated(model, still, begun, -0.5)
            refined = _after(f"{share:.0%} of the way,", stage.take(LONG_WAY, begun, margin, share))
            runs += refined.runs
        longest, before, step = refined, at_rest(model, refined.hand), max((1 - share) / 3, SHORTEST)
        before_share, barely_rolls = 0.0, refined.barely_rolls
        while longest.met and longest.share < 1 and step >= SHORTEST:
            share = longest.share + step
            share = 1.0 if share > 1 - SHORTEST / 2 else share
            by = (share - longest.share) / (longest.share - before_share)
            farther = extrapolated(model, before, longest.hand, by)
            refined = _after(f"{share:.0%} of the way,", stage.take(SHORT_WAY, farther, margin, share))
            runs += refined.runs
            if refined.met:
                before, before_share, longest = longest.hand, longest.share, refined
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
            found, runs = take(RENEWED, hand, margin, before.share, near), before.runs
            if not found.met:
                again = denser.take(SHORT_WAY, hand, margin, before.share, near)
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


def _until_met(ways: Iterable[Callable[[], Refined]]) -> Refined:
    """What the first way gives that leads to an exact motion, or the last one, with the solves of all."""
    runs: tuple[Run, ...] = ()
    for way in ways:
        refined = way()
        runs += refined.runs
        if refined.met:
            break
    return replace(refined, runs=runs)


def _after(words: str, refined: Refined) -> Refined:
    """The same with words before the name of each solve."""
    return replace(refined, runs=tuple(run._replace(what=f"{words} {run.what}") for run in refined.runs))
