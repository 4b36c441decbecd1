"""Motors that share joints, in MJCF: hinges of their own, and a spring to every joint that they turn."""

from __future__ import annotations

from math import nextafter
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement

from casadi_hands.export.markup import number, numbers

if TYPE_CHECKING:
    from casadi_hands.problem.hand import Hand
    from casadi_hands.problem.motors import Motor

_ROTOR = 1e-3  # kg, and its inertia relative to the armature: of a body that turns in place, with no weight
_UNSET = -1.0  # a rest length for which MuJoCo takes that at the start instead


def add_motors(
    world: Element, root: Element, hand: Hand, springs: tuple[Motor, ...], motors: tuple[Motor, ...]
) -> None:
    """Add the motors that turn the joints, after all other bodies, and the joints' springs.

    Args:
        world: that they stand in.
        root: of the scene.
        hand: with a drive.
        springs: of each joint: its stiffness and damping.
        motors: that share them.
    """
    drive = hand.drive
    assert drive is not None
    for name, motor in zip(drive.names, motors, strict=True):
        body = SubElement(world, "body", name=name, gravcomp="1")
        inertia = numbers((*(3 * [1e-3 * motor.armature]), 0.0, 0.0, 0.0))
        SubElement(body, "inertial", pos="0 0 0", mass=number(_ROTOR), fullinertia=inertia)
        SubElement(body, "joint", name=name, axis="0 0 1", limited="false", armature=number(motor.armature))
    tendons = SubElement(root, "tendon")
    for name, offset, ratios, spring in zip(hand.joint_names, drive.offsets, drive.ratios, springs, strict=True):
        tendon = SubElement(
            tendons,
            "fixed",
            name=name,
            springlength=number(nextafter(offset, 0.0) if offset == _UNSET else offset),
            stiffness=number(spring.stiffness),
            damping=number(spring.damping),
        )
        SubElement(tendon, "joint", joint=name, coef="1")
        for motor_name, ratio in zip(drive.names, ratios, strict=True):
            if ratio:
                SubElement(tendon, "joint", joint=motor_name, coef=number(-ratio))
