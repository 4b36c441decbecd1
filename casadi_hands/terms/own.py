"""Costs and constraints of a person's own: residuals of what object, contacts and joints do at one instant, in SI."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from casadi import SX
from numpy.typing import ArrayLike

from casadi_hands.declared import Constraint, Term, Weight
from casadi_hands.errors import SolveError
from casadi_hands.terms.catalogue import names

OWN_STAGES = ("floating", "whole_hand", "refine")  # with the object's pose, its contacts and forces as variables


@dataclass(frozen=True)
class Instant:
    """What a residual is made of: CasADi symbols of one sample of a stage, named and framed as the arrays of a motion.

    Attributes:
        time: s.
        position: (3,) of the object's centre of mass, world, m.
        rotation: (3, 3) world from object.
        points: by contact's name (3,) where it is on the object, object frame, m; the ground's is named ``ground``.
        forces: by contact's name (3,) on the object, world, N; zero while it does not touch.
        angles: by finger's name (n,) of its joints from the palm on, rad; none in the stage floating.
    """

    time: SX
    position: SX
    rotation: SX
    points: Mapping[str, SX]
    forces: Mapping[str, SX]
    angles: Mapping[str, SX]


Residual = Callable[[Instant], Any]


@dataclass(frozen=True)
class Cost:
    """A cost of one's own in one stage: its weight times the mean over the samples of what the residual costs.

    Attributes:
        name: unique in its stage, and no built-in term's.
        residual: gives an expression, of any shape, in the symbols of an instant.
        stage: floating, whole_hand or refine.
        weight: beside those of the stage's own terms, which the task states.
        form: ``square``: the residual's sum of squares costs; ``sum``: the plain sum of its entries.
    """

    name: str
    residual: Residual
    stage: str = "refine"
    weight: float = 1.0
    form: Literal["square", "sum"] = "square"

    @property
    def declared(self) -> Term:
        """As kernels take it."""
        return Term(self.name, form=self.form, weights={self.stage: Weight(self.weight, "sample")})


@dataclass(frozen=True)
class Bound:
    """A constraint of one's own in one stage: the residual stays within bounds at every sample.

    Attributes:
        name: unique in its stage, and no built-in term's.
        residual: gives an expression, of any shape, in the symbols of an instant.
        stage: floating, whole_hand or refine; a later one does not know of it.
        lower: bound of every entry, or of each; entries column by column.
        upper: likewise.
    """

    name: str
    residual: Residual
    stage: str = "refine"
    lower: ArrayLike = -math.inf
    upper: ArrayLike = math.inf

    @property
    def declared(self) -> Constraint:
        """As kernels take it."""
        return Constraint(self.name, cannot=f"meet '{self.name}'")


OwnTerm = Cost | Bound


def checked(terms: Sequence[OwnTerm]) -> tuple[OwnTerm, ...]:
    """The terms, if they can be used.

    Raises:
        SolveError: one cannot; the message names it and says what is allowed.
    """
    taken: set[tuple[str, str]] = set()
    for term in terms:
        if not isinstance(term, Cost | Bound):
            raise SolveError(f"terms: given {term!r}; allowed: casadi_hands.Cost and casadi_hands.Bound")
        _check_name(term, taken)
        if isinstance(term, Cost):
            _check_cost(term)
        else:
            _check_bound(term)
        taken.add((term.stage, term.name))
    return tuple(terms)


def _check_name(term: OwnTerm, taken: set[tuple[str, str]]) -> None:
    if not isinstance(term.name, str) or not term.name.isidentifier():
        raise SolveError(f"terms: the name {term.name!r} is refused; allowed: letters, digits and underscores")
    if term.stage not in OWN_STAGES:
        raise SolveError(f"terms: '{term.name}' is for the stage {term.stage!r}; allowed: {', '.join(OWN_STAGES)}")
    # Those of a second scenario are reported by the term's name with this ending.
    if term.name.removesuffix("_perturbed") in names():
        raise SolveError(
            f"terms: '{term.name}' is a built-in term's name, as are {', '.join(names())}; give it another"
        )
    if (term.stage, term.name) in taken:
        raise SolveError(f"terms: the stage {term.stage} is given '{term.name}' twice; give every term its own name")


def _check_cost(term: Cost) -> None:
    if not isinstance(term.weight, int | float) or not 0 <= term.weight < math.inf:
        raise SolveError(f"terms: '{term.name}' has the weight {term.weight!r}; allowed: a number, 0 or more")
    if term.form not in ("square", "sum"):
        raise SolveError(f"terms: '{term.name}' has the form {term.form!r}; allowed: square, sum")


def _check_bound(term: Bound) -> None:
    lower, upper = np.asarray(term.lower, float), np.asarray(term.upper, float)
    if np.isnan(lower).any() or np.isnan(upper).any() or np.any(lower > upper):
        raise SolveError(f"terms: '{term.name}' has bounds {term.lower!r} to {term.upper!r}; allowed: lower <= upper")
