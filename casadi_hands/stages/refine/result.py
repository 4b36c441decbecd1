"""What a refinement gives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from casadi_hands.nlp import Constraint, Solution
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.stages.refine.tightest import Tightest
from casadi_hands.stages.refine.values import Margin


@dataclass(frozen=True)
class Worst:
    """The constraint that a solve violates most.

    Attributes:
        constraint: ``kernel.constraint``.
        violation: in the constraint's own unit.
        time: s, of the knot where it is; None where the constraint has no time.
        contacts: indices of those whose fingers it is about; none where it is the object's.
        declared: what is constrained, and what to say of it.
    """

    constraint: str
    violation: float
    time: float | None
    contacts: tuple[int, ...] = ()
    declared: Constraint = field(default=Constraint(""))


class Run(NamedTuple):
    """A solve: its step, what came out, and the margin to the limits that it kept."""

    what: str
    solution: Solution
    margin: Margin


@dataclass(frozen=True)
class Refined:
    """A motion that was refined.

    Attributes:
        hand: as the whole-hand stage's, with the design as it is now.
        met: whether every constraint is met within ``ACCEPTED``.
        worst: of the motion's constraints.
        slips: for each contact, lengths, what the last solve left that did not forbid slip, or else the last.
        slips_hopelessly: whether the stiff penalties were left with so much slip that no exact one was tried.
        barely_rolls: whether rolling is out of the structure's reach, or so nearly that a stiffer penalty had to look
            for it.
        runs: every solve.
        weights: of the terms of the motion's solve.
        margin: to keep to the limits, that the motion was solved with.
        homotopy: the parameter that the motion was continued to: 1 where it reaches its goals.
        tightest: the limit that keeps the worst of them from being met, as far as it can be told.
        sharpness: how many times the spin was lowered beyond which contacts have their torsion at its limit.
    """

    hand: WholeHand
    met: bool
    worst: Worst
    slips: dict[str, float]
    slips_hopelessly: bool
    barely_rolls: bool
    runs: tuple[Run, ...]
    weights: dict[str, float]
    margin: Margin
    homotopy: float = 1.0
    tightest: Tightest | None = None
    sharpness: int = 0

    @property
    def exact(self) -> bool:
        """Whether the motion meets its constraints and goes all the way to its goals."""
        return self.met and self.homotopy == 1

    def misses_less_than(self, other: Refined) -> bool:
        """Whether the motion is exact where the other is not, goes farther, rolls where it slips, or violates less."""

        def missed(refined: Refined) -> tuple[bool, float, bool, float]:
            return not refined.met, -refined.homotopy, refined.slips_hopelessly, refined.worst.violation

        return missed(self) < missed(other)
