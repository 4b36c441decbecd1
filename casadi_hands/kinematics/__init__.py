"""A finger as a Pinocchio model, and its kinematics as CasADi functions."""

from casadi_hands.kinematics.finger import finger_kinematics

__all__ = ["finger_kinematics"]
