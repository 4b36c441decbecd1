"""The limits a design must keep to be certified."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from casadi_hands.task.fields import NonNegative, Section

USUAL_DEFLECTION = 0.02
"""Of the characteristic length: the default of ``tip_deflection``."""


def usual_replay_position(characteristic_length: float) -> float:
    """The default of ``replay_position``, m, for an object with this characteristic length, m."""
    return max(0.002, 0.05 * characteristic_length)


class Limits(Section):
    """Limits of the certificate; weight means mass times gravity (9.81 m/s² where gravity is off)."""

    goal_position: NonNegative = Field(default=0.0005, description="Distance of object (or tool) and goal, m.")
    goal_angle: NonNegative = Field(default=0.5, description="Angle between object and goal, degrees.")
    residual: NonNegative = Field(
        default=1e-6,
        description="Newton-Euler residual at the motion's knots: force over weight, torque over weight × "
        "characteristic length.",
    )
    residual_between: NonNegative = Field(default=1e-3, description="The same between knots.")
    friction_excess: NonNegative = Field(
        default=0.0, description="Tangential force beyond friction × normal force, on either surface, over weight."
    )
    pull: NonNegative = Field(
        default=0.0, description="Normal force by which a contact would have to suck, over weight."
    )
    torsion_excess: NonNegative = Field(
        default=1e-3,
        description="Torsional moment beyond what a fingertip bears beside its force: over its radius, over weight.",
    )
    torsion_shortfall: NonNegative = Field(
        default=0.15,
        description="Share by which the moment of a contact that spins is off its limit against the spin, or with "
        "which it drives a slower one.",
    )
    penetration: NonNegative = Field(default=0.0001, description="Depth by which two bodies overlap, m.")
    gap: NonNegative = Field(default=0.00005, description="Distance of an active contact's surfaces at samples, m.")
    gap_between: NonNegative = Field(default=0.0001, description="The same between samples, m.")
    slip: NonNegative = Field(
        default=0.0002,
        description="Slip of a contact from touch to lift, m. From 0.001 on, and 2 % of the characteristic length, "
        "contacts may be planned to slide by 80 % of it at most, with friction on its cone against the slip.",
    )
    slide_shortfall: NonNegative = Field(
        default=0.15,
        description="Share by which the tangential force of a contact that slides is off its cone against the slip.",
    )
    attachment_shortfall: NonNegative = Field(
        default=0.15,
        description="Share by which the friction of an attached object's joint is off all of it against the motion.",
    )
    unsupplied_force: NonNegative = Field(
        default=0.02, description="Contact force that the joints cannot supply actively, over weight."
    )
    joint_limit: NonNegative = Field(default=0.001, description="Angle beyond a joint's limit, degrees.")
    speed: NonNegative = Field(default=1.0, description="Joint speed as a share of the actuator's, if one is named.")
    torque: NonNegative = Field(default=1.0, description="Joint torque as a share of the actuator's, if one is named.")
    coupling: NonNegative = Field(
        default=1e-4,
        description="Angle by which a joint's command is off what the motors that share it turn it to, rad.",
    )
    disturbance_radius: NonNegative = Field(
        default=0.0,
        description="Least size of the smallest wrench the grasp cannot resist, over weight. 0 asks for none: two "
        "point contacts can never resist a spin about the line through them.",
    )
    least_stiffness: NonNegative = Field(
        default=1.0,
        description="Least stiffness of the joints with which the planned grasp holds itself, N·m/rad.",
        json_schema_extra={"default": "`actuator.stiffness`"},
    )
    bearing_force: NonNegative = Field(
        default=0.0,
        description="Force on the bearing of a joint, N.",
        json_schema_extra={"default": "strength of hand.material / safety_factor × link_radius² / 25"},
    )
    bearing_moment: NonNegative = Field(
        default=0.0,
        description="Moment on the bearing of a joint, across its axis, N·m.",
        json_schema_extra={"default": "strength of hand.material / safety_factor × link_radius³ × 2/15"},
    )
    link_stress: NonNegative = Field(
        default=0.0,
        description="Stress in a link, Pa.",
        json_schema_extra={"default": "strength of hand.material / safety_factor"},
    )
    tip_deflection: NonNegative = Field(
        default=0.0,
        description="How far loads bend the end of a finger away, m.",
        json_schema_extra={"default": "2 % of the characteristic length"},
    )
    replay_position: NonNegative = Field(
        default=0.002,
        description="Distance of object (or tool) and any goal when the design is replayed as planned, m.",
        json_schema_extra={"default": "the larger of 2 mm and 5 % of the characteristic length"},
    )
    replay_angle: NonNegative = Field(default=5.0, description="Angle between object and any goal then, degrees.")
    replay_dropped: Annotated[NonNegative, Field(le=1)] = Field(
        default=0.05, description="Share of perturbed replays that drop the object."
    )
