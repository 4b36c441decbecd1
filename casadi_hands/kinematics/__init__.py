"""A finger as a Pinocchio model, and its kinematics as CasADi functions."""

from casadi_hands.kinematics.finger import STAND, finger_kinematics, link_radii

__all__ = ["STAND", "finger_kinematics", "link_radii"]
