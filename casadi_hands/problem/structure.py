"""What a refine problem is built for: the joints of each finger, and when each contact touches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from casadi_hands.problem.model import Model

LEAST_HOLDING = 3  # contacts: between fewer an object turns as it likes
APART = 0.1  # s, how far at most the times are apart at which fingers are kept clear of each other
CLOSE_APART = 0.025  # s, likewise of those at which it is looked for whether they pass through each other


@dataclass(frozen=True)
class Inner:
    """Times between knots at which a motion on them is looked at, too.

    Attributes:
        count: of the knots.
        interval: (M,) the knot that each of these times comes after.
        share: (M,) of the interval that has passed by then.
    """

    count: int
    interval: NDArray[np.int64]
    share: NDArray[np.float64]

    @classmethod
    def of(cls, numbers: NDArray[np.int64]) -> Inner:
        """So many (S - 1,) in each interval, evenly spaced."""
        shares = [(np.arange(n) + 1) / (n + 1) for n in numbers]
        return cls(len(numbers) + 1, np.repeat(np.arange(len(numbers)), numbers), np.concatenate(shares))

    def weights(self, chosen: NDArray[np.int64] | None = None) -> NDArray[np.float64]:
        """(K, S) of the knots, that give what is linear from knot to knot at all or the chosen (K,) of these times."""
        chosen = np.arange(len(self.share)) if chosen is None else chosen
        weights = np.zeros((len(chosen), self.count))
        rows, knots, share = np.arange(len(chosen)), self.interval[chosen], self.share[chosen]
        weights[rows, knots], weights[rows, knots + 1] = 1 - share, share
        return weights


def mobility(joints: Sequence[int], touching: NDArray[np.bool_]) -> int:
    """How many ways object and joints can go at once while all fingers that touch roll, where fewest (Grübler).

    Args:
        joints: of each finger.
        touching: (S, F) which fingers do.
    """
    return int(6 + (touching @ (np.array(joints, int) - 3)).min())


@dataclass(frozen=True)
class Structure:
    """What a refine problem is built for.

    Attributes:
        model: the task.
        contacts: index of each finger's contact.
        joints: of each finger.
        active: (S, columns) which contact touches, held from its knot to the next: the fingers', then, if the ground
            ever carries load, the ground's.
    """

    model: Model
    contacts: tuple[int, ...]
    joints: tuple[int, ...]
    active: NDArray[np.bool_]

    @classmethod
    def of(
        cls, model: Model, contacts: tuple[int, ...], joints: tuple[int, ...], active: NDArray[np.bool_]
    ) -> Structure:
        """Pick the columns in use from the flags (S, C) of all contacts, the ground's last."""
        columns = list(contacts)
        if model.ground is not None and active[:, -1].any():
            columns.append(model.contacts)
        return cls(model, contacts, joints, active[:, columns])

    @property
    def columns(self) -> list[int]:
        """Index of every contact in use, in the order of the problem's points and forces."""
        return [*self.contacts, *([self.model.contacts] if self.grounded else [])]

    @property
    def grounded(self) -> bool:
        """Whether the ground ever carries load."""
        return bool(self.active.shape[1] > len(self.contacts))

    @property
    def pinched(self) -> bool:
        """Whether two contacts ever hold the object alone: torsion alone then resists a turn about the line of both."""
        return bool(self.active.sum(axis=1).min() < LEAST_HOLDING)

    @cached_property
    def middles(self) -> Inner:
        """The middle of each interval."""
        return Inner.of(np.ones(len(self.model.schedule.samples) - 1, int))

    @cached_property
    def inner(self) -> Inner:
        """The middle of each interval, or more times where these would be more than ``APART`` from the knots."""
        return self._inner(APART)

    @cached_property
    def close_times(self) -> Inner:
        """The same with at most ``CLOSE_APART`` from one time to the next."""
        return self._inner(CLOSE_APART)

    def _inner(self, apart: float) -> Inner:
        steps = np.diff(self.model.schedule.samples)
        return Inner.of(np.maximum(np.ceil(steps / apart - 1e-9).astype(int) - 1, 1))

    @property
    def touching(self) -> NDArray[np.bool_]:
        """(S, columns) where bodies touch: from the first active knot to the first broken one."""
        return np.asarray(self.active | np.vstack([np.zeros((1, self.active.shape[1]), bool), self.active[:-1]]))
