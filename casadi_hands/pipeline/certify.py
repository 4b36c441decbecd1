"""The loop of certification: hands are refined, replayed and given more joints until one is certified."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from casadi_hands.diagnosis.reason import Reason
from casadi_hands.diagnosis.refinement import failing_fingers
from casadi_hands.diagnosis.shortcoming import shortcoming_reason
from casadi_hands.export.design import Design
from casadi_hands.nlp import SolverError
from casadi_hands.pipeline.judge import Judge
from casadi_hands.pipeline.record import Record
from casadi_hands.pipeline.refiner import Refiner
from casadi_hands.pipeline.steps import run_search, run_shortened, run_whole_hand, take_up
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.palm_motion import goals_seen_from_palm
from casadi_hands.problem.resampling import shortened
from casadi_hands.problem.structure import Structure, mobility
from casadi_hands.stages.refine.inter_knot import pass_through
from casadi_hands.stages.refine.result import Refined
from casadi_hands.stages.refine.values import Margin
from casadi_hands.stages.synthesis.algorithm import Candidate, Found, Search

Array = NDArray[np.float64]
OUT_OF_REACH = 0.3  # lengths that a finger misses its contact by: nothing is left to refine
SURELY = np.pi / 2  # that an object may turn so that contacts can surely go with it
MOBILE = 3  # ways to go of object and joints together, with which it depends on the hand whether contacts must slip
HANDS_REFINED = 2  # hands of one structure that roll and are tried, and more only where nothing else is left to try


class Certifier:
    """Refines the hands of a search until one is certified, and keeps the best where none is.

    Args:
        record: of the solve.
        model: the task.
        floating: the motion that hands follow.
        search: run on, where fingers need more joints.
        judge: of the designs.
        jobs: processes for the replays.

    Attributes:
        failed: joints of each finger of hands that were not certified.
    """

    def __init__(
        self, record: Record, model: Model, floating: Floating, search: Search, judge: Judge, jobs: int
    ) -> None:
        self.record, self.model, self.floating, self.search = record, model, floating, search
        self.judge, self.refiner = judge, Refiner(record, model, judge, jobs)
        self.failed: set[tuple[int, ...]] = set()

    def run(self, found: Found) -> Design:
        """Refine the best hand, the next best, then hands with one more joint where those failed.

        A hand whose files or replays don't hold makes way for the next best of its structure. All of them are tried
        only where no finger may have another joint. The record's best design, maybe one from before, is returned.

        Args:
            found: by the search.
        """
        short = tuple(shortcoming_reason(self.model, each) for each in found.short)
        if found.farthest > OUT_OF_REACH:
            run_whole_hand(self.record, self.model, self.floating, found.candidates[0])
            return self.record.update_best(self.record.held_to_bounds(self.judge.judge(self.record.design, short)))
        while True:
            failing: set[str] = set()
            rolling = 0  # hands that could roll
            for candidate, whole in self._clear_first(found.candidates):
                judged, refined = self._refined(whole, short)
                best = self.record.update_best(judged)
                if judged.status == "certified":
                    return best
                self.record.log("refine", f"not certified: {judged.reason}")
                self.failed.add(candidate.joints)
                failing |= failing_fingers(self.model, refined)
                touching = np.ones((1, len(candidate.joints)), bool)
                if refined.barely_rolls and mobility(candidate.joints, touching) < MOBILE:
                    break  # a structure that must slip will do so in any of its hands
                rolling += not refined.barely_rolls
                if rolling >= HANDS_REFINED and self._more_joints(found, failing) is not None:
                    break
            least = self._more_joints(found, failing)
            if least is None:
                return best
            self.record.log("synthesis", f"another joint for {', '.join(sorted(failing)) or 'the fingers with fewest'}")
            found = run_search(self.record, self.model, self.search, least)

    def certify(
        self, candidate: Candidate, margin: Margin | None = None, thorough: bool = True
    ) -> tuple[Design, Refined]:
        """Find a hand's motion and refine it; where contacts cannot go with the object, from a shorter one on.

        Args:
            candidate: the hand.
            margin: the first to be tried; by default what suits the hand.
            thorough: whether much is tried where the audit or replays refuse it, see `Refiner.certify`.

        Returns:
            the design, replayed where its files hold, and its refinement.
        """
        return self._refined(self._moved(candidate), (), margin, thorough)

    def _clear_first(self, candidates: Iterable[Candidate]) -> Iterator[tuple[Candidate, WholeHand]]:
        """Hands and their motions, one by one; last those whose fingers pass through each other on their way.

        They do so in an instant between two samples, and no refinement was seen to lead them around each other.

        Raises:
            SolverError: a solver broke off; not before those that were put off have been tried.
        """
        (model, _, _), crossed, broke_off = self._begun, [], None
        for candidate in candidates:
            try:
                whole = self._moved(candidate)
            except SolverError as error:
                broke_off = error
                break
            structure = Structure.of(model, whole.contacts, candidate.joints, whole.active)
            if pass_through(structure, whole, structure.close_times):
                self.record.log("whole_hand", "put off, as fingers pass through each other")
                crossed.append((candidate, whole))
            else:
                yield candidate, whole
        for candidate, whole in crossed:
            take_up(self.record, model, whole)
            yield candidate, whole
        if broke_off is not None:
            raise broke_off

    def _moved(self, candidate: Candidate) -> WholeHand:
        """A hand with its motion, or what refinements begin with of it."""
        model, floating, _ = self._begun
        return run_whole_hand(self.record, model, floating, candidate)

    def _refined(
        self, whole: WholeHand, short: tuple[Reason, ...], margin: Margin | None = None, thorough: bool = True
    ) -> tuple[Design, Refined]:
        """A hand refined from the homotopy parameter of its motion on; ``short``: what its fingers could not do."""
        _, _, homotopy = self._begun
        return self.refiner.certify(whole, short, margin, homotopy=homotopy, thorough=thorough)

    @cached_property
    def _begun(self) -> tuple[Model, Floating, float]:
        """What refinements begin with."""
        return refinable(self.record, self.model, self.floating)

    def _more_joints(self, found: Found, failing: set[str]) -> dict[int, int] | None:
        """Joints of each finger for the next round, more for those that fail if they may, else for any; or None."""
        best = found.candidates[0]
        joints = dict(zip(best.hand.contacts, best.joints, strict=True))
        chosen = [c for c in joints if joints[c] < self.search.max_joints]
        chosen = [c for c in chosen if self.model.contact_names[c] in failing] or chosen
        if not chosen:
            return None
        fewest = min(joints[c] for c in chosen)
        return {c: n + (c in chosen and n == fewest) for c, n in joints.items()}


def refinable(record: Record, model: Model, floating: Floating) -> tuple[Model, Floating, float]:
    """What refinements begin with: the task, or a share of its way that fingers can surely go with the object."""
    if not rolls_far(model):
        return model, floating, 1.0
    homotopy = _within_reach(model)
    shorter = shortened(model, homotopy)
    return shorter, run_shortened(record, shorter, floating), homotopy


def rolls_far(model: Model) -> bool:
    """Whether the object turns by more than fingers can surely go with."""
    return model.limits_travel and _within_reach(model) < 1


def _within_reach(model: Model) -> float:
    """The homotopy parameter up to which an object turns by less than fingers can go with it."""
    seen = goals_seen_from_palm(model)
    turns = np.linalg.norm(seen[:, 3:] - seen[0, 3:], axis=1)
    return float(min(1.0, SURELY / max(turns.max(), 1e-9)))
