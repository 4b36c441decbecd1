"""Ways to an exact motion: on few knots before many, and where fingers must roll far, a part of the way before all.

An exact motion on knots 0.2 s apart is near the one on dense knots, and costs half as much or less; what fails there
would fail on dense knots too. Where contacts cannot go with the object, its whole motion is too far from anything a
hand can do for a solver to find its way; a shorter one is not, and exact motions over more and more of the way lead
from there to the goals.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from casadi_hands.motion import held
from casadi_hands.nlp import Solution
from casadi_hands.stages.model import Model
from casadi_hands.stages.refine import LAST, LONG_WAY, RENEWED, SHORT_WAY, Refined, RefineStage, Step
from casadi_hands.stages.refine_values import Margin
from casadi_hands.stages.sampling import at_rest, extrapolated, resampled, resampled_model
from casadi_hands.stages.whole_hand import WholeHand

COARSE = 0.2  # s between coarse knots, at most
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
        """The stage with fewer knots, or the fine one where there would be as many."""
        model = resampled_model(self.model, self.model.schedule.stepped(COARSE))
        samples = self.model.schedule.samples
        if len(model.schedule.samples) == len(samples):
            return self.fine
        return RefineStage(model, self.contacts, self.joints, self.active[held(samples, model.schedule.samples)])

    def solve(self, start: WholeHand, margin: Margin | None = None, near: bool = False) -> Refined:
        """Refine a motion.

        Args:
            start: the motion.
            margin: to keep to the limits.
            near: whether the motion is nearly exact already, and the hand shall stay nearly what it is: then shorter
                ways are tried first.
        """
        margin = margin or Margin()
        ways: list[tuple[Step, ...]] = [LONG_WAY]
        if near:
            ways.insert(0, SHORT_WAY)
            costs = self.fine.costs(SHORT_WAY[0], start, margin)
            if costs.get("slip", 0.0) + costs.get("passive_force", 0.0) < SERVES:
                ways.insert(0, LAST)
        runs: tuple[tuple[str, Solution], ...] = ()
        for way in ways:
            if way == LAST or self.coarse is self.fine:
                refined = self.fine.take(way, start, margin)
            else:
                begun = resampled(start, self.model, self.coarse.model)
                refined = _named("coarse", self.coarse.take(way, begun, margin))
                refined = self._on_fine(refined, start, margin)
            runs += refined.runs
            if refined.exact:
                break
        return replace(refined, runs=runs)

    def renew(self, start: WholeHand, margin: Margin | None = None, firmer: bool = False) -> Refined:
        """Refine a motion that is exact already, but for other samples or another margin.

        Args:
            start: the motion, at the task's samples.
            margin: to keep to the limits.
            firmer: whether the margin is larger than the motion's.
        """
        runs: tuple[tuple[str, Solution], ...] = ()
        for way in (LAST,) if firmer else (RENEWED, LAST):
            refined = self.fine.take(way, start, margin or Margin())
            runs += refined.runs
            if refined.met:
                break
        return replace(refined, runs=runs)

    def lengthen(self, start: WholeHand, share: float, margin: Margin | None = None) -> Refined:
        """Refine a motion over a share of the way to its goals, and lengthen it until it reaches them.

        Args:
            start: the motion over this share of the way.
            share: of the way.
            margin: to keep to the limits.

        Returns:
            The motion over the whole way, or the longest exact one that was found.
        """
        margin = margin or Margin()
        model = self.coarse.model
        begun = resampled(start, self.model, model)
        still = at_rest(model, begun)
        refined = _named(f"{share:.0%} of the way,", self.coarse.take(LONG_WAY, begun, margin, share))
        runs = refined.runs
        while not refined.met and share / 2 >= LEAST:
            share, begun = share / 2, extrapolated(model, still, begun, -0.5)
            refined = _named(f"{share:.0%} of the way,", self.coarse.take(LONG_WAY, begun, margin, share))
            runs += refined.runs
        longest, before, step = refined, at_rest(model, refined.hand), max((1 - share) / 3, SHORTEST)
        before_share = 0.0
        while longest.met and longest.share < 1 and step >= SHORTEST:
            share = longest.share + step
            share = 1.0 if share > 1 - SHORTEST / 2 else share
            by = (share - longest.share) / (longest.share - before_share)
            farther = extrapolated(model, before, longest.hand, by)
            refined = _named(f"{share:.0%} of the way,", self.coarse.take(SHORT_WAY, farther, margin, share))
            runs += refined.runs
            if refined.met:
                before, before_share, longest = longest.hand, longest.share, refined
            else:
                step /= 2
        return self._on_fine(replace(longest, runs=runs), start, margin)

    def _on_fine(self, refined: Refined, start: WholeHand, margin: Margin) -> Refined:
        """A motion on coarse knots at the task's samples, made exact there if it is on the coarse ones."""
        if self.coarse is self.fine:
            return refined
        hand = replace(
            resampled(refined.hand, self.coarse.model, self.model),
            palm_position=start.palm_position,
            palm_quaternion=start.palm_quaternion,
            active=start.active,
        )
        if not refined.met:
            return replace(refined, hand=hand)
        runs = refined.runs
        for way in (RENEWED, SHORT_WAY):
            fine = self.fine.take(way, hand, margin, refined.share)
            runs += fine.runs
            if fine.met:
                break
        slips = fine.slips if fine.slips_hopelessly else refined.slips
        return replace(fine, runs=runs, slips=slips)


def _named(prefix: str, refined: Refined) -> Refined:
    return replace(refined, runs=tuple((f"{prefix} {what}", solution) for what, solution in refined.runs))
