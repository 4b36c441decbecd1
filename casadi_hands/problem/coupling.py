"""Joints that share motors: the commands q + τ / k of all joints on as many lines as there are motors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_SWAPS = 50  # of leaders, at most, until no joint goes farther than that which leads it
_FARTHER = 1.01  # times what a joint's leader goes, beyond which it leads instead


@dataclass(frozen=True)
class Coupling:
    """How N motors turn J joints: commands = offsets + positions · ratiosᵀ.

    Each motor has a joint of its own, its leader, which no other motor turns and which it turns one to one.

    Attributes:
        ratios: (J, N) of each joint to each motor; 0 where the motor does not turn it.
        offsets: (J,) rad, commands with all motors at zero.
        positions: (S, N) of the motors, rad; zero at the first sample.
        leaders: index of each motor's own joint.
    """

    ratios: Array
    offsets: Array
    positions: Array
    leaders: tuple[int, ...]

    @property
    def motors(self) -> int:
        """Their number."""
        return int(self.ratios.shape[1])

    @property
    def commands(self) -> Array:
        """(S, J) rad."""
        return np.asarray(self.offsets + self.positions @ self.ratios.T)


def fit_coupling(commands: Array, motors: int, weights: Array) -> Coupling:
    """The lines nearest to commands: their weighted principal components, seen from N of the joints.

    Args:
        commands: (S, J) rad.
        motors: N, at most J.
        weights: (J,) of each joint's error.

    Returns:
        The coupling. No ratio is much larger than 1: the leaders are joints whose rows span most.
    """
    middle = commands.mean(axis=0)
    # Of fewer samples than joints all directions are asked for, so that there are as many lines as motors.
    few = len(commands) < commands.shape[1]
    _, _, rows = np.linalg.svd((commands - middle) * weights, full_matrices=few)
    lines = rows[:motors].T / weights[:, None]
    leaders = _leaders(lines)
    ratios = lines @ np.linalg.inv(lines[leaders])
    spread = ratios * weights[:, None]
    along = (commands - middle) * weights @ spread @ np.linalg.inv(spread.T @ spread)
    offsets = middle + ratios @ along[0]
    ratios[leaders] = np.eye(motors)
    return Coupling(ratios, offsets, along - along[0], tuple(leaders))


def _leaders(lines: Array) -> list[int]:
    """Rows of (J, N) by which all others are combined with factors of hardly more than 1 (a maximal volume)."""
    left, leaders = lines.copy(), []
    for _ in range(lines.shape[1]):
        sizes = np.linalg.norm(left, axis=1)
        leaders.append(int(np.argmax(sizes)))
        way = left[leaders[-1]] / max(sizes[leaders[-1]], 1e-300)
        left = left - np.outer(left @ way, way)
    for _ in range(_SWAPS):
        factors = np.abs(lines @ np.linalg.inv(lines[leaders]))
        j, m = np.unravel_index(np.argmax(factors), factors.shape)
        if factors[j, m] <= _FARTHER:
            break
        leaders[int(m)] = int(j)
    return leaders
