"""Algorithm 1: grow fingers until each serves its contact, recombining them into hands on the way."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from casadi_hands.errors import SolveError
from casadi_hands.execution.journal import Journal
from casadi_hands.execution.processes import run_all
from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.stages.synthesis.score import THRESHOLD, finger_scores, singular_fingers, worst_miss
from casadi_hands.stages.synthesis.shortcoming import Shortcoming, shortcoming
from casadi_hands.stages.synthesis.stage import Synthesised
from casadi_hands.stages.synthesis.target import Target
from casadi_hands.stages.synthesis.trials import combine_fingers, design_finger

Progress = Callable[[str], None]
# A finger that passes a singular pose counts as worse than one that does not by this, and its hand by this share:
# where others serve about as well they are taken.
SINGULAR_FINGER, SINGULAR_HAND = 0.05, 0.1


@dataclass(frozen=True)
class Candidate:
    """A hand with its fingers' scores.

    Attributes:
        hand: the fingers.
        scores: one a finger; below the threshold it needs no more joints.
        trial: the recombination it came from.
    """

    hand: Synthesised
    scores: tuple[float, ...]
    trial: int

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints of each finger."""
        return tuple(finger.joints for finger in self.hand.fingers)


@dataclass(frozen=True)
class Found:
    """What the search ends with.

    Attributes:
        candidates: hands of the last round, best first.
        farthest: how far the worst of those fingers is from its contact, lengths.
        short: why fingers stayed above the threshold at the most joints allowed, one finding each.
    """

    candidates: tuple[Candidate, ...]
    farthest: float
    short: tuple[Shortcoming, ...]


class Search:
    """The state of Algorithm 1 for one target.

    Args:
        target: what the fingers follow.
        weights: of the synthesis terms, by name; annealed ones are triples.
        trials, recombinations, max_joints, threshold, seed: the task's search settings.
        executor: where trials run; None for here.
        progress: told in words what was tried and the best score so far.
        journal: where trials are kept; by default they are not.
    """

    def __init__(
        self,
        target: Target,
        weights: Mapping[str, Any],
        *,
        trials: int,
        recombinations: int,
        max_joints: int,
        threshold: float | None,
        seed: int,
        executor: Executor | None,
        progress: Progress,
        journal: Journal | None = None,
    ) -> None:
        self.target, self.weights = target, weights
        self.trials, self.recombinations, self.max_joints, self.seed = trials, recombinations, max_joints, seed
        self.threshold = THRESHOLD if threshold is None else threshold
        self.executor, self.progress, self.journal = executor, progress, journal or Journal()
        self.names = target.model.contact_names
        # A contact that never acts has no finger.
        self.contacts = tuple(c for c in range(len(self.names)) if target.active[:, c].any())
        if not self.contacts:
            raise SolveError(
                "no finger contact is ever active: the task needs no hand, or none could help; give goals where the "
                "object would not rest by itself"
            )
        self.pools: dict[int, list[tuple[float, FingerSeed]]] = {c: [] for c in self.contacts}
        self.grown: dict[int, int] = {}  # joints of the fingers in each pool
        self.runs: list[dict[str, Any]] = []

    def run(self, least: Mapping[int, int] | None = None) -> Found:
        """Grow all fingers from one joint, or from ``least[contact]``, until each is saturated."""
        joints = {c: max((least or {}).get(c, 1), 1) for c in self.contacts}
        growing = {c for c in self.contacts if self.grown.get(c) != joints[c]}
        while True:
            self._grow(joints, sorted(growing))
            candidates = self._recombine(sum(joints.values()))
            best = candidates[0]
            scores = dict(zip(self.contacts, best.scores, strict=True))
            # Compared so that a score that is no number lacks.
            lacking = [c for c in self.contacts if not scores[c] < self.threshold]
            growing = {c for c in lacking if joints[c] < self.max_joints}
            if not growing:
                farthest = max((worst_miss(self.target, best.hand, c)[0] for c in lacking), default=0.0)
                short = tuple(shortcoming(self.target, best.hand, c, scores[c]) for c in lacking)
                return Found(tuple(candidates), farthest, short)
            for c in growing:
                joints[c] += 1

    def with_joints(self, joints: Mapping[int, int]) -> list[Candidate]:
        """Hands of fingers with ``joints[contact]`` joints, whether these are enough or not, best first."""
        self._grow(joints, [c for c in self.contacts if self.grown.get(c) != joints[c]])
        return self._recombine(sum(joints.values()))

    def _grow(self, joints: Mapping[int, int], growing: list[int]) -> None:
        """Fresh trials of the fingers that got a joint."""
        work = [
            (self.target, c, joints[c], (self.seed, c, joints[c], trial), self.weights)
            for c in growing
            for trial in range(self.trials)
        ]
        best = dict.fromkeys(growing, np.inf)

        def done(index: int, result: Synthesised) -> None:
            contact = work[index][1]
            best[contact] = min(best[contact], _alone(result))
            trial = index % self.trials + 1
            self.progress(
                f"finger {self.names[contact]}, {joints[contact]} joint(s), trial {trial}/{self.trials}, "
                f"best score {best[contact]:.3f}"
            )

        def name(index: int) -> str:
            _, contact, of, (*_, trial), _ = work[index]
            return f"finger {self.names[contact]}, {of} joint(s), trial {trial + 1}"

        kept = self.journal.section(f"fingers of {joints} joints")
        results = run_all(self.executor, design_finger, work, done, kept, name)
        for c in growing:
            self.grown[c] = joints[c]
            pool = [r for args, r in zip(work, results, strict=True) if args[1] == c]
            scored = [(_alone(r) + SINGULAR_FINGER * singular_fingers(self.target, r), r.fingers[0]) for r in pool]
            self.pools[c] = sorted(scored, key=lambda pair: pair[0])
        for args, result in zip(work, results, strict=True):
            self._record(f"finger {self.names[args[1]]}, {args[2]} joints", args[3][3], result)

    def _recombine(self, round_key: int) -> list[Candidate]:
        """Hands of the best fingers and of sampled ones, best first: by objective, where singular poses count."""
        rng = np.random.default_rng((self.seed, 1_000_003, round_key))
        chosen: list[tuple[int, ...]] = []
        for trial in range(self.recombinations):
            picks = tuple(0 if trial == 0 else _sample(self.pools[c], rng) for c in self.contacts)
            if picks not in chosen:
                chosen.append(picks)
        work = []
        for picks in chosen:
            fingers = tuple(self.pools[c][pick][1] for c, pick in zip(self.contacts, picks, strict=True))
            work.append((self.target, self.contacts, fingers, self.weights))

        def done(index: int, result: Synthesised) -> None:
            self.progress(f"hand {index + 1}/{len(work)}, objective {result.solution.objective:.3f}")

        kept = self.journal.section(f"hands of {round_key} joints")
        results = run_all(self.executor, combine_fingers, work, done, kept, lambda index: f"hand {index + 1}")
        candidates = []
        for trial, result in enumerate(results):
            scores = tuple(float(s) for s in finger_scores(self.target, result))
            candidates.append(Candidate(result, scores, trial))
            self._record(f"hand of {'+'.join(str(f.joints) for f in result.fingers)} joints", trial, result)

        def cost(candidate: Candidate) -> float:
            return candidate.hand.solution.objective * (
                1 + SINGULAR_HAND * singular_fingers(self.target, candidate.hand)
            )

        return sorted(candidates, key=cost)

    def take_runs(self) -> list[dict[str, Any]]:
        """Records of the solves since the last call, for ``stages`` of result.json."""
        runs, self.runs = self.runs, []
        return runs

    def _record(self, what: str, trial: int, result: Synthesised) -> None:
        for step, solution in result.runs:
            self.runs.append(run_record("synthesis", f"{what}, trial {trial}", self.seed, step, solution))


def run_record(stage: str, what: str, seed: int, step: str, solution: Any) -> dict[str, Any]:
    """One entry of ``stages`` in result.json."""
    return {
        "stage": stage,
        "what": what,
        "seed": seed,
        "annealing_step": step,
        "iterations": solution.iterations,
        "seconds": solution.seconds,
        "status": solution.status,
        "objective": solution.objective,
    }


def _alone(result: Synthesised) -> float:
    """A finger's score before there is a hand: tip target plus null space, as the thesis has it."""
    terms = result.solution.terms
    return float(terms["tip_target"] + terms["null_space"])


def _sample(pool: list[tuple[float, FingerSeed]], rng: np.random.Generator) -> int:
    """Index of a finger drawn with chances in inverse proportion to scores."""
    chances = np.array([1 / max(score, 1e-6) for score, _ in pool])
    if not chances.sum() > 0:  # no trial came to anything
        return int(rng.integers(len(pool)))
    return int(rng.choice(len(pool), p=chances / chances.sum()))
