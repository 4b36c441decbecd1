"""Where motors are: behind the palm, or servos in the joints, from a small library."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians, sqrt
from typing import Any

from pydantic import Field, SerializerFunctionWrapHandler, field_validator, model_serializer, model_validator

from casadi_hands.task.fields import Section, refuse

_LASTING = 1 / 5
"""Of the stall torque, where no maker says more: Robotis' manuals ask robots to load a servo with a fifth of it."""


@dataclass(frozen=True)
class Servo:
    """A servo as its maker describes it.

    Attributes:
        size: (3,) m, of its case: along its shaft, its longest side across that, and its other side.
        mass: kg.
        stall: N·m, the most it gives, for a moment.
        continuous: N·m that it can hold.
        no_load: rad/s, its largest speed.
        price: ``low`` (below 10 EUR), ``mid`` or ``high`` (above 40 EUR).
        stiffness: N·m/rad with its gain as delivered, where it follows from what the maker says.
    """

    size: tuple[float, float, float]
    mass: float
    stall: float
    continuous: float
    no_load: float
    price: str
    stiffness: float | None = None

    @property
    def speed(self) -> float:
        """rad/s at its continuous torque: a motor's speed falls evenly to zero at its stall torque."""
        return self.no_load * (1 - self.continuous / self.stall)

    @property
    def reach(self) -> float:
        """Radius of the ball about its middle that holds it, m."""
        return sqrt(sum(side**2 for side in self.size)) / 2


def _servo(
    size: tuple[float, float, float],
    grams: float,
    stall: float,
    degrees: float,
    price: str,
    lasting: float = _LASTING,
    stiffness: float | None = None,
) -> Servo:
    """A servo from sides in mm, mass in g, stall torque in N·m, and no-load speed in degrees/s."""
    along, length, across = (side / 1000 for side in size)
    return Servo((along, length, across), grams / 1000, stall, lasting * stall, radians(degrees), price, stiffness)


SERVOS: dict[str, Servo] = {
    # TowerPro's data sheets at 4.8 V, as sellers and courses state them: 1.8 kgf·cm, 0.1 s for 60°.
    "SG90": _servo((31.0, 22.2, 11.8), 9.0, 0.176, 600.0, "low"),
    "MG90S": _servo((28.5, 22.8, 12.2), 13.4, 0.176, 600.0, "low"),
    # emanual.robotis.com at 5 V; 383, 103 and 81 turns a minute. The stiffness is that of `hand.USUAL_STIFFNESS`.
    "XL330-M077": _servo((26.0, 34.0, 20.0), 18.0, 0.215, 6 * 383.0, "mid"),
    "XL330-M288": _servo((26.0, 34.0, 20.0), 18.0, 0.52, 6 * 103.0, "mid", stiffness=1.2),
    "XC330-M288": _servo((26.0, 34.0, 20.0), 23.0, 0.93, 6 * 81.0, "high"),
    # Feetech's 12 V type (C018): 30 kgf·cm, 45 turns a minute. It held half of its stall torque for an hour
    # (TheRobotStudio/SO-ARM100, issue 134), and got too hot swinging with that; a third is what its maker rates it for.
    "STS3215": _servo((35.0, 45.2, 24.7), 55.0, 2.94, 6 * 45.0, "mid", lasting=1 / 3),
}
"""By name."""


class Drive(Section):
    """Where motors are: `remote`, behind the palm by tendon or belt, or `{servo: NAME}`, one in every joint."""

    servo: str | None = Field(
        default=None,
        description=f"The servo in every joint: {', '.join(SERVOS)}. Links have its mass, and others keep clear of it.",
    )

    @model_validator(mode="before")
    @classmethod
    def _remote(cls, value: Any) -> Any:
        if not isinstance(value, str):
            return value
        if value != "remote":
            raise refuse("remote, or {servo: NAME}")
        return {}

    @field_validator("servo")
    @classmethod
    def _known(cls, value: str | None) -> str | None:
        if value is not None and value not in SERVOS:
            raise refuse(f"one of {', '.join(SERVOS)}")
        return value

    @model_serializer(mode="wrap")
    def _written(self, handler: SerializerFunctionWrapHandler) -> Any:
        return "remote" if self.servo is None else handler(self)

    @property
    def motor(self) -> Servo | None:
        """The servo, or None where motors are behind the palm."""
        return None if self.servo is None else SERVOS[self.servo]


def servo_reach(drive: Any) -> float:
    """Radius of the ball that holds the servo of a drive as a file has it, m; 0 without one."""
    name = drive.get("servo") if isinstance(drive, dict) else drive.servo if isinstance(drive, Drive) else None
    return SERVOS[name].reach if isinstance(name, str) and name in SERVOS else 0.0
