"""Weights of the cost terms, made from their declarations; the defaults are the thesis's values."""

from __future__ import annotations

from collections.abc import KeysView
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationInfo, create_model, field_validator

from casadi_hands.task.fields import NonNegative, Positive, Section, fill, refuse
from casadi_hands.terms.catalogue import terms_of


def _steps(value: Any) -> Any:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise refuse("a list of 3 numbers, one for each annealing step")
    return value


Annealed = Annotated[tuple[NonNegative, NonNegative, NonNegative], BeforeValidator(_steps)]


class _WeightTable(Section):
    """Weights by name: ``table.task``, ``table["task"]`` and ``dict(table)`` all work."""

    def __getitem__(self, name: str) -> Any:
        """Weight of one term.

        Raises:
            KeyError: no such term.
        """
        if name not in type(self).model_fields:
            raise KeyError(name)
        return getattr(self, name)

    def keys(self) -> KeysView[str]:
        """Names of the terms."""
        return type(self).model_fields.keys()


def _table(stage: str, base: type[_WeightTable]) -> Any:
    """A table with a field for each term that has a weight of its own in a stage."""
    fields: dict[str, Any] = {}
    for term in terms_of(stage):
        weight = term.weights[stage].default
        kind = Annealed if isinstance(weight, tuple) else NonNegative
        source = f" ({term.equation})" if term.equation else ""
        steps = ", by annealing step" if isinstance(weight, tuple) else ""
        fields[term.name] = (kind, Field(default=weight, description=f"{term.about}{source}{steps}."))
    return create_model(f"{stage.title()}Table", __base__=base, **fields)


class FloatingWeights(_table("floating", _WeightTable)):  # type: ignore[misc]
    """Floating contacts (Table 2.1)."""

    friction_sharpness: Positive = Field(
        default=5.0, description="Sharpness of the friction cone, not a weight (eq. 2.8)."
    )


class SynthesisWeights(_table("synthesis", _WeightTable)):  # type: ignore[misc]
    """Synthesis of fingers (Tables 2.2 and 2.3)."""


class WholeHandWeights(_table("whole_hand", FloatingWeights)):  # type: ignore[misc]
    """Whole hand (Table 2.4); a term of the floating stage that is not named keeps that stage's weight."""


# Table 2.4 names these terms of the floating stage; every other one is inherited.
_NAMED_IN_TABLE_2_4 = {term.name for term in terms_of("floating")} & {term.name for term in terms_of("whole_hand")}


class Weights(Section):
    """Weights of the three soft stages; lengths in characteristic lengths, forces in weights, times in seconds."""

    floating: FloatingWeights = Field(default=FloatingWeights(), description="Weights of the floating stage.")
    synthesis: SynthesisWeights = Field(default=SynthesisWeights(), description="Weights of the synthesis stage.")
    whole_hand: WholeHandWeights = Field(
        default={}, validate_default=True, description="Weights of the whole-hand stage."
    )

    @field_validator("whole_hand", mode="before")
    @classmethod
    def _inherit(cls, value: Any, info: ValidationInfo) -> Any:
        floating = info.data.get("floating") or FloatingWeights()
        return fill(value, **{name: floating[name] for name in floating.keys() - _NAMED_IN_TABLE_2_4})
