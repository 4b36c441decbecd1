"""The hand's dimensions: drawings with numbers, and tables."""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING

import numpy as np

from casadi_hands.export.report.drawing import finger_drawings, palm_drawing
from casadi_hands.export.report.markup import Html, paragraph, section, signed, table, text

if TYPE_CHECKING:
    from casadi_hands.problem.hand import Hand
    from casadi_hands.problem.motion import Motion


def dimensions_section(hand: Hand | None, motion: Motion | None) -> Html:
    """The palm with the fingers' bases, then each finger.

    Args:
        hand: None where there is none.
        motion: with velocities and torques; None where there is none.
    """
    title = "What to build"
    if hand is None:
        return section("dimensions", title, paragraph("No stage has designed a hand."))
    explained = (
        "Fingers are drawn stretched, all joints at zero, in one scale. Red arrows are the joints' axes; a dot in a "
        "ring points at you, a cross away from you. Angles count right-handed about the arrows. A length goes from a "
        "joint to the next one, of the last link to the middle of its round tip. A bend is how a link is turned from "
        "the one before it at zero angle. Bends and axes are in the frame of the link before, z along it, those of the "
        "first link in the palm's. The hinge is how far from the joint the link's round body begins."
    )
    palm = (
        f"The palm is a disc of {1e3 * hand.palm_radius:.1f} mm radius, {1e3 * hand.palm_thickness:.1f} mm thick, seen "
        "from where the fingers point, its z axis. Coordinates are from its middle. Dashed lines go towards where "
        "fingers end when they are stretched."
    )
    bases = [(f.name, *(signed(1e3 * part, 1) for part in f.base)) for f in hand.fingers]
    parts = [
        Html(f'<div class="drawings"><figure>{palm_drawing(hand)}<figcaption>{text(palm)}</figcaption></figure>'),
        Html(f"<div>{table(('Base of', 'x, mm', 'y, mm', 'z, mm'), bases)}{paragraph(explained)}</div></div>"),
    ]
    parts += [_finger(hand, motion, i) for i in range(len(hand.fingers))]
    return section("dimensions", title, *parts)


def _finger(hand: Hand, motion: Motion | None, index: int) -> Html:
    finger = hand.fingers[index]
    drawings = "".join(f"<figure>{drawing}</figure>" for drawing in finger_drawings(hand, index))
    rows = []
    for j, link in enumerate(finger.links):
        bends = ", ".join(f"{signed(degrees(angle), 1)}°" for angle in link.bend)
        axis = f"({', '.join(signed(float(part), 2) for part in link.turn.apply(link.axis))})"
        sizes = (f"{1e3 * link.length:.1f}", f"{1e3 * link.radius:.1f}", f"{1e3 * link.hinge:.1f}")
        rows.append((f"{j + 1}", *sizes, bends, axis, *_moved(motion, f"finger{index}_joint{j}")))
    head = ["Joint and link", "length, mm", "radius, mm", "hinge, mm", "bend about x, y", "axis of the joint"]
    if motion is not None:
        head += ["turns", "fastest, rad/s", "torque, N·m"]
    whole = 1e3 * sum(link.length for link in finger.links)
    return Html(
        f'<h3>{text(finger.name)} <small>{whole:.1f} mm stretched</small></h3><div class="drawings">{drawings}</div>'
        f"{table(head, rows)}"
    )


def _moved(motion: Motion | None, name: str) -> tuple[str, ...]:
    """How far a joint turns, how fast, and how hard it works."""
    if motion is None:
        return ()
    column = motion.joint_names.index(name)
    angles = np.degrees(motion.joint_angles[:, column])
    turns = f"{signed(angles.min(), 0)} to {signed(angles.max(), 0)}°"
    others = (motion.joint_velocities, motion.joint_torques)
    return turns, *("" if values is None else f"{np.abs(values[:, column]).max():.3g}" for values in others)
