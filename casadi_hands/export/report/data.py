"""What is plotted over time: curves by panel, in units that people read."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.export.commands import commanded
from casadi_hands.export.markup import finger_color
from casadi_hands.export.page.robot import Robot
from casadi_hands.export.page.timeline import design_timeline
from casadi_hands.export.report.markup import signed
from casadi_hands.export.report.slip import slip_so_far
from casadi_hands.export.report.words import joint_title
from casadi_hands.export.urdf import hand_urdf

if TYPE_CHECKING:
    from casadi_hands.problem.hand import Hand
    from casadi_hands.problem.motion import Motion
    from casadi_hands.problem.result import Result
    from casadi_hands.task import Task

_DIGITS = 5


@dataclass(frozen=True)
class Curve:
    """One curve of a panel.

    Attributes:
        label: what it is of.
        color: CSS.
        dash: which of the page's dashes it has; 0 is none.
        values: (S,) in the panel's unit; not a number where there is none.
    """

    label: str
    color: str
    dash: int
    values: np.ndarray


@dataclass(frozen=True)
class Panel:
    """One plot over time.

    Attributes:
        key: unique on the page.
        title: what is plotted.
        unit: of its values.
        about: what a reader should know of it.
        curves: of it.
        kind: ``line``, or ``state``: bars where a value is.
    """

    key: str
    title: str
    unit: str
    about: str
    curves: tuple[Curve, ...]
    kind: str = "line"

    @property
    def largest(self) -> tuple[str, float, int] | None:
        """Label, value and sample of what is farthest from zero; None where there are no values."""
        found = [(curve, np.abs(curve.values)) for curve in self.curves if not np.isnan(curve.values).all()]
        if not found or self.kind == "state":
            return None
        curve, size = max(found, key=lambda item: float(np.nanmax(item[1])))
        k = int(np.nanargmax(size))
        return curve.label, float(curve.values[k]), k


def panels(design: Result) -> list[Panel]:
    """All panels of a design; those for which there is nothing are left out.

    Args:
        design: whole or partial.
    """
    motion, hand = design.motion, design.hand
    if motion is None:
        return []
    found = _goals(design.task, motion)
    if hand is not None:
        motion = with_commands(design)
        found = [*_joints(hand, motion), *found]
    found += _contacts(design, motion)
    return [panel for panel in found if panel.curves]


def with_commands(design: Result) -> Motion:
    """The motion with velocities, torques and commands, which earlier folders lack."""
    assert design.motion is not None
    assert design.hand is not None
    if design.motion.joint_commands is None:
        return commanded(design.task, design.hand, design.motion)
    return design.motion


def plotted(found: Sequence[Panel], time: np.ndarray) -> dict[str, Any]:
    """Panels as the page's script reads them; a gap is None.

    Args:
        found: the panels.
        time: (S,) s, of their values.
    """
    return {
        "time": _numbers(time),
        "panels": [
            {
                "key": panel.key,
                "unit": panel.unit,
                "kind": panel.kind,
                "curves": [
                    {"label": c.label, "color": c.color, "dash": c.dash, "values": _numbers(c.values)}
                    for c in panel.curves
                ],
            }
            for panel in found
        ],
    }


def css(color: Iterable[float]) -> str:
    """A colour, RGB in 0..1, as CSS."""
    return "#" + "".join(f"{round(255 * part):02x}" for part in color)


def _numbers(values: np.ndarray) -> list[float | None]:
    return [None if np.isnan(value) else float(f"{value:.{_DIGITS}g}") for value in values.tolist()]


def _joints(hand: Hand, motion: Motion) -> list[Panel]:
    """Angles, speeds, torques and commands of the joints, and of motors that share them."""
    lower, upper = (signed(limit, 0) for limit in np.degrees([hand.joint_lower, hand.joint_upper]))
    found = []
    for key, title, unit, scale, values, about in (
        (
            "angles",
            "Joint angles",
            "°",
            180 / np.pi,
            motion.joint_angles,
            f"From {lower} to {upper}° at most.",
        ),
        ("speeds", "Joint speeds", "rad/s", 1.0, motion.joint_velocities, ""),
        ("torques", "Joint torques", "N·m", 1.0, motion.joint_torques, "For the planned forces; links weigh nothing."),
        (
            "commands",
            "Joint commands",
            "°",
            180 / np.pi,
            motion.joint_commands,
            "Set points: off the angles by what a joint's spring gives under its torque.",
        ),
    ):
        if values is not None:
            found.append(Panel(key, title, unit, about, _of_joints(hand, motion, scale * values)))
    if motion.motor_positions is not None:
        curves = tuple(
            Curve(f"motor {m + 1}", css(finger_color(m)), 0, np.degrees(column))
            for m, column in enumerate(motion.motor_positions.T)
        )
        found.append(Panel("motors", "Motor positions", "°", "Of the motors that share the joints.", curves))
    return found


def _of_joints(hand: Hand, motion: Motion, values: np.ndarray) -> tuple[Curve, ...]:
    column = {name: k for k, name in enumerate(motion.joint_names)}
    return tuple(
        Curve(joint_title(hand, i, j), css(finger_color(i)), j, values[:, column[f"finger{i}_joint{j}"]])
        for i, finger in enumerate(hand.fingers)
        for j in range(len(finger.links))
    )


def _contacts(design: Result, motion: Motion) -> list[Panel]:
    """Forces, contact state and slip, by contact."""
    names = [(c, name, _contact_color(design.hand, name, c)) for c, name in enumerate(motion.contact_names)]
    size = np.linalg.norm(motion.contact_force, axis=2)
    forces = [Curve(name, color, 0, size[:, c]) for c, name, color in names]
    about = "Size of the force of each contact on the object."
    if motion.contact_force_disturbed is not None:
        disturbed = np.linalg.norm(motion.contact_force_disturbed, axis=2)
        forces += [Curve(f"{name}, disturbed", color, 1, disturbed[:, c]) for c, name, color in names]
        about += " Dashed: with the task's disturbances."
    state = np.where(motion.contact_active, 1.0, np.nan)
    rows = tuple(Curve(name, color, 0, (len(names) - c) * state[:, c]) for c, name, color in names)
    found = [
        Panel("forces", "Contact forces", "N", about, tuple(forces)),
        Panel("contacts", "Contacts", "", "A bar where the contact touches.", rows, "state"),
    ]
    if design.hand is not None:
        timeline = design_timeline(replace(design, motion=motion), Robot(hand_urdf(design.hand)))
        slip = 1e3 * slip_so_far(motion, timeline)
        curves = tuple(Curve(name, color, 0, slip[:, c]) for c, name, color in names)
        found.append(Panel("slip", "Slip", "mm", "How far each contact has slipped since it touched.", curves))
    return found


def _contact_color(hand: Hand | None, name: str, index: int) -> str:
    fingers = [finger.name for finger in hand.fingers] if hand else []
    return css(finger_color(fingers.index(name) if name in fingers else len(fingers) + index))


def _goals(task: Task, motion: Motion) -> list[Panel]:
    """How far the object is from the goal that comes next."""
    at = np.array([goal.at for goal in task.motion])
    distance, angle = _off(task, motion, np.minimum(np.searchsorted(at, motion.time - 1e-9), len(at) - 1))
    about = "From the goal that comes next: it should be zero when that one is due."
    what = "object" if task.tool is None else "tool"
    found = [Panel("distance", "Distance to go", "mm", about, (Curve(what, _PLAIN, 0, distance),))]
    if angle is not None:
        found.append(Panel("turn", "Turn to go", "°", about, (Curve(what, _PLAIN, 0, angle),)))
    return found


def goal_errors(task: Task, motion: Motion) -> list[tuple[float, float | None]]:
    """Distance (mm) and angle (degrees; None when drawing) of the plan from each goal, at the sample nearest to it."""
    found: list[tuple[float, float | None]] = []
    for number, goal in enumerate(task.motion):
        k = int(np.abs(motion.time - goal.at).argmin())
        distance, angle = _off(task, motion, np.full(len(motion.time), number))
        found.append((float(distance[k]), None if angle is None else float(angle[k])))
    return found


def _off(task: Task, motion: Motion, which: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
    """Distance (S,), mm, and angle (S,), degrees, of the object from goals (S,) by number; of the tool, no angle."""
    turned = Rotation.from_quat(motion.object_orientation, scalar_first=True)
    if task.tool is not None:
        points = np.array([goal.tool_at for goal in task.motion])[which]
        return 1e3 * np.linalg.norm(turned.apply(task.tool) + motion.object_position - points, axis=1), None
    poses = task.goal_poses()
    places = np.array([place for _, place, _ in poses])[which]
    goals = Rotation.from_rotvec(np.array([turn for *_, turn in poses])[which])
    return (
        1e3 * np.linalg.norm(motion.object_position - places, axis=1),
        np.degrees((turned * goals.inv()).magnitude()),
    )


_PLAIN = "#3f8f59"  # of what is no finger's
