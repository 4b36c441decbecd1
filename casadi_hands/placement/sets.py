"""Sets of contacts, one a finger: drawn, bettered, ranked, and the best that differ kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from casadi_hands.placement.grip import Bounds, Grip, least_grip
from casadi_hands.placement.surface import Spots

Array = NDArray[np.float64]
Index = NDArray[np.int64]
DRAWN, BETTERED, NEIGHBOURS = 8000, 40, 10
PROGRAMMES, TRIED = 40, 150  # with a solution, and in all
WOBBLE = 3.0  # m·g that a set costs whose stiffness is only just there
ALL = 100_000  # sets that are not drawn but taken one and all
ROOM = 2.6  # radii of a fingertip between the centres of two
APART = 0.5  # lengths, by which some contact of a set differs from all of another that is called different


@dataclass(frozen=True)
class Ranked:
    """A set of contacts with what speaks for it.

    Attributes:
        chosen: (K,) indices of its contacts among the candidates.
        grip: m·g, the least that the hardest-pressed contact presses with over all loads.
        reach: what touching there costs, m·g: off side-on to the palm, far from it, travelling far, on a curved
            surface.
        wobble: stiffness of fingertips that the grasp asks for, by what joints have at a palm radius from them.
    """

    chosen: Index
    grip: float
    reach: float
    wobble: float

    @property
    def cost(self) -> float:
        """What sets are ranked by."""
        return self.grip + self.reach + WOBBLE * self.wobble


def rank(
    candidates: Spots,
    choices: Sequence[Index],
    reach: Array,
    bounds: Bounds,
    wobble: Callable[[Index, Grip], float],
    radius: float,
    most: int,
    rng: np.random.Generator,
) -> list[Ranked]:
    """The best sets found that differ, best first; none where no set can bear the loads.

    Sets are drawn at random, and the best of them by the bound bettered by going to neighbours. Then the programme is
    solved for the one with the least bound, which lifts bounds of others, and so on, until none can be better or for so
    many sets; then again for those that differ from what was found.

    Args:
        candidates: the points.
        choices: for each finger the candidates it may touch.
        reach: (N,) cost of each, m·g.
        bounds: of the grip, with the loads.
        wobble: of a set with its grip.
        radius: of a fingertip, lengths.
        most: sets to be found.
        rng: which draws.
    """
    tips = candidates.points + radius * candidates.normals
    apart = np.linalg.norm(tips[:, None] - tips[None], axis=2)
    free = apart >= ROOM * radius
    sets = _with_room(_drawn(choices, rng), free)
    if not len(sets):
        return []
    for _ in range(2):
        best = sets[np.argsort(_cost(sets, reach, bounds), kind="stable")[:BETTERED]]
        sets = np.vstack([sets, _with_room(_neighbours(best, choices, apart), free)])
    sets = _distinct(sets)
    search = _Search(sets, reach[sets].mean(axis=1), bounds, wobble)
    distance = np.linalg.norm(candidates.points[:, None] - candidates.points[None], axis=2)
    found: list[Ranked] = []
    while len(found) < most and (best_left := search.best()) is not None:
        found.append(best_left)
        search.left &= _differ(sets, best_left.chosen, distance)
    return sorted(found, key=lambda each: each.cost)


class _Search:
    """Programmes solved for sets in the order of their bounds.

    Attributes:
        left: (S,) which sets are looked at.
    """

    def __init__(self, sets: Index, reach: Array, bounds: Bounds, wobble: Callable[[Index, Grip], float]) -> None:
        self.sets, self.reach, self.bounds, self.wobble = sets, reach, bounds, wobble
        self.left = np.ones(len(sets), bool)
        self.pressed, self.known = bounds.pressed(sets), len(bounds.wanted)
        self.least = np.maximum(bounds.of(sets, self.pressed), self.pressed.max(axis=1))
        self.solved: dict[int, Ranked] = {}

    def best(self) -> Ranked | None:
        """The best of the sets that are left; None where none of those that were tried can bear the loads."""
        solved = 0
        for _ in range(TRIED):
            self.least = np.maximum(self.least, self.bounds.of(self.sets, self.pressed, self.known))
            self.known = len(self.bounds.wanted)
            cost = np.where(self.left, self.least + self.reach, np.inf)
            cost[list(self.solved)] = np.inf
            first = int(cost.argmin())
            if solved == PROGRAMMES or not cost[first] < min((each.cost for each in self._found()), default=np.inf):
                break
            self._solve(first)
            solved += bool(np.isfinite(self.solved[first].cost))
        return min(self._found(), key=lambda each: each.cost, default=None)

    def _found(self) -> list[Ranked]:
        return [each for k, each in self.solved.items() if self.left[k] and np.isfinite(each.cost)]

    def _solve(self, k: int) -> None:
        bounds, chosen = self.bounds, self.sets[k]
        grip = least_grip(bounds.contacts, chosen, bounds.loads, bounds.disturbances)
        bounds.add(grip.prices)
        wobble = self.wobble(chosen, grip) if np.isfinite(grip.most) else np.inf
        self.solved[k] = Ranked(chosen, grip.most, float(self.reach[k]), wobble)


def _differ(sets: Index, other: Index, distance: Array) -> NDArray[np.bool_]:
    """Whether the loneliest contact of either set is far from all contacts of the other, for each set (S, K)."""
    between = distance[sets][:, :, other]
    lone = np.maximum(between.min(axis=1).max(axis=1), between.min(axis=2).max(axis=1))
    return np.asarray(lone >= APART)


def _cost(sets: Index, reach: Array, bounds: Bounds) -> Array:
    return np.asarray(bounds.all(sets) + reach[sets].mean(axis=1))


def _drawn(choices: Sequence[Index], rng: np.random.Generator) -> Index:
    """So many sets, or all there are."""
    if np.prod([float(len(each)) for each in choices]) <= ALL:
        return _distinct(np.stack(np.meshgrid(*choices, indexing="ij"), axis=-1).reshape(-1, len(choices)))
    return _distinct(np.column_stack([rng.choice(each, DRAWN) for each in choices]))


def _distinct(sets: Index) -> Index:
    """In the order they came."""
    _, first = np.unique(np.sort(sets, axis=1), axis=0, return_index=True)
    return np.asarray(sets[np.sort(first)])


def _with_room(sets: Index, free: NDArray[np.bool_]) -> Index:
    """Those whose fingertips have room beside each other."""
    count = sets.shape[1]
    good = np.ones(len(sets), bool)
    for i in range(count):
        for j in range(i):
            good &= free[sets[:, i], sets[:, j]]
    return np.asarray(sets[good])


def _neighbours(sets: Index, choices: Sequence[Index], apart: Array) -> Index:
    """The sets with one contact moved to one of those nearest to it that its finger may touch."""
    found = [sets]
    for finger, allowed in enumerate(choices):
        nearest = allowed[np.argsort(apart[np.ix_(sets[:, finger], allowed)], axis=1, kind="stable")[:, :NEIGHBOURS]]
        moved = np.repeat(sets[:, None], nearest.shape[1], axis=1)
        moved[:, :, finger] = nearest
        found.append(moved.reshape(-1, sets.shape[1]))
    return np.vstack(found)
