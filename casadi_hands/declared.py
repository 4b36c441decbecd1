"""What a cost term and a constraint say of themselves; their residuals stand beside their declarations, in `terms`.

Apart from `nlp`, so that the task's schema, which is made from the declarations, needs no solver.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple


class Weight(NamedTuple):
    """What a term weighs in a stage.

    Attributes:
        default: one number, or one for each annealing step.
        per: what the term is a mean over: keyframes, goals, samples, knots; ``once``: it is taken as it is.
    """

    default: float | tuple[float, float, float]
    per: Literal["keyframe", "goal", "sample", "knot", "once"] = "keyframe"


@dataclass(frozen=True)
class Term:
    """A cost term, declared once: the schema's weights, the documents' tables and the cost report are made of this.

    Attributes:
        name: unique among terms.
        about: what costs, in a few words.
        equation: where it comes from.
        unit: of the residual.
        form: ``square``: the sum of squares of the residual costs; ``sum``: the plain sum of non-negative values does.
        weights: by stage, what it weighs there.
        weighs_as: the term whose weight it takes, where it has none of its own.
    """

    name: str
    about: str = ""
    equation: str = ""
    unit: str = ""
    form: Literal["square", "sum"] = "square"
    weights: Mapping[str, Weight] = field(default_factory=dict)
    weighs_as: str = ""


@dataclass(frozen=True)
class Constraint:
    """What is constrained, declared once.

    Attributes:
        name: unique in its kernel.
        equation: where it comes from.
        unit: of its values: ``length``, ``force``, ``torque``, ``speed``, ``angle``, or none that a reader would know.
        cannot: what is not done where it is violated; continues ``finger 'x' cannot ...``.
        advice: what to try then.
        explains: figures of the audit that follow then.
    """

    name: str
    equation: str = ""
    unit: str = ""
    cannot: str = ""
    advice: str = ""
    explains: tuple[str, ...] = ()
