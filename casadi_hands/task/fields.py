"""The kinds of value a task file holds, and the base class of its sections."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, Strict
from pydantic_core import PydanticCustomError


class Section(BaseModel):
    """One mapping of the task file: immutable, and closed to names it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @classmethod
    def file_names(cls) -> list[str]:
        """Names that a task file may use in this section."""
        return [field.alias or name for name, field in cls.model_fields.items()]


def refuse(allowed: str, given: str | None = None) -> PydanticCustomError:
    """Build the error of a value that a validator refuses.

    Args:
        allowed: what the field accepts, in the user's words.
        given: what the file holds, where that is more than its kind tells.
    """
    # The text travels as context: a custom error's message is a template, and braces in `allowed` must survive.
    context = {"allowed": allowed} if given is None else {"allowed": allowed, "given": given}
    return PydanticCustomError("refused", "{allowed}", context)


def _of_length(count: int) -> Callable[[Any], Any]:
    def check(value: Any) -> Any:
        if not isinstance(value, list | tuple) or len(value) != count:
            raise refuse(f"a list of {count} numbers")
        return value

    return check


Number = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
NonNegative = Annotated[Number, Field(ge=0)]
Whole = Annotated[int, Strict()]
Flag = Annotated[bool, Strict()]
Pair = Annotated[tuple[Number, Number], BeforeValidator(_of_length(2))]
Vector = Annotated[tuple[Number, Number, Number], BeforeValidator(_of_length(3))]
Quadruple = Annotated[tuple[Number, Number, Number, Number], BeforeValidator(_of_length(4))]
Matrix = Annotated[tuple[Vector, Vector, Vector], BeforeValidator(_of_length(3))]


def vector(array: np.ndarray) -> Vector:
    """Plain numbers of an array (3,)."""
    x, y, z = (float(value) for value in array)
    return x, y, z


def follows(default: Callable[[dict[str, Any]], Any]) -> Callable[[dict[str, Any]], Any]:
    """Let a field's default follow from the fields before it.

    Args:
        default: computes it from their values by name.

    Returns:
        The field's ``default_factory``.
    """

    def factory(values: dict[str, Any]) -> Any:
        # Before 2.14, pydantic asks although one of them was refused. The section then is, too, and nobody sees this.
        try:
            return default(values)
        except KeyError:
            return None

    return factory


def fill(value: Any, **defaults: Any) -> Any:
    """Add defaults to a section that is still plain data; anything else is left for pydantic to judge."""
    return {**defaults, **value} if isinstance(value, dict) else value
