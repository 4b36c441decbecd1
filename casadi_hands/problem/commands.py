"""What joints of a motion are told, nondimensional, and how few motors nearly tell them so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from casadi_hands.problem.coupling import fit_coupling
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.placement import contact_jacobians, joint_torques

Array = NDArray[np.float64]
_LEVER = 0.2  # lengths, the least with which a joint counts: a turn without a lever still turns the fingertip


def joint_commands(model: Model, motion: WholeHand) -> Array:
    """(S, J) rad, q + τ / k: where joints' springs are at rest as they press as planned."""
    return np.hstack(motion.angles) + joint_torques(model, motion) / model.stiffness


def coupled(model: Model, motion: WholeHand, motors: int) -> WholeHand:
    """The motion with the coupling that is nearest to its commands, joints weighted by their levers.

    Args:
        model: the task.
        motion: whose commands are on no lines yet.
        motors: their number.
    """
    levers = [np.linalg.norm(contact_jacobians(model, motion, i), axis=1) for i in range(len(motion.fingers))]
    weights = np.maximum(np.sqrt(np.mean(np.hstack(levers) ** 2, axis=0)), _LEVER)
    return replace(motion, coupling=fit_coupling(joint_commands(model, motion), motors, weights))
