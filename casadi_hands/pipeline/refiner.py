"""One hand refined, judged, replayed, and refined with other margins where that fails."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from casadi_hands.diagnosis.reason import Reason
from casadi_hands.diagnosis.refinement import own_reasons, refined_reason
from casadi_hands.export.design import Design
from casadi_hands.pipeline.halving import BETWEEN, excess, intervals_to_halve
from casadi_hands.pipeline.judge import STRAINED, Judge
from casadi_hands.pipeline.margins import SMALL, margins_for
from casadi_hands.pipeline.rank import AIM, in_between, rank_of
from casadi_hands.pipeline.record import Record
from casadi_hands.pipeline.steps import adopt
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.holds import without_holds
from casadi_hands.problem.model import Model
from casadi_hands.problem.resampling import resampled, resampled_model
from casadi_hands.problem.si import design_change
from casadi_hands.problem.strength import Strength
from casadi_hands.stages.refine.continuation import Continuation
from casadi_hands.stages.refine.result import Refined
from casadi_hands.stages.refine.values import Margin
from casadi_hands.stages.synthesis.algorithm import run_record

Array = NDArray[np.float64]
BORNE = {"bearing_moment", "link_stress", "tip_deflection"}
Tried = tuple[Design, Refined, Continuation]  # judged, what it was made of, and found with
HARDLY = 0.3  # of the joints' stiffness: a grasp that asks for more is lost where joints are a little softer
GAIN = 0.8  # of how far limits are missed, that more samples must reach to be worth still more


class Refiner:
    """Refines a hand and tries it on replays.

    Args:
        record: of the solve; its design is the hand with the motion to be refined.
        model: the task.
        judge: of the designs.
        jobs: processes for the replays.
    """

    def __init__(self, record: Record, model: Model, judge: Judge, jobs: int) -> None:
        self.record, self.model, self.judge, self.jobs = record, model, judge, jobs

    def certify(
        self,
        whole: WholeHand,
        short: tuple[Reason, ...],
        margin: Margin | None = None,
        near: bool = False,
        homotopy: float = 1.0,
        thorough: bool = True,
    ) -> tuple[Design, Refined]:
        """Refine one hand with a margin, and with others where that fails.

        A small one where no motion is exact. Where the audit refuses one that is: within what links and bearings bear,
        if it is for these, then with another lower bound on normal forces, a smaller one where joints are not stiff,
        motors not strong, or links not thick enough. Where replays drop the object or end off its goals, a
        firmer grip or, where the joints are hardly stiff enough or motors hardly strong enough, a softer one.

        Args:
            whole: the hand and its motion.
            short: what its fingers could not do before.
            margin: the first to be tried; by default what suits the hand.
            near: whether the motion is nearly exact already.
            homotopy: the homotopy parameter that its motion goes to: 1 at its goals.
            thorough: whether other margins and ever more samples are tried where the audit or replays refuse it; else
                little time is spent on it, as on a hand that would only take the place of a certified one.

        Returns:
            the design, replayed where its files hold, and its refinement.
        """
        planned, margins = self.record.design, margins_for(self.model, whole)
        halvings = None if thorough else 1
        margin, largest = margin or margins.ample, margins.larger
        refined, stage = self._exact(whole, margin, near, homotopy, largest)
        found = self._between(whole, refined, stage, short, planned, halvings)
        judged, refined, stage = self._borne(whole, found, short, planned, halvings)
        if thorough and refined.exact and judged.status != "certified" and not stage.passes_through(refined):
            # Where joints barely push, fingers may fold over in an instant: other forces take them another way.
            margin, which = (margins.ample, "smaller") if refined.margin == largest else (largest, "larger")
            if judged.missed & {"least_stiffness", "torque", *BORNE}:  # which ask for less, the less fingers press
                margin, which = margins.softer, "smaller"
            text = f"again with a {which} lower bound on normal forces: {judged.reason}"
            other = self._with_margin(whole, refined, stage, margin, text)
            found = self._between(whole, other, stage, short, planned)
            design, other, halved = self._borne(whole, found, short, planned)
            if design.status == "certified":
                judged, refined, stage = design, other, halved
        judged, refined = self._played(whole, (judged, refined, stage), short, planned, AIM)
        firmer, softer = (margins.firmer, "little firmer"), (margins.looser, "little softer")
        (another, which), between, other_way = (largest, "firmer"), firmer, softer
        if judged.least_stiffness > HARDLY * self.record.task.actuator.stiffness or judged.share_of_torque > STRAINED:
            (another, which), between, other_way = (margins.softer, "softer"), softer, firmer
        best, enough = (judged, refined), not judged.drops and judged.replay_angle <= AIM
        enough |= not thorough and judged.status != "certified"
        for _ in range(0 if enough else 2):
            if refined.margin == another:
                break
            text = f"again with a {which} grip: {judged.replay_words}"
            other = self._with_margin(whole, refined, stage, another, text)
            found = self._judged(stage.model, other, short, planned), other, stage
            held, other, strong = self._borne(whole, found, short, planned)
            most = self.record.task.limits.replay_angle
            design, other = self._played(whole, (held, other, strong), short, planned, most)
            best = min(best, (design, other), key=lambda each: rank_of(each[0]))
            if best[0].status == "certified":
                break
            self.record.log("refine", f"not with a {which} grip: {design.reason}")
            worse = bool(judged.missed & design.missed) and (design.drops or 0) > (judged.drops or 0)
            if held.status == "certified" and not worse and not in_between(judged, design):
                break
            another, which = other_way if worse else between
        return best

    def _exact(
        self, whole: WholeHand, margin: Margin, near: bool, homotopy: float, larger: Margin
    ) -> tuple[Refined, Continuation]:
        """The refinement and what it was found with; contacts that may slide do so where none is exact that roll."""

        def found(sliding: float) -> tuple[Refined, Continuation]:
            joints = tuple(finger.joints for finger in whole.fingers)
            model = replace(self.model, sliding=sliding)
            stage = Continuation(model, whole.contacts, joints, whole.active)
            return self._refined(stage, whole, margin, near, homotopy, larger), stage

        rolling = found(0.0)
        if rolling[0].exact or not self.model.sliding:
            return rolling
        self.record.log("refine", "with contacts that slide, as no motion was exact with which all roll")
        sliding = found(self.model.sliding)
        return sliding if sliding[0].misses_less_than(rolling[0]) else rolling

    def _between(
        self,
        whole: WholeHand,
        refined: Refined,
        stage: Continuation,
        short: tuple[Reason, ...],
        planned: Design,
        halvings: int | None = None,
    ) -> Tried:
        """Judge a refinement; where it is exact but between samples, halve intervals while that helps, so often."""
        judged = self._judged(stage.model, refined, short, planned)
        for _ in itertools.count() if halvings is None else range(halvings):
            # Fingers that pass through each other do so on any knots.
            if not refined.exact or not judged.missed & BETWEEN or stage.passes_through(refined):
                break
            schedule = stage.model.schedule
            found = self.judge.audited(judged)
            crowded = intervals_to_halve(found, np.diff(schedule.samples), partial(without_holds, schedule))
            if not crowded.any():
                break
            finer = resampled_model(stage.model, schedule.halved(crowded))
            hand = resampled(refined.hand, stage.model, finer)
            text = f"again with samples in the middle of {crowded.sum()} of {len(crowded)} intervals: {judged.reason}"
            with self.record.stage("refine", text):
                halved = Continuation(finer, stage.contacts, stage.joints, hand.active)
                closer = self._attempt(whole, refined.margin, partial(halved.renew, hand, refined.sharpness))
            design = self._judged(finer, closer, short, planned)
            if excess(design) > GAIN * excess(judged) and len(design.missed) >= len(judged.missed):
                break
            judged, refined, stage = design, closer, halved
        return judged, refined, stage

    def _borne(
        self, whole: WholeHand, found: Tried, short: tuple[Reason, ...], planned: Design, halvings: int | None = None
    ) -> Tried:
        """An exact motion or, where its forces ask too much of links or bearings, one with others if it is better."""
        judged, refined, stage = found
        task, model = self.record.task, stage.model
        least = min(getattr(task.limits, name) for name in BORNE)
        # Other forces lower what joints must bear and hold; bodies that overlap still do.
        others = judged.missed - judged.missed_in_replays - BORNE - {"least_stiffness", "torque"}
        if not refined.exact or not judged.missed & BORNE or others or model.strength or least == 0:
            return found
        held = replace(model, strength=Strength.of(task, model.units))
        strong = Continuation(held, stage.contacts, stage.joints, stage.active)
        text = f"again with what links and bearings bear as a limit: {judged.reason}"
        other = self._with_margin(whole, refined, strong, refined.margin, text)
        if not other.exact:
            return found
        borne = self._between(whole, other, strong, short, planned, halvings)
        return min(found, borne, key=lambda each: rank_of(each[0]))

    def _played(
        self, whole: WholeHand, found: Tried, short: tuple[Reason, ...], planned: Design, most: float
    ) -> tuple[Design, Refined]:
        """A motion replayed or, where it turns off a goal by more than ``most`` degrees, the best of it and others.

        Those resist slower spins in full, and slower ones again where that leaves it beyond the limit. What the hand
        drops asks for another grip.
        """
        judged, refined, stage = found
        judged = self._replayed(judged)
        best, latest = (judged, refined), refined
        if not refined.exact or not self.model.torsion or judged.replay_angle <= most or judged.drops_as_planned:
            return best
        for sharpness in range(refined.sharpness + 1, stage.sharpest + 1):
            if best[0].replay_angle <= most or not latest.exact:
                break
            with self.record.stage("refine", f"again, slow spins resisted in full: {best[0].replay_words}"):
                latest = self._attempt(whole, refined.margin, partial(stage.sharpened, latest, sharpness))
            design = self._replayed(self._judged(stage.model, latest, short, planned))
            best = min(best, (design, latest), key=lambda each: rank_of(each[0]))
            most = max(most, self.record.task.limits.replay_angle)
        return best

    def _with_margin(
        self, whole: WholeHand, refined: Refined, stage: Continuation, margin: Margin, why: str
    ) -> Refined:
        """An exact motion refined with another margin, with slow spins resisted as they were."""
        with self.record.stage("refine", why):
            other = self._attempt(whole, margin, partial(stage.with_margin, refined))
            for sharpness in range(1, refined.sharpness + 1):
                if not other.exact:
                    break
                sharp = self._attempt(whole, margin, partial(stage.sharpened, other, sharpness))
                if not sharp.exact:
                    break
                other = sharp
        return other

    def _refined(
        self,
        stage: Continuation,
        whole: WholeHand,
        margin: Margin,
        near: bool,
        homotopy: float,
        larger: Margin,
    ) -> Refined:
        """The refinement with this margin or, where that is not exact and another may be, with a small one.

        Over long motions errors add up, and large normal forces are needed nearly always: they are asked for at once.
        """
        again: Callable[..., Refined] = partial(stage.solve, whole)
        first = partial(again, near=near)
        if homotopy < 1:
            again = partial(stage.continue_from, whole, homotopy)
            first = partial(again, larger=larger)
        with self.record.stage("refine", "the same motion with exact physics, rolling contacts and clearance"):
            refined = self._attempt(whole, margin, first)
        if refined.exact or refined.barely_rolls or margin == SMALL or self.model.motors:
            return refined
        if stage.model.sliding != self.model.sliding:  # contacts that slide are tried first
            return refined
        with self.record.stage("refine", "again, closer to the limits of friction and normal forces"):
            second = self._attempt(whole, SMALL, again)
        return second if second.misses_less_than(refined) else refined

    def _attempt(self, whole: WholeHand, margin: Margin, refine: Callable[..., Refined]) -> Refined:
        """Refine with one margin, and record all solves, acceptable or not."""
        result = self.record.journal.once("a hand refined", lambda: refine(margin=margin))
        runs = []
        for step, solution, kept in result.runs:
            what = f"hand, {kept.friction:g} of the friction and {kept.normal_force:g} weights of normal force"
            runs.append(run_record("refine", what, self.record.task.search.seed, step, solution))
            if solution is result.hand.solution:
                runs[-1]["design_change"] = design_change(self.model, whole, result.hand)
        self.record.add_runs(runs)
        return result

    def _judged(self, model: Model, refined: Refined, short: tuple[Reason, ...], planned: Design) -> Design:
        """Adopt a refined hand, have it judged, and offer it.

        Args:
            model: the task, with the samples of the refinement.
            refined: the hand.
            short: what its fingers could not do before.
            planned: the design before it was refined.
        """
        self.record.set_costs("refine", refined.hand.solution, refined.weights)
        adopt(self.record, model, refined.hand)
        causes = [*short, *refined_reason(model, refined)]
        self.record.set_unmet("refine", own_reasons(model, refined))
        judged = self.judge.judge(self.record.design, causes, None if refined.exact else planned)
        design = self.record.held_to_bounds(judged)
        self.record.update_best(design)
        return design

    def _replayed(self, design: Design) -> Design:
        """The design, replayed if its files hold, and offered again."""
        if design.status != "certified":
            return design
        with self.record.stage("refine", "replays of the motion that holds"):
            design = self.judge.replayed(design, self.jobs)
        self.record.update_best(design)
        return design
