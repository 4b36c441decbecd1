"""Poses in exponential coordinates."""

from __future__ import annotations

from casadi import SX

from casadi_hands.motion import exponential, multiply


def placed(pose: SX, reference: SX) -> tuple[SX, SX]:
    """Position (3,) and quaternion (4,) of a pose (6,): position and rotation vector from the reference."""
    return pose[:3], multiply(exponential(pose[3:]), reference)
