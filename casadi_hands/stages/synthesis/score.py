"""How well a finger serves its contact: what Algorithm 1 compares with its threshold.

The thesis adds eeTarget and jacNull of the forces that the floating stage happened to choose. Squeezing forces
are free, though: a hand may press along directions its joints command. So the null-space share is measured on
the forces that serve this hand best - of all friction-feasible ones that make the needed wrench, those that
leave the least to be borne by the structure. A finger that can hold its share scores near zero, one that cannot scores
its share of the weight: the margin is wide.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from casadi_hands.kinematics.numeric import contact_kinematics
from casadi_hands.kinematics.singularity import passes_singularity
from casadi_hands.stages.synthesis.stage import Synthesised
from casadi_hands.stages.synthesis.target import Target
from casadi_hands.statics.grasp import friction_edges, grasp_map
from casadi_hands.statics.joints import structural_projector
from casadi_hands.statics.programmes import nonnegative_fit
from casadi_hands.terms.finger import NULL_SPACE_DAMPING

Array = NDArray[np.float64]
THRESHOLD = 0.12  # default; see scripts/score_margin.py for how far structures lie from it
TIP_WEIGHT = 50.0  # of Table 2.3's last step
_BALANCE = 1e3  # weight of the wrench's balance against structural forces
_STAY = 0.005  # weight of staying with the planned forces, which bounds the squeeze


def finger_scores(target: Target, hand: Synthesised) -> Array:
    """Score (F,) of each finger: 50·(tip distance in lengths)² plus structural force in m·g, keyframe means."""
    placed = [
        contact_kinematics(finger, target.string_of(contact), target.radii(finger.joints))
        for finger, contact in zip(hand.fingers, hand.contacts, strict=True)
    ]
    scores = np.zeros(len(placed))
    for i, contact in enumerate(hand.contacts):
        active = target.active[:, contact]
        misses = ((placed[i][0] - target.points[:, contact]) ** 2).sum(axis=1)
        scores[i] += TIP_WEIGHT * float(misses[active].mean()) if active.any() else 0.0
    structural = np.zeros((len(target.times), len(placed)))
    for k in range(len(target.times)):
        structural[k] = _structural_forces(target, hand.contacts, k, [jacobians[k] for _, jacobians in placed])
    for i, contact in enumerate(hand.contacts):
        active = target.active[:, contact]
        scores[i] += float(structural[active, i].mean()) if active.any() else 0.0
    return scores


def singular_fingers(target: Target, hand: Synthesised) -> int:
    """How many fingers pass a singular pose while they touch: those may well have no exact motion."""
    count = 0
    for finger, contact in zip(hand.fingers, hand.contacts, strict=True):
        _, jacobians = contact_kinematics(finger, target.string_of(contact), target.radii(finger.joints))
        count += passes_singularity(jacobians, target.active[:, contact])
    return count


def worst_miss(target: Target, hand: Synthesised, contact: int) -> tuple[float, float]:
    """How far (lengths) and when (s) a finger is farthest from its contact while that acts."""
    finger = hand.fingers[hand.contacts.index(contact)]
    points, _ = contact_kinematics(finger, target.string_of(contact), target.radii(finger.joints))
    misses = np.where(target.active[:, contact], np.linalg.norm(points - target.points[:, contact], axis=1), 0.0)
    k = int(misses.argmax())
    return float(misses[k]), float(target.times[k])


def _structural_forces(target: Target, contacts: Sequence[int], k: int, jacobians: Sequence[Array]) -> Array:
    """Passive force (F,) of each finger at a keyframe, with forces shared out so that it is least."""
    active = [i for i, contact in enumerate(contacts) if target.active[k, contact]]
    structural = np.zeros(len(contacts))
    if not active:
        return structural
    chosen = [contacts[i] for i in active]
    edges = friction_edges(target.normals[k, chosen], np.full(len(chosen), target.model.friction))
    count = edges.shape[1] // len(chosen)
    spread = np.zeros((3 * len(chosen), edges.shape[1]))
    for j in range(len(chosen)):
        spread[3 * j : 3 * j + 3, j * count : (j + 1) * count] = edges[:, j * count : (j + 1) * count]
    projectors = np.zeros((3 * len(chosen),) * 2)
    for j, i in enumerate(active):
        projectors[3 * j : 3 * j + 3, 3 * j : 3 * j + 3] = structural_projector(jacobians[i], NULL_SPACE_DAMPING)
    grasp = grasp_map(target.points[k, chosen] - target.centers[k])
    planned = target.forces[k, chosen].reshape(-1)
    matrix = np.vstack([np.sqrt(_BALANCE) * grasp @ spread, projectors @ spread, np.sqrt(_STAY) * spread])
    wanted = np.concatenate([np.sqrt(_BALANCE) * grasp @ planned, np.zeros(len(planned)), np.sqrt(_STAY) * planned])
    forces = spread @ nonnegative_fit(matrix, wanted)[0]
    structural[active] = np.linalg.norm((projectors @ forces).reshape(-1, 3), axis=1)
    return structural
