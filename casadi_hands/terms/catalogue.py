"""All declared terms, by stage: the schema's weights, the documents' tables and the cost report are made from this."""

from __future__ import annotations

from casadi_hands.declared import Term
from casadi_hands.terms import body, clearance, contact, finger

# A term that is declared in one of these modules is found by itself.
_MODULES = body, contact, clearance, finger


def single(weight: float | tuple[float, float, float]) -> float:
    """A weight as one number; of an annealed one the last step's."""
    return weight[-1] if isinstance(weight, tuple) else weight


def _declared() -> list[Term]:
    return [value for module in _MODULES for value in vars(module).values() if isinstance(value, Term)]


def names() -> tuple[str, ...]:
    """Of all declared terms, in alphabetical order."""
    return tuple(sorted({term.name for term in _declared()}))


def terms_of(stage: str) -> tuple[Term, ...]:
    """The terms that have a weight of their own in a stage, in the order of their declaration."""
    found: dict[str, Term] = {}
    for term in _declared():
        if stage in term.weights:
            found.setdefault(term.name, term)
    return tuple(found.values())
