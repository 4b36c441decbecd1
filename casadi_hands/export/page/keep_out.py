"""Boxes of the world that the palm keeps off, drawn so that one sees through them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from meshcat.geometry import Box, MeshLambertMaterial

from casadi_hands.export.page.names import node_name

if TYPE_CHECKING:
    from casadi_hands.task import Task

_COLOR, _OPACITY = 0xB04A3A, 0.25


def draw_keep_out(node: Any, task: Task) -> None:
    """Draw the boxes of a task below a node of the world."""
    for number, each in enumerate(task.keep_out):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = each.box.rotation.matrix, each.box.center
        drawn = node[node_name(each.name or f"box {number + 1}")]
        drawn.set_object(
            Box(list(each.box.size)), MeshLambertMaterial(color=_COLOR, opacity=_OPACITY, transparent=True)
        )
        drawn.set_transform(pose)
