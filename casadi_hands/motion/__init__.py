"""From keyframes to samples: splines, rotations, finite differences."""

from casadi_hands.motion.derivative import derivative
from casadi_hands.motion.rotation import (
    angle_squared,
    angular_motion,
    conjugate,
    continuous,
    exponential,
    multiply,
    nearest_exponential,
    rotation_matrix,
)
from casadi_hands.motion.schedule import Schedule
from casadi_hands.motion.spline import catmull_rom, linear, time_scaled, zero_order_hold

__all__ = [
    "Schedule",
    "angle_squared",
    "angular_motion",
    "catmull_rom",
    "conjugate",
    "continuous",
    "derivative",
    "exponential",
    "linear",
    "multiply",
    "nearest_exponential",
    "rotation_matrix",
    "time_scaled",
    "zero_order_hold",
]
