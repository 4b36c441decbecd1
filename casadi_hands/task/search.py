"""Settings of the search over structures."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from casadi_hands.task.fields import Positive, Section, Whole


class Search(Section):
    """Algorithm 1: how many fingers and hands are tried."""

    trials: Annotated[Whole, Field(ge=1)] = Field(
        default=10, description="Random starts of each finger and joint count."
    )
    recombinations: Annotated[Whole, Field(ge=1)] = Field(default=5, description="Hands built from the best fingers.")
    max_joints: Annotated[Whole, Field(ge=1, le=6)] = Field(default=3, description="Most joints a finger may get.")
    threshold: Positive | None = Field(
        default=None,
        description="Score below which a finger gets no more joints.",
        json_schema_extra={"default": "the program's own"},
    )
    seed: Annotated[Whole, Field(ge=0)] = Field(
        default=0, description="Seed of the random numbers; another gives another hand."
    )
