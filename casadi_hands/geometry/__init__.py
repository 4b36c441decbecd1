"""Shapes of the method: bodies, distances, paths over surfaces; for CasADi's symbols, and for numbers where needed."""

from casadi_hands.geometry.disc import point_disc_distance
from casadi_hands.geometry.segments import segment_distance
from casadi_hands.geometry.smooth import clamp, norm, penalty_spline, soft_exponential

__all__ = ["clamp", "norm", "penalty_spline", "point_disc_distance", "segment_distance", "soft_exponential"]
