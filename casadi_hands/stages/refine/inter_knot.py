"""Whether fingers pass through each other between knots, where a motion's constraints do not see them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from casadi_hands.nlp.derivatives import kernel_functions
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.structure import Structure
from casadi_hands.stages.refine.finger_kernels import fingers_apart

DEEP = 0.5  # of a link's radius: less is no passing through, and may be due to the angles' being linear


def pass_through(structure: Structure, hand: WholeHand) -> bool:
    """Whether any two fingers overlap deeply at the times between knots, with joint angles linear from knot to knot.

    Args:
        structure: of the fingers; its knots are those of the motion.
        hand: the motion.
    """
    weights, model = structure.close.weights(), structure.model
    if not len(weights):
        return False
    shapes = [np.concatenate([f.base, f.lengths, f.axes.reshape(-1), f.bends.reshape(-1)]) for f in hand.fingers]
    moving = [_columns(s, weights @ angles) for s, angles in zip(shapes, hand.angles, strict=True)]
    frames = [f.frames.transpose(0, 2, 1).reshape(-1) for f in hand.fingers]
    count, radii = len(weights), [model.link_radius, model.tip_radius]
    for i in range(len(hand.fingers)):
        for j in range(i):
            kernel = fingers_apart(structure.joints[i], structure.joints[j])
            (functions,) = kernel_functions([kernel])
            fixed = np.tile(np.concatenate([frames[i], frames[j], radii])[:, None], count)
            _, _, clear = functions.value.map(count)(np.vstack([moving[i], moving[j]]), fixed, np.zeros((0, count)))
            if np.asarray(clear).min() < -DEEP * model.link_radius:
                return True
    return False


def _columns(shape: NDArray[np.float64], angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """A finger's base, lengths, axis coordinates and joint angles, one column a time."""
    return np.vstack([np.tile(shape[:, None], len(angles)), angles.T])
