"""Where a design's bodies are at any time of its motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from casadi_hands.export.page.robot import Robot
from casadi_hands.export.page.timeline import design_timeline
from casadi_hands.problem.result import Result

OBJECT = "object"


@dataclass(frozen=True)
class Animation:
    """Poses of bodies over time.

    Attributes:
        names: of the hand's links, and `OBJECT`.
        time: (S,) s.
        poses: (S, B, 4, 4) world <- body.
    """

    names: tuple[str, ...]
    time: np.ndarray
    poses: np.ndarray

    @property
    def end(self) -> float:
        """When the motion ends, s."""
        return float(self.time[-1])

    def at(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Positions (B, 3), m, and orientations (B, 4), [w, x, y, z], at a time, s, as straight as can be."""
        if len(self.time) == 1:
            pose = self.poses[0]
            return pose[:, :3, 3], Rotation.from_matrix(pose[:, :3, :3]).as_quat(scalar_first=True)
        time = float(np.clip(time, self.time[0], self.time[-1]))
        first = int(np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.time) - 2))
        share = (time - self.time[first]) / (self.time[first + 1] - self.time[first])
        before, after = self.poses[first], self.poses[first + 1]
        positions = (1 - share) * before[:, :3, 3] + share * after[:, :3, 3]
        turns = []
        for one, other in zip(before[:, :3, :3], after[:, :3, :3], strict=True):
            turns.append(Slerp([0.0, 1.0], Rotation.from_matrix([one, other]))(share).as_quat(scalar_first=True))
        return positions, np.array(turns)


def animation_of(design: Result, hand: Robot) -> Animation:
    """The motion of a design, or where it starts if it has none.

    Args:
        design: whole or partial.
        hand: its exported hand.
    """
    timeline = design_timeline(design, hand)
    names = (*timeline.links, OBJECT)
    bodies = [*(timeline.palm @ pose for pose in timeline.links.values()), timeline.object]
    return Animation(names, timeline.time, np.stack(np.broadcast_arrays(*bodies), axis=1))
