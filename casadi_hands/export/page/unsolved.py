"""What is drawn of a task that has no hand yet: its bare palm, and names beside what is there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from casadi_hands.export.page.shapes import Color
from casadi_hands.export.page.timeline import goal_poses
from casadi_hands.problem.hand import Hand

if TYPE_CHECKING:
    from casadi_hands.problem.result import Result
    from casadi_hands.task import Task


@dataclass(frozen=True)
class Label:
    """A name beside something drawn.

    Attributes:
        path: of what it names in meshcat's tree, names from the root.
        text: the name.
        color: RGB in 0..1, as what it names is drawn.
    """

    path: tuple[str, ...]
    text: str
    color: Color

    def as_data(self) -> dict[str, Any]:
        """What the page's script reads."""
        shades = ", ".join(str(round(255 * part)) for part in self.color)
        return {"path": list(self.path), "text": self.text, "color": f"rgb({shades})"}


def steps(node: Any) -> tuple[str, ...]:
    """Where a node of meshcat's visualizer is, names from the root."""
    return tuple(part for part in node.path.lower().split("/") if part)


def distinct_goals(poses: np.ndarray, tolerance: float) -> list[list[int]]:
    """Numbers of the goals at each different pose, in order.

    Args:
        poses: (G, 4, 4) of the object.
        tolerance: of equal poses, in the poses' unit.
    """
    groups: list[list[int]] = []
    for number, pose in enumerate(poses):
        same = (group for group in groups if np.allclose(pose, poses[group[0]], atol=tolerance))
        group = next(same, None)
        if group is None:
            groups.append([number])
        else:
            group.append(number)
    return groups


def goal_labels(node: Any, task: Task, color: Color) -> Iterator[Label]:
    """Names of the goals that `casadi_hands.export.page.scene` draws below a node: ``start``, or when they are."""
    size = task.object.characteristic_length
    alone = [[number] for number in range(len(task.motion))]
    groups = alone if task.tool is not None else distinct_goals(goal_poses(task), 1e-6 * size)
    for group in groups:
        words = ", ".join("start" if number == 0 else f"{task.motion[number].at:g} s" for number in group)
        yield Label(steps(node[f"goal {group[0] + 1}"]), words, color)


def bare_palm(design: Result) -> Hand:
    """The task's palm as a hand without fingers, for which limits and density mean nothing."""
    palm = design.task.palm
    return Hand(palm.radius, palm.thickness, (), 0.0, 0.0, 0.0, 0.0, design.task.hand.density)
