"""Shapes of the method: projection, normal, distance; one code for CasADi numbers (DM) and symbols (SX), or NumPy."""

from casadi_hands.geometry.capsule import closest_on_segment, nearest_on_axis, project_to_capsule
from casadi_hands.geometry.disc import point_disc_distance
from casadi_hands.geometry.segments import segment_distance
from casadi_hands.geometry.smooth import clamp, norm, penalty_spline, soft_exponential

__all__ = [
    "clamp",
    "closest_on_segment",
    "nearest_on_axis",
    "norm",
    "penalty_spline",
    "point_disc_distance",
    "project_to_capsule",
    "segment_distance",
    "soft_exponential",
]
