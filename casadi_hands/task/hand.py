"""The hand's limits, its fingertips and motors, and the object's contact with the ground."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, ValidationInfo, field_validator

from casadi_hands.task.fields import NonNegative, Number, Pair, Positive, Section, Vector, follows, refuse
from casadi_hands.task.material import DEFAULT_MATERIAL, MATERIALS, SAFETY, Material
from casadi_hands.task.servos import Drive

USUAL_STIFFNESS = 1.0
"""N·m/rad. An 18 g servo (Dynamixel XL330-M288, by its maker's manual) gives its stall torque, 0.52 N·m, where the
error times its gain, 400/128 a pulse of 1/4096 turn as delivered, reaches the most it gives, 885: at 0.43 rad, so
1.2 N·m/rad, and more with its gain turned up. A printed finger of 5 mm radius and 50 mm length (2.5 GPa) bends like a
spring of 74 N·m/rad at its root, and takes next to nothing off that."""


SHORTEST_HINGE = 2.1
"""Of a link's radius: with less, links that turn by 107° are in each other."""
SHORTEST_LINK = 3.0
"""Of a link's radius: the default of the shortest link, so that a fingertip has room beside its hinge."""


def usual_hinge(radius: float, length: Any) -> float:
    """The default of ``hinge_length``, m: none where links may be shorter than a hinge.

    Args:
        radius: of links, m.
        length: shortest and longest link as given.
    """
    shortest = length[0] if isinstance(length, list | tuple) and length else 0.0
    room = isinstance(shortest, float | int) and shortest > SHORTEST_HINGE * radius
    return SHORTEST_HINGE * radius if room else 0.0


class Ground(Section):
    """A level floor."""

    height: Number = Field(default=0.0, description="Height, m, world z.")
    friction: Positive = Field(
        description="Coulomb friction of object and ground.", json_schema_extra={"default": "as `friction`"}
    )
    touches: Vector = Field(
        description="Where the object may rest on the ground, m, object frame; moved onto the nearest surface.",
        json_schema_extra={"default": "the object's lowest point at the first goal"},
    )


def rubber_torsion(friction: float, radius: float) -> float:
    """Radius of the torsional friction of a rubber tip, m: a patch of 0.3 of its radius, pressed evenly.

    Args:
        friction: Coulomb's, of sliding.
        radius: of the tip, m.
    """
    return 2 / 3 * friction * 0.3 * radius


class Fingertip(Section):
    """What the fingers touch with."""

    radius: Positive = Field(
        description="Radius of every finger's last link, which touches the object, m; at least hand.link_radius. Its "
        "body begins hand.hinge_length × fingertip.radius / hand.link_radius off its joint, and the shortest length "
        "that it may have is as much longer. Larger tips ask for less stiff joints.",
        json_schema_extra={"default": "hand.link_radius"},
    )
    torsion: NonNegative = Field(
        description="Radius of the torsional friction, m: a contact resists a twist about its normal by at most this "
        "times its normal force. 0 is a hard point.",
        json_schema_extra={"default": "0.2 × friction × fingertip.radius, of a rubber tip"},
    )


class Axes(Section):
    """How joints are turned in their links."""

    from_link: Pair = Field(
        default=(60.0, 90.0),
        description="Smallest and largest angle between a joint's axis and the links beside it, degrees. Below some 60 "
        "a joint twists its link more than it bends the finger, and its bearing bears what the motor should. [90, 90] "
        "gives joints square to their links.",
    )

    @field_validator("from_link")
    @classmethod
    def _angles_in_order(cls, value: Pair) -> Pair:
        if not 0 <= value[0] <= value[1] <= 90:
            raise refuse("[least, largest] in degrees with 0 <= least <= largest <= 90")
        return value


class HandSpec(Section):
    """What fingers can be built."""

    link_radius: Positive = Field(
        description="Radius of links, m; of a finger's last one `fingertip.radius`.",
        json_schema_extra={
            "default": "0.13 × palm.radius; more where a straight finger would bend by over 2 % of the object's "
            "characteristic length under what a fingertip may press with, as far as contacts leave room"
        },
    )
    link_length: Pair = Field(
        description="Shortest and longest link, m.",
        json_schema_extra={
            "default": f"[{SHORTEST_LINK:g} × link_radius, palm.radius + the farthest contact from the palm's centre "
            "over the goals]; with servos at least 2 × the radius of their ball"
        },
    )
    hinge_length: NonNegative = Field(
        description="Distance from a joint to where the next link's body begins, m, so that no two links are in each "
        "other. 0 lets them share a ball.",
        json_schema_extra={"default": f"{SHORTEST_HINGE} × link_radius; 0 where links may be shorter"},
    )
    joint_limits: Pair = Field(default=(-90.0, 90.0), description="Lower and upper limit of every joint, degrees.")
    bend: Annotated[NonNegative, Field(le=120)] = Field(
        default=90.0,
        description="Largest angle at zero angle between a link and the one before, the palm's normal for the first, "
        "degrees. 0 gives links that are straight on from each other.",
    )
    axes: Axes = Field(default=Axes(), description="How joints are turned in their links.")
    drive: Drive = Field(
        default=Drive(),
        description="Where motors are: remote (behind the palm, by tendon or belt), or {servo: NAME} in every joint.",
        json_schema_extra={"default": "remote"},
    )
    material: Material = Field(
        default=MATERIALS[DEFAULT_MATERIAL],
        description="What links are made of: PLA, PETG, ABS, PA12, aluminium-6061, or a mapping.",
        json_schema_extra={"default": DEFAULT_MATERIAL},
    )
    safety_factor: Annotated[Number, Field(ge=1)] = Field(
        default=SAFETY, description="Of the material's strength over the stress that links and hinges may have."
    )
    density: Positive = Field(
        default_factory=follows(lambda data: data["material"].density),
        description="Density of links and palm, kg/m³; less than the material's for links that are not solid.",
        json_schema_extra={"default": "that of the material"},
    )
    ratios: Pair = Field(
        default=(0.1, 2.0),
        description="Smallest and largest size of a joint's ratio to a motor that it shares (`motors`): its turn over "
        "that of the joint which the motor turns one to one. A joint that the motor does not turn has 0.",
    )
    contact_force: Positive | None = Field(
        default=None,
        description="Largest component of a contact force along an axis of the object frame, over the object's weight.",
        json_schema_extra={"default": "20, or where the task's loads need more, 4 times their least"},
    )
    clearance: NonNegative = Field(
        description="Distance that bodies which do not touch keep from each other, m.",
        json_schema_extra={"default": "0.02 × object's characteristic length"},
    )

    def hinge_of(self, radius: float) -> float:
        """From a joint to where the body of a link of a radius, m, begins: as many radii for thick ones as for thin."""
        return self.hinge_length * (radius / self.link_radius)

    def shortest_of(self, radius: float) -> float:
        """The shortest that a link of a radius may be, m: with as long a body as the shortest of the others."""
        return self.link_length[0] + (self.hinge_of(radius) - self.hinge_length)

    @field_validator("link_length")
    @classmethod
    def _lengths_in_order(cls, value: Pair) -> Pair:
        if not 0 < value[0] <= value[1]:
            raise refuse("[min, max] with 0 < min <= max")
        return value

    @field_validator("hinge_length")
    @classmethod
    def _room_for_a_hinge(cls, value: float, info: ValidationInfo) -> float:
        radius, length = info.data.get("link_radius"), info.data.get("link_length")
        if value and radius and length and not SHORTEST_HINGE * radius * (1 - 1e-9) <= value < length[0]:
            raise refuse(
                f"0, or at least {SHORTEST_HINGE} × link_radius ({SHORTEST_HINGE * radius:.4g}) and less than the "
                f"shortest link ({length[0]:.4g})"
            )
        return value

    @field_validator("ratios")
    @classmethod
    def _ratios_in_order(cls, value: Pair) -> Pair:
        if not 0 < value[0] <= 1 <= value[1]:
            raise refuse("[smallest, largest] with 0 < smallest <= 1 <= largest")
        return value

    @field_validator("joint_limits")
    @classmethod
    def _limits_in_order(cls, value: Pair) -> Pair:
        if not -180 <= value[0] < value[1] <= 180:
            raise refuse("[lower, upper] in degrees with -180 <= lower < upper <= 180")
        return value


class Actuator(Section):
    """The motor of every joint."""

    torque: Positive | None = Field(
        default=None,
        description="Largest torque, N·m; free if not given.",
        json_schema_extra={"default": "none; of a servo its continuous torque"},
    )
    speed: Positive | None = Field(
        default=None,
        description="Largest speed, rad/s; free if not given.",
        json_schema_extra={"default": "none; of a servo its speed at that torque"},
    )
    stiffness: Positive = Field(
        default=USUAL_STIFFNESS,
        description="Torque by which a joint held at its set point resists a turn, N·m/rad, motor, gears and finger "
        "together.",
        json_schema_extra={"default": f"{USUAL_STIFFNESS:g}; of a servo for which it is known its own"},
    )
    damping: Positive | None = Field(
        default=None,
        description="Torque by which it resists a speed, N·m·s/rad.",
        json_schema_extra={"default": "critical, for a natural frequency of 200 rad/s of motor and links"},
    )
