"""Animation tracks: what moves on the page, with a key at every sample."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from meshcat.animation import Animation, AnimationClip, AnimationTrack

_HAIR = 1e-6  # relative size of what has shrunk to nothing; a scale of 0 has no normals


class Tracks:
    """An animation under construction.

    Args:
        time: (S,) s.
    """

    def __init__(self, time: np.ndarray) -> None:
        """Start with no tracks."""
        self.animation = Animation()
        self._time = [float(t) for t in time]

    def move(self, node: Any, poses: np.ndarray) -> None:
        """Let a node follow poses.

        Args:
            node: meshcat's visualizer at the node.
            poses: (S, 4, 4) in the parent node's frame.
        """
        self._add(node, "position", "vector3", poses[:, :3, 3])
        self._add(node, "quaternion", "quaternion", np.array([quaternion(pose[:3, :3]) for pose in poses]))

    def arrow(self, node: Any, head_length: float, tips: np.ndarray, vectors: np.ndarray, shown: np.ndarray) -> None:
        """Let an arrow that `casadi_hands.export.page.scene` drew follow its vector.

        Args:
            node: meshcat's visualizer at the arrow.
            head_length: of the arrow's full-size head, in the units of `tips`.
            tips: (S, 3) where its point is, in the parent node's frame.
            vectors: (S, 3) direction and length.
            shown: (S,) bool.
        """
        lengths = np.linalg.norm(vectors, axis=1)
        directions = _carried(vectors / np.maximum(lengths, 1e-300)[:, None], lengths > 0)
        head = np.maximum(np.minimum(1.0, lengths / (2 * head_length)), _HAIR)
        shaft = np.maximum(lengths - head * head_length, _HAIR * head_length)
        zero, one = np.zeros_like(head), np.ones_like(head)
        self._add(node, "position", "vector3", _carried(tips, shown))
        self._add(node, "quaternion", "quaternion", np.array([towards(direction) for direction in directions]))
        self._add(node, "visible", "bool", shown)
        self._add(node["head"], "scale", "vector3", np.stack([head, head, head], axis=1))
        self._add(node["shaft"], "scale", "vector3", np.stack([one, one, shaft], axis=1))
        self._add(node["shaft"], "position", "vector3", np.stack([zero, zero, -head * head_length], axis=1))

    def _add(self, node: Any, name: str, kind: str, values: np.ndarray) -> None:
        clip = self.animation.clips.setdefault(node.path, AnimationClip(fps=1))  # one frame a second: keys in s
        clip.tracks[name] = AnimationTrack(name, kind, self._time, values.tolist())


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """Quaternion (4,) in three.js's order [x, y, z, w] of a rotation matrix (3, 3)."""
    return np.array(pin.Quaternion(rotation).coeffs())


def towards(direction: np.ndarray) -> np.ndarray:
    """Quaternion [x, y, z, w] of the shortest turn that takes z to a direction (3,)."""
    return np.array(pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), direction).coeffs())


def along(direction: np.ndarray) -> np.ndarray:
    """Pose (4, 4) of the shortest turn that takes z to a direction (3,)."""
    pose = np.eye(4)
    x, y, z, w = towards(direction)
    pose[:3, :3] = pin.Quaternion(w, x, y, z).matrix()
    return pose


def _carried(values: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Rows (S, 3), each invalid one replaced by the valid one before it, else the first valid; z if there is none."""
    if not valid.any():
        return np.tile([0.0, 0.0, 1.0], (len(values), 1))
    last = np.maximum.accumulate(np.where(valid, np.arange(len(values)), -1))
    return values[np.where(last < 0, np.argmax(valid), last)]
