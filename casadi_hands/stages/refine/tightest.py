"""Which limit a motion that is not exact presses against most, by the solve's multipliers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from casadi_hands.nlp import Constraint, Solution
from casadi_hands.stages.refine.declaration import Declaration

LEAST = 0.1  # of the largest multiplier: what a limit that is told must have
# What their bounds keep in a range that the solver needs, or that another constraint has.
_OF_NO_ACCOUNT = ("holding", "drag", "sticking")


class Tightest(NamedTuple):
    """The limit that costs most.

    Attributes:
        limit: ``kernel.constraint``, or the quantity whose bound it is: ``angles``, ``lengths``, ``base``, ``bends``,
            ``force``, ``pose`` and such.
        time: s, of the knot where it is; None where it has no time.
        contacts: indices of those whose fingers it is about; none where it is the object's.
        declared: of a constraint, what is constrained, and what to say of it.
    """

    limit: str
    time: float | None
    contacts: tuple[int, ...] = ()
    declared: Constraint | None = None


def tightest(built: Declaration, solution: Solution, violated: str) -> Tightest | None:
    """The limit, beside the constraint that is violated most, with the largest multiplier.

    Where constraints contradict each other, what keeps the violated one from being met has multipliers as large as its
    own. Equations are none of a person's choice, and are left out.

    Args:
        built: the problem.
        solution: that violates a constraint.
        violated: its name, ``kernel.constraint``.

    Returns:
        None where no limit matters.
    """
    found = sorted(_pressed(built, solution), key=lambda pair: -pair[0])
    if not found or found[0][0] <= 0:
        return None
    others = (limit for size, limit in found if size >= LEAST * found[0][0] and limit.limit != violated)
    return next(others, None)


def _pressed(built: Declaration, solution: Solution) -> Iterator[tuple[float, Tightest]]:
    """Every limit where its multiplier is largest, with that."""
    times = built.structure.model.schedule.samples
    for name, sizes in solution.multipliers.items():
        block, constraint = name.split(".")
        if not sizes.size or block not in built.blocks:
            continue
        about = built.blocks[block]
        declared = about.kernel.declared[constraint]
        if about.knots is None:
            yield float(sizes.max()), Tightest(name, None, about.contacts, declared)
            continue
        instance = int(sizes.reshape(len(about.knots), -1).max(axis=1).argmax())
        yield float(sizes.max()), Tightest(name, float(times[about.knots[instance]]), about.contacts, declared)
    for name, sizes in solution.bound_multipliers.items():
        quantity = name.rstrip("0123456789")
        if sizes.size and quantity not in _OF_NO_ACCOUNT:
            row, column = np.unravel_index(int(sizes.argmax()), sizes.shape)
            timed = len(sizes) == len(times)
            who = _owners(built, name, quantity, int(column))
            yield float(sizes.max()), Tightest(quantity, float(times[row]) if timed else None, who)


def _owners(built: Declaration, name: str, quantity: str, column: int) -> tuple[int, ...]:
    """The contact that an entry of a variable is of, if it is one's."""
    if name != quantity:
        return (int(name[len(quantity) :]),)
    if quantity in ("force", "force_disturbed", "point"):
        return (built.structure.columns[column // 3],)
    return ()
