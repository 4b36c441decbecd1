"""Weights of the cost terms, with the thesis's values as defaults."""

from __future__ import annotations

from collections.abc import KeysView
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator

from casadi_hands.task.fields import NonNegative, Positive, Section, fill, refuse


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


class FloatingWeights(_WeightTable):
    """Floating contacts (Table 2.1)."""

    linear_momentum: NonNegative = Field(default=10.0, description="Newton's law (eq. 2.6).")
    angular_momentum: NonNegative = Field(default=10.0, description="Euler's law (eq. 2.5).")
    force_regularisation: NonNegative = Field(default=0.01, description="Forces that act (eq. 2.7).")
    raw_force: NonNegative = Field(default=0.01, description="Forces whether their contact is active or not.")
    friction_cone: NonNegative = Field(default=0.1, description="Friction (eq. 2.8).")
    task: NonNegative = Field(default=50.0, description="Goals (eq. 2.9).")
    contact_on_object: NonNegative = Field(default=100.0, description="Contact on the object's surface (eq. 2.10).")
    slip_on_object: NonNegative = Field(default=100.0, description="Change of the gap to the object (eq. 2.12).")
    tangential_slip: NonNegative = Field(default=10.0, description="Slip of the contact along the object.")
    contact_acceleration: NonNegative = Field(default=0.01, description="Contacts' acceleration (eq. 2.13).")
    object_acceleration: NonNegative = Field(
        default=0.1, description="Object's acceleration (eq. 2.14), a moving palm's taken off."
    )
    object_angular_acceleration: NonNegative = Field(default=1.0, description="Object's rate of spin (eq. 2.15).")
    palm_clearance: NonNegative = Field(default=100.0, description="Object and palm overlapping (3.2.3).")
    contact_patch: NonNegative = Field(default=1.0, description="Contacts away from where the task put them.")
    path: NonNegative = Field(default=3.0, description="Keyframes off the straight way between goals.")
    friction_sharpness: Positive = Field(
        default=5.0, description="Sharpness of the friction cone, not a weight (eq. 2.8)."
    )


class SynthesisWeights(_WeightTable):
    """Synthesis of fingers (Tables 2.2 and 2.3)."""

    tip_target: Annealed = Field(
        default=(50.0, 10.0, 50.0), description="Fingertip at its contact (eq. 2.18), by annealing step."
    )
    collision: Annealed = Field(
        default=(0.1, 5.0, 100.0), description="Bodies overlapping (eq. 2.20), by annealing step."
    )
    length: NonNegative = Field(default=0.1, description="Length of links (eq. 2.21).")
    minimum_length: NonNegative = Field(default=1.0, description="Links below the shortest (eq. 2.22).")
    null_space: NonNegative = Field(default=1.0, description="Forces that no joint supplies (eq. 2.23).")
    torque: NonNegative = Field(default=0.05, description="Joint torques (eq. 2.24).")
    finger_base: NonNegative = Field(default=1.0, description="Fingers off the palm (eq. 2.25).")
    fingertip_acceleration: NonNegative = Field(
        default=0.001, description="Acceleration of free fingertips (eq. 2.26)."
    )
    joint_limits: NonNegative = Field(default=1.0, description="Joints beyond their limits (eq. 2.27).")


class WholeHandWeights(FloatingWeights):
    """Whole hand (Table 2.4); a term of the floating stage that is not named keeps that stage's weight."""

    contact_on_object: NonNegative = Field(default=100.0, description="Contact on the object's surface (eq. 2.10).")
    slip_on_object: NonNegative = Field(default=10.0, description="Change of the gap to the object (eq. 2.12).")
    contact_on_finger: NonNegative = Field(default=100.0, description="Contact on the fingertip's surface.")
    slip_on_finger: NonNegative = Field(default=10.0, description="Slip of the contact along the fingertip.")
    joint_limits: NonNegative = Field(default=1.0, description="Joints beyond their limits (eq. 2.27).")
    finger_acceleration: NonNegative = Field(default=0.001, description="Acceleration of every fingertip.")
    collision: NonNegative = Field(default=100.0, description="Bodies overlapping (eq. 2.20).")
    null_space: NonNegative = Field(default=1.0, description="Forces that no joint supplies (eq. 2.23).")
    torque: NonNegative = Field(default=0.05, description="Joint torques (eq. 2.24).")
    friction_cone_hand: NonNegative = Field(
        default=0.1, description="Friction against the fingertip's normal (eq. 2.8)."
    )
    base_acceleration: NonNegative = Field(default=0.01, description="Acceleration of a palm that may move.")


# Table 2.4 names these two terms of the floating stage; every other one is inherited.
_NAMED_IN_TABLE_2_4 = {"contact_on_object", "slip_on_object"}


class Weights(Section):
    """Weights of the three soft stages; lengths in half extents, forces in weights, times in seconds."""

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
