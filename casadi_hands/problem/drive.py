"""Motors that share the joints of a hand, in SI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Drive:
    """How N motors turn J joints through a spring at each joint.

    A joint's command, where its spring is at rest, is its offset and the motors' positions times its ratios. Every
    motor has a joint that it alone turns, one to one.

    Attributes:
        ratios: (J, N) of each joint to each motor; 0 where the motor does not turn it.
        offsets: (J,) rad, the commands with all motors at zero.
        effort: torque limit of every motor, N·m.
        velocity: speed limit of every motor, rad/s.
    """

    ratios: tuple[tuple[float, ...], ...]
    offsets: tuple[float, ...]
    effort: float
    velocity: float

    @property
    def motors(self) -> int:
        """Their number."""
        return len(self.ratios[0])

    @property
    def names(self) -> tuple[str, ...]:
        """Of the motors: ``motor0``, ``motor1`` and so on."""
        return tuple(f"motor{m}" for m in range(self.motors))

    def commands(self, positions: Array) -> Array:
        """(S, J) rad, of positions (S, N) of the motors."""
        return np.asarray(np.array(self.offsets) + positions @ np.array(self.ratios).T)

    def leader(self, joint: int) -> tuple[int, float, float] | None:
        """The joint that another follows, with which multiplier and offset (rad), by their commands.

        Args:
            joint: index of the one that follows.

        Returns:
            None where several motors turn it, or where no joint leads but itself.
        """
        ratios = np.array(self.ratios)
        turned = np.flatnonzero(ratios[joint])
        if len(turned) > 1:
            return None
        motor = int(turned[0]) if len(turned) else 0
        alone = (ratios[:, motor] != 0) & (np.count_nonzero(ratios, axis=1) == 1)
        first = int(np.flatnonzero(alone)[0])
        if first == joint:
            return None
        multiplier = float(ratios[joint, motor] / ratios[first, motor])
        return first, multiplier, self.offsets[joint] - multiplier * self.offsets[first]
