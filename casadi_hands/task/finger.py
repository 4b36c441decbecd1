"""The fingers' contacts with the object: where each touches, and when it lets go."""

from __future__ import annotations

from collections.abc import Iterable

from pydantic import Field, model_validator

from casadi_hands.errors import TaskError
from casadi_hands.task.fields import Flag, Positive, Section, Vector, refuse
from casadi_hands.task.region import Asked, Place, Region


class Regrasp(Section):
    """A finger that lets go of the object and touches it again elsewhere, while others hold it."""

    start: Positive = Field(alias="from", description="When it lifts, s.")
    end: Positive = Field(alias="to", description="When it touches again, s.")
    touches: Vector = Field(
        description="Where it touches then, m, object frame; moved onto the nearest surface.",
    )

    @property
    def times(self) -> tuple[float, float]:
        """When it lifts and when it touches again, s."""
        return self.start, self.end

    @model_validator(mode="after")
    def _in_order(self) -> Regrasp:
        if self.end <= self.start:
            raise refuse("a time `from` before the time `to`")
        return self


class FingerSpec(Section):
    """A finger, known by its contact with the object."""

    touches: Place = Field(
        description="Where the fingertip touches at the start, m, object frame; moved onto the nearest surface. Or a "
        "region in which the program places it: `{near: [x, y, z], within: distance}`, `{on: NAME}`, `{not_on: NAME}`, "
        "several of these, or `anywhere`."
    )
    regrasps: tuple[Regrasp, ...] | None = Field(
        default=None,
        min_length=1,
        description="When it lets go and takes the object anew, in order of time; it touches all the time else. Where "
        "nothing is said, fingers regrasp only what turns too far for them.",
    )
    optional: Flag | None = Field(
        default=None, description="Whether the program, where it places the contact, may do without the finger."
    )
    placed: Asked | None = Field(
        default=None, description="The region that was asked for, where the program placed the contact."
    )

    @model_validator(mode="after")
    def _optional_where_placed(self) -> FingerSpec:
        if self.optional and self.is_placed and self.placed is None:
            raise refuse("`optional` beside a region or `anywhere`: a finger whose point is given is always built")
        return self

    @property
    def is_placed(self) -> bool:
        """Whether there is a point to touch."""
        return not isinstance(self.touches, Region)

    @property
    def points(self) -> tuple[Vector, ...]:
        """All points to touch, in order of time, m, object frame; of a finger that is placed."""
        return self.point, *(each.touches for each in self.regrasps or ())

    def touching(self, points: Iterable[Vector]) -> FingerSpec:
        """The same finger, of other ``points``: as many."""
        first, *later = points
        regrasps = tuple(
            each.model_copy(update={"touches": point}) for each, point in zip(self.regrasps or (), later, strict=True)
        )
        return self.model_copy(update={"touches": first, "regrasps": regrasps or None})

    @property
    def point(self) -> Vector:
        """The point to touch, m, object frame.

        Raises:
            TaskError: there is only a region.
        """
        if isinstance(self.touches, Region):
            raise TaskError(
                f"the contact is not placed yet: it is to be {self.touches}; `casadi-hands solve` places it first"
            )
        x, y, z = self.touches
        return x, y, z
