"""Motors that share joints, as ``result.json`` states them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from casadi_hands.errors import DesignError
from casadi_hands.verify.reading.stored import as_array, entry


@dataclass(frozen=True)
class Drive:
    """How motors turn joints.

    Attributes:
        ratios: (J, N).
        offsets: (J,) rad.
        effort: torque limit of every motor, N·m.
        velocity: speed limit of every motor, rad/s.
    """

    ratios: np.ndarray
    offsets: np.ndarray
    effort: float
    velocity: float

    @property
    def names(self) -> list[str]:
        """``motor0``, ``motor1``, …, as in ``scene.xml``."""
        return [f"motor{m}" for m in range(self.ratios.shape[1])]


def read_drive(path: Path, record: dict[str, Any], joints: int, motors: int | None) -> Drive | None:
    """Return the drive of a record; None where every joint has a motor of its own.

    Args:
        path: of ``result.json``.
        record: it.
        joints: of the hand.
        motors: columns of the motion's ``motor_positions``; None where it has none.

    Raises:
        DesignError: it is stated by halves, of no motors, or not in numbers of these sizes.
    """
    hand = record.get("hand")
    stated = [name for name in ("ratios", "offsets") if entry(hand, name) is not None]
    if not stated and motors is None:
        return None
    if len(stated) < 2 or motors is None:
        raise DesignError(
            f"{path}: motors that share joints need hand.ratios, hand.offsets and motor_positions, all three"
        )
    if motors == 0:
        raise DesignError(f"{path}: motors that share joints are none: motor_positions has no column")
    ratios, offsets = as_array(entry(hand, "ratios"), (joints, motors)), as_array(entry(hand, "offsets"), (joints,))
    effort, velocity = (as_array(entry(hand, f"motor_{name}"), ()) for name in ("effort", "velocity"))
    if ratios is None or offsets is None:
        raise DesignError(f"{path}: hand.ratios is not {joints} × {motors} numbers, or hand.offsets not {joints}")
    if effort is None or velocity is None or not (effort > 0 and velocity > 0):
        raise DesignError(f"{path}: hand.motor_effort and hand.motor_velocity are not two numbers above zero")
    return Drive(ratios, offsets, float(effort), float(velocity))
