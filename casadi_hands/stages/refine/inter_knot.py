"""Whether fingers pass through each other between knots, where a motion's constraints do not see them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from casadi_hands.nlp.derivatives import kernel_functions
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.structure import Inner, Structure
from casadi_hands.stages.refine.finger_kernels import fingers_apart

DEEP = 0.5  # of a link's radius: less is no passing through, and may be due to the angles' being linear


def pass_through(structure: Structure, hand: WholeHand, times: Inner) -> bool:
    """Whether any two fingers that are clear at two knots overlap deeply between them.

    Joint angles are linear from knot to knot.

    Args:
        structure: of the fingers; its knots are those of the motion.
        hand: the motion.
        times: between knots, that are looked at.
    """
    model = structure.model
    weights = np.vstack([np.eye(times.count), times.weights()])
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
            deep = np.asarray(clear).min(axis=0) < -DEEP * model.link_radius
            at_knot, between = deep[: times.count], deep[times.count :]
            if np.any(between & ~at_knot[times.interval] & ~at_knot[times.interval + 1]):
                return True
    return False


def _columns(shape: NDArray[np.float64], angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """A finger's base, lengths, axis coordinates and joint angles, one column a time."""
    return np.vstack([np.tile(shape[:, None], len(angles)), angles.T])
