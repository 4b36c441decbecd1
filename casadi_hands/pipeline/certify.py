"""The loop of certification: hands are refined, replayed and given more joints until one is certified."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from casadi_hands.design import Design
from casadi_hands.pipeline.judge import Judge
from casadi_hands.pipeline.record import Record, rank_of
from casadi_hands.pipeline.refine_reason import failing_fingers, refined_reason
from casadi_hands.pipeline.steps import adopt, run_search, run_shortened, run_whole_hand
from casadi_hands.reasons import Reason
from casadi_hands.search.algorithm import Candidate, Found, Search, run_record
from casadi_hands.stages.continuation import Continuation
from casadi_hands.stages.floating import Floating
from casadi_hands.stages.model import Model
from casadi_hands.stages.outcome import design_change
from casadi_hands.stages.palm_motion import goals_seen_from_palm
from casadi_hands.stages.refine import Refined
from casadi_hands.stages.refine_values import Margin
from casadi_hands.stages.sampling import resampled, resampled_model, shortened
from casadi_hands.stages.whole_hand import WholeHand
from casadi_hands.verify import REPLAYS
from casadi_hands.verify.report import Audit

Array = NDArray[np.float64]
AMPLE = Margin()
SMALL = Margin(friction=0.8, normal_force=0.25)
FIRM = Margin(normal_force=4.0)  # an error of a sensor or of friction shifts a smaller share of it
LONG_DROPS = 6  # of the replays: where more drop the object, all hands of a structure are tried
OUT_OF_REACH = 0.3  # half extents that a finger misses its contact by: nothing is left to refine
SURELY = np.pi / 2  # that an object may turn so that contacts can surely go with it
# What an exact motion misses only by how it goes between its samples; then it gets more of them.
BETWEEN = {"residual", "residual_between", "gap_between", "slip", "penetration", "joint_limit"}
FINEST = 0.02  # s between samples
ENOUGH = 0.7  # of a limit: intervals that contribute more are halved
LEFT = 1 / 8  # of what an interval slips, once it is halved; a cubic spline's error falls to a sixteenth
GAIN = 0.8  # of how far limits are missed, that more samples must reach to be worth still more
HANDS_REFINED = 2  # hands of one structure that are tried, and more only where nothing else is left to try


class Certifier:
    """Refines the hands of a search until one is certified, and keeps the best where none is.

    Args:
        record: of the solve.
        model: the task.
        floating: the motion that hands follow.
        search: run on, where fingers need more joints.
        judge: of the designs.
        jobs: processes for the replays.
    """

    def __init__(
        self, record: Record, model: Model, floating: Floating, search: Search, judge: Judge, jobs: int
    ) -> None:
        self.record, self.model, self.floating, self.search = record, model, floating, search
        self.judge, self.refiner = judge, Refiner(record, model, judge, jobs)

    def run(self, found: Found) -> Design:
        """Refine the best hand, the next best, then hands with one more joint where those failed.

        A hand whose files hold and whose replays don't makes way for the next best of its structure that does better.
        All hands of a structure are tried only where no finger may have another joint, or where even those whose files
        hold drop the object more often than not. The record's best design, which may be one from before, is returned.

        Args:
            found: by the search.
        """
        if found.farthest > OUT_OF_REACH:
            run_whole_hand(self.record, self.model, self.floating, found.candidates[0])
            return self.record.offer(self.judge.judge(self.record.design, found.short))
        while True:
            failing: set[str] = set()
            fewest = np.inf  # drops of a hand whose files hold
            for k, candidate in enumerate(found.candidates):
                may_grow = fewest == np.inf and self._more_joints(found, failing) is not None
                if k >= HANDS_REFINED and (fewest <= LONG_DROPS or may_grow):
                    break
                judged, refined = self._certify(candidate, found.short)
                best = self.record.offer(judged)
                if judged.status == "certified":
                    return best
                self.record.say("refine", f"not certified: {judged.reason}")
                if judged.drops is not None:
                    fewest = min(fewest, judged.drops)
                failing |= failing_fingers(self.model, refined)
                if refined.barely_rolls:
                    break  # a structure that must slip will do so in any of its hands
            least = self._more_joints(found, failing)
            if fewest < np.inf or least is None:
                return best
            self.record.say("synthesis", f"another joint for {', '.join(sorted(failing)) or 'the fingers with fewest'}")
            found = run_search(self.record, self.model, self.search, least)

    def _certify(self, candidate: Candidate, short: tuple[Reason, ...]) -> tuple[Design, Refined]:
        """Find a hand's motion and refine it; where contacts cannot go with the object, from a shorter one on."""
        model, floating, share = self._begun
        whole = run_whole_hand(self.record, model, floating, candidate)
        return self.refiner.certify(whole, short, share=share)

    @cached_property
    def _begun(self) -> tuple[Model, Floating, float]:
        """What refinements begin with: the task, or a share of its way that fingers can surely go with the object."""
        share = _within_reach(self.model) if self.model.held_back else 1.0
        if share == 1:
            return self.model, self.floating, share
        model = shortened(self.model, share)
        return model, run_shortened(self.record, model, self.floating), share

    def _more_joints(self, found: Found, failing: set[str]) -> dict[int, int] | None:
        """Joints of each finger for the next round; None when no failing finger may have more."""
        best = found.candidates[0]
        joints = dict(zip(best.hand.contacts, best.joints, strict=True))
        chosen = [c for c in joints if self.model.contact_names[c] in failing] or list(joints)
        chosen = [c for c in chosen if joints[c] < self.search.max_joints]
        if not chosen:
            return None
        fewest = min(joints[c] for c in chosen)
        return {c: n + (c in chosen and n == fewest) for c, n in joints.items()}


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
        margin: Margin = AMPLE,
        near: bool = False,
        share: float = 1.0,
    ) -> tuple[Design, Refined]:
        """Refine one hand with a margin, and with others where that fails.

        A small one where no motion is exact, another grip where the audit refuses one that is, a firm one where a
        replay drops.

        Args:
            whole: the hand and its motion.
            short: what its fingers could not do before.
            margin: the first to be tried.
            near: whether the motion is nearly exact already.
            share: of the way to its goals that the motion goes.

        Returns:
            the design, replayed where its files hold, and its refinement.
        """
        planned = self.record.design
        stage = Continuation(self.model, whole.contacts, tuple(f.joints for f in whole.fingers), whole.active)
        refined = self._refined(stage, whole, margin, near, share)
        judged, refined, stage = self._between(whole, refined, stage, short, planned)
        if refined.exact and judged.status != "certified" and not stage.passes_through(refined):
            # Where joints barely push, fingers may fold over in an instant: other forces take them another way.
            other, grip = (AMPLE, "looser") if refined.margin == FIRM else (FIRM, "firmer")
            regripped = self._regripped(whole, refined, stage, other, f"again with a {grip} grip: {judged.reason}")
            design, regripped, halved = self._between(whole, regripped, stage, short, planned)
            if design.status == "certified":
                judged, refined, stage = design, regripped, halved
        judged = self._replayed(judged)
        if judged.drops and refined.margin != FIRM:
            text = f"again with a firmer grip: {judged.drops} of {REPLAYS} replays dropped the object"
            firmer = self._regripped(whole, refined, stage, FIRM, text)
            design = self._replayed(self._judged(stage.model, firmer, short, planned))
            if rank_of(design) < rank_of(judged):
                return design, firmer
        return judged, refined

    def _between(
        self, whole: WholeHand, refined: Refined, stage: Continuation, short: tuple[Reason, ...], planned: Design
    ) -> tuple[Design, Refined, Continuation]:
        """Judge a refinement; where it is exact but between samples, halve intervals as long as that helps."""
        judged = self._judged(stage.model, refined, short, planned)
        # Fingers that pass through each other do so on any knots.
        while refined.exact and judged.missed & BETWEEN and not stage.passes_through(refined):
            schedule = stage.model.schedule
            crowded = intervals_to_halve(self.judge.audited(judged), np.diff(schedule.samples))
            if not crowded.any():
                break
            finer = resampled_model(stage.model, schedule.halved(crowded))
            hand = resampled(refined.hand, stage.model, finer)
            text = f"again with samples in the middle of {crowded.sum()} of {len(crowded)} intervals: {judged.reason}"
            with self.record.stage("refine", text):
                halved = Continuation(finer, stage.contacts, stage.joints, hand.active)
                closer = self._attempt(whole, refined.margin, partial(halved.renew, hand))
            design = self._judged(finer, closer, short, planned)
            if _excess(design) > GAIN * _excess(judged) and len(design.missed) >= len(judged.missed):
                break
            judged, refined, stage = design, closer, halved
        return judged, refined, stage

    def _regripped(self, whole: WholeHand, refined: Refined, stage: Continuation, margin: Margin, why: str) -> Refined:
        """An exact motion refined with another margin."""
        with self.record.stage("refine", why):
            return self._attempt(whole, margin, partial(stage.regrip, refined))

    def _refined(self, stage: Continuation, whole: WholeHand, margin: Margin, near: bool, share: float) -> Refined:
        """The refinement with this margin or, where that is not exact and another may be, with a small one.

        Over a long way errors add up, and a firm grip is needed nearly always: it is kept at once where it can be.
        """
        again: Callable[..., Refined] = partial(stage.solve, whole)
        first = partial(again, near=near)
        if share < 1:
            again = partial(stage.lengthen, whole, share)
            first = partial(again, firmer=FIRM)
        with self.record.stage("refine", "the same motion with exact physics, rolling contacts and clearance"):
            refined = self._attempt(whole, margin, first)
        if refined.exact or refined.barely_rolls or margin == SMALL:
            return refined
        with self.record.stage("refine", "again, closer to the limits of friction and grip"):
            second = self._attempt(whole, SMALL, again)
        return second if second.misses_less_than(refined) else refined

    def _attempt(self, whole: WholeHand, margin: Margin, way: Callable[..., Refined]) -> Refined:
        """Refine with one margin, and record all solves, whether they serve or not."""
        result = way(margin=margin)
        runs = []
        for step, solution, kept in result.runs:
            what = f"hand, {kept.friction:g} of the friction and {kept.normal_force:g} weights of grip"
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
        design = self.judge.judge(self.record.design, causes, None if refined.exact else planned)
        self.record.offer(design)
        return design

    def _replayed(self, design: Design) -> Design:
        """The design, replayed if its files hold, and offered again."""
        if design.status != "certified":
            return design
        with self.record.stage("refine", "replays of the motion that holds"):
            design = self.judge.replayed(design, self.jobs)
        self.record.offer(design)
        return design


def _within_reach(model: Model) -> float:
    """The share of the way to its goals over which an object turns by less than fingers can go with it."""
    seen = goals_seen_from_palm(model)
    turns = np.linalg.norm(seen[:, 3:] - seen[0, 3:], axis=1)
    return float(min(1.0, SURELY / max(turns.max(), 1e-9)))


def intervals_to_halve(found: Audit, lengths: Array) -> NDArray[np.bool_]:
    """The intervals between samples that must be shorter for a motion to keep its limits between samples, too.

    Args:
        found: by the audit.
        lengths: (K,) of the intervals, s.
    """
    able = lengths >= 2 * FINEST - 1e-9
    marked = np.zeros(len(lengths), bool)
    for name in BETWEEN:
        figure = found.figures[name]
        if figure.holds or figure.by_interval is None or figure.limit is None:
            continue
        most = ENOUGH * figure.limit
        if name != "slip":
            marked |= figure.by_interval > most
            continue
        for run in figure.by_interval:
            gains = (1 - LEFT) * np.where(able, run, 0.0)
            largest = np.argsort(-gains, kind="stable")
            # None where the run slips little, all that slip where halving all of them is not enough.
            needed = np.searchsorted(np.cumsum(gains[largest]), run.sum() - most)
            chosen = largest[: needed + 1 if run.sum() > most else 0]
            marked[chosen[gains[chosen] > 0]] = True
    # What a joint does in an interval depends on the samples around it, too.
    marked |= np.append(marked[1:], False) | np.append(False, marked[:-1])
    return marked & able


def _excess(design: Design) -> float:
    """How far the worst figure between samples is beyond its limit, over the limit; 0 where all are kept."""
    missed = [design.certificate[name] for name in design.missed & BETWEEN]
    return max((np.inf if f["value"] is None else f["value"] / max(f["limit"], 1e-12) - 1 for f in missed), default=0.0)
