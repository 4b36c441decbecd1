"""A finger as a Pinocchio model, and its kinematics as CasADi functions."""

from casadi_hands.kinematics.finger import STAND, finger_kinematics

__all__ = ["STAND", "finger_kinematics"]
