"""Ways to an exact motion: on few knots before many, and where fingers must roll far, a part of the way before all.

An exact motion on knots 0.2 s apart is near the one on dense knots, and costs half as much or less; what fails there
would fail on dense knots too. Where contacts cannot go with the object, its whole motion is too far from anything a
hand can do for a solver to find its way; a shorter one is not, and exact motions over more and more of the way lead
from there to the goals, on knots that are half as many again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from casadi_hands.motion import held
from casadi_hands.nlp import Solution
from casadi_hands.stages.model import Model
from casadi_hands.stages.refine import FIRM_SOLVE, LAST, LONG_WAY, RENEWED, SHORT_WAY, Refined, RefineStage, Step
from casadi_hands.stages.refine_values import Margin
from casadi_hands.stages.sampling import at_rest, extrapolated, resampled, resampled_model
from casadi_hands.stages.whole_hand import WholeHand

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
        runs: tuple[tuple[str, Solution], ...] = ()
        for way in ways:
            taken = partial(self._taken, way, start, margin)
            refined = taken(self.fine) if way == LAST else self._on_few(taken, start, margin)
            runs += refined.runs
            if refined.exact:
                break
        return replace(refined, runs=runs)

    def renew(self, start: WholeHand, margin: Margin) -> Refined:
        """Refine a motion that was exact at other samples.

        Args:
            start: the motion, at the task's samples.
            margin: to keep to the limits.
        """
        runs: tuple[tuple[str, Solution], ...] = ()
        for way in (RENEWED, LAST):
            refined = self.fine.take(way, start, margin)
            runs += refined.runs
            if refined.met:
                break
        return replace(refined, runs=runs)

    def tighten(self, start: WholeHand, margin: Margin) -> Refined:
        """Refine a motion that is exact with a smaller margin.

        Args:
            start: the motion.
            margin: to keep to the limits.
        """
        return self._on_few(partial(self._taken, SHORT_WAY, start, margin), start, margin)

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
        return self._on_few(partial(self._lengthened, start, share, margin), start, margin, firmer)

    def _on_few(
        self,
        find: Callable[[RefineStage], Refined],
        start: WholeHand,
        margin: Margin,
        firmer: Margin | None = None,
    ) -> Refined:
        """A motion found on sparse knots, or on coarse ones where that fails, made exact at the task's samples.

        Few knots may be too few for a quick motion, but where one on them obeys physics and still slips far, one on
        more knots does, too.
        """
        best: Refined | None = None
        for stage in (self.sparse,) if self.coarse is self.sparse else (self.sparse, self.coarse):
            found = self._named(stage, find(stage))
            refined = self._made_exact(stage, found, start, margin, firmer)
            if best is not None:
                runs = best.runs + refined.runs
                best = replace(refined if refined.exact or refined.misses_less_than(best) else best, runs=runs)
            else:
                best = refined
            if found.exact or (found.slips_hopelessly and found.worst.violation <= FIRM_SOLVE.constr_viol_tol):
                break
        assert best is not None
        return best

    def _made_exact(
        self, stage: RefineStage, found: Refined, start: WholeHand, margin: Margin, firmer: Margin | None
    ) -> Refined:
        """A motion on a stage's knots at the task's samples, with the firmer margin where it is exact with that."""
        if firmer is not None and found.exact:
            tight = self._named(stage, _after("firmer grip,", stage.take(SHORT_WAY, found.hand, firmer)))
            tight = self._finer(stage, tight, start, firmer)
            found = replace(found, runs=found.runs + tight.runs)
            if tight.exact:
                return replace(tight, runs=found.runs)
        return self._finer(stage, found, start, margin)

    def _taken(self, way: tuple[Step, ...], start: WholeHand, margin: Margin, stage: RefineStage) -> Refined:
        """A motion solved on the knots of a stage."""
        return stage.take(way, self._at(stage, start), margin)

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
        before_share = 0.0
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
        return replace(longest, runs=runs)

    def _finer(self, stage: RefineStage, refined: Refined, start: WholeHand, margin: Margin) -> Refined:
        """A motion on a stage's knots at the task's samples, made exact on ever finer knots if it is on these."""
        for finer in (self.coarse, self.fine):
            if len(finer.model.schedule.samples) <= len(stage.model.schedule.samples):
                continue
            hand, begun = resampled(refined.hand, stage.model, finer.model), self._at(finer, start)
            hand = replace(
                hand, palm_position=begun.palm_position, palm_quaternion=begun.palm_quaternion, active=begun.active
            )
            stage, before, refined = finer, refined, replace(refined, hand=hand)
            if not before.met:
                continue
            for way in (RENEWED, SHORT_WAY):
                closer = self._named(finer, finer.take(way, hand, margin, before.share))
                refined = replace(closer, runs=refined.runs + closer.runs)
                if refined.met:
                    break
            if not refined.slips_hopelessly:
                refined = replace(refined, slips=before.slips)
        return refined

    def _at(self, stage: RefineStage, hand: WholeHand) -> WholeHand:
        """A motion with the task's samples on a stage's knots."""
        return hand if stage is self.fine else resampled(hand, self.model, stage.model)

    def _named(self, stage: RefineStage, refined: Refined) -> Refined:
        """The same with its solves named after the stage's knots."""
        if stage is self.fine:
            return refined
        return _after("coarse" if stage is self.coarse else "sparse", refined)


def _after(words: str, refined: Refined) -> Refined:
    """The same with words before the name of each solve."""
    return replace(refined, runs=tuple((f"{words} {what}", solution) for what, solution in refined.runs))
