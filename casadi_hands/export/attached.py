"""An attached object in MJCF: its joint, and its coordinates."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement

from casadi_hands.export.markup import number, numbers

if TYPE_CHECKING:
    from casadi_hands.problem.motion import Motion
    from casadi_hands.task import Task
    from casadi_hands.task.attached import Attached

# s and relative: how stiffly a thread keeps its pitch, as stiff as MuJoCo's time step of 1 ms lets it be.
_STIFF = {"solref": "0.002 1", "solimp": "0.99 0.999 0.0001"}

# The object alone is light beside what drives it: regularised as usual, friction would give way to the fingers.
_DRY = {"solreffriction": "0.004 1", "solimpfriction": "0.9999 0.9999 0.001"}


def add_joints(body: Element, attached: Attached | None, motion: Motion) -> None:
    """Add the joint to the object's body, which stands as at the motion's first sample; a free one's is free.

    The axis moves neither in the object nor in the world, so that it is where the object's frame has it.

    Args:
        body: the object's.
        attached: its joint, or None.
        motion: says where the joint is at the start.
    """
    if attached is None:
        SubElement(body, "freejoint", name="object")
        return
    joint = attached.joint
    begin = 0.0 if motion.attachment_position is None else float(motion.attachment_position[0])
    resisting = {
        "frictionloss": number(joint.friction),
        "stiffness": number(joint.stiffness),
        "damping": number(joint.damping),
        "springref": number(0.0),
        **_DRY,
    }
    where = {"pos": numbers(joint.pivot), "axis": numbers(joint.direction)}
    if attached.kind == "screw":
        along = {"name": "object_along", "type": "slide", **where, "ref": number(joint.advance * begin)}
        SubElement(body, "joint", along)
    kind = "hinge" if joint.turns else "slide"
    SubElement(body, "joint", {"name": "object", "type": kind, **where, "ref": number(begin), **resisting})


def couple(root: Element, attached: Attached | None) -> None:
    """Add the equation that a thread's turn and its advance keep; other joints need none."""
    if attached is None or attached.kind != "screw":
        return
    parent = root.find("equality")
    parent = SubElement(root, "equality") if parent is None else parent
    coefficients = numbers((0.0, attached.joint.advance, 0.0, 0.0, 0.0))
    SubElement(parent, "joint", {"joint1": "object_along", "joint2": "object", "polycoef": coefficients, **_STIFF})


def object_coordinates(task: Task, motion: Motion, k: int) -> tuple[float, ...]:
    """The object's coordinates in MuJoCo at a sample: a free one's pose, or its joint's."""
    attached = task.object.attached
    if attached is None or motion.attachment_position is None:
        return (*motion.object_position[k], *motion.object_orientation[k])
    turned = float(motion.attachment_position[k])
    return (attached.joint.advance * turned, turned) if attached.kind == "screw" else (turned,)
