"""Random starts of fingers (section 2.2.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from casadi_hands.kinematics import STAND
from casadi_hands.kinematics.morphology import FingerSeed, frame_about
from casadi_hands.stages.synthesis.target import Target

Array = NDArray[np.float64]
SEED_BEND = np.pi / 4  # rad, largest of a seed's link
TRIES = 50  # to draw an axis that a hinge can have


def random_finger(target: Target, contact: int, joints: int, rng: np.random.Generator) -> FingerSeed:
    """Draw base, lengths, axes, angles and tip points of a finger; one pose serves for all keyframes.

    Lengths are drawn about what it takes to span from the base to the contact.
    """
    low, high = target.joint_limits
    radius, longest = target.radii(joints)[0], target.link_length[1]
    direction, distance = rng.uniform(0, 2 * np.pi), np.sqrt(rng.uniform())
    base = (target.palm_radius - radius) * distance * np.array([np.cos(direction), np.sin(direction)])
    span = np.linalg.norm(target.points[:, contact].mean(axis=0) - np.append(base, STAND * radius))
    lengths = np.clip(rng.uniform(0.8, 1.6, joints) * span / joints, target.least_lengths(joints), longest)
    angles = rng.uniform(0.6 * low, 0.6 * high, joints)
    tip = target.tip_arc * rng.uniform(-0.7, 0.7, (target.strings(contact), 2))
    # No axis stands nearer than by half the bend to both links beside it.
    most = min(target.model.bend, SEED_BEND, 2 * np.arccos(target.model.axis_cosines[0]))
    bends = _random_bends(joints, most, rng)
    links = [_links_beside(bend)[: 1 if j == 0 else 2] for j, bend in enumerate(bends)]
    return FingerSeed(
        base=base,
        lengths=lengths,
        frames=np.array([frame_about(_hinge_axis(beside, target.model.axis_cosines, rng)) for beside in links]),
        axes=np.zeros((joints, 2)),
        bends=bends,
        angles=np.tile(angles, (len(target.times), 1)),
        tips=tip,
    )


def _random_bends(joints: int, most: float, rng: np.random.Generator) -> Array:
    """Bends (n, 2), uniform over a disc; none are drawn where links are straight."""
    if not most:
        return np.zeros((joints, 2))
    way, size = rng.uniform(0, 2 * np.pi, joints), most * np.sqrt(rng.uniform(size=joints))
    return np.column_stack([size * np.cos(way), size * np.sin(way)])


def _links_beside(bend: Array) -> Array:
    """Directions (2, 3) of a link bent by (2,) and of the one before, in its frame."""
    along = np.array([0.0, 0.0, 1.0])
    return np.array([along, Rotation.from_rotvec([*bend, 0.0]).inv().apply(along)])


def _hinge_axis(links: Array, cosines: tuple[float, float], rng: np.random.Generator) -> Array:
    """An axis (3,) uniform over those with allowed cosines to links (K, 3); if these are few, one amid them."""
    for _ in range(TRIES):
        axis = _random_axis(rng)
        size = np.abs(links @ axis)
        if np.all((cosines[0] <= size) & (size <= cosines[1])):
            return axis
    return _axis_amid(links, cosines, axis)


def _axis_amid(links: Array, cosines: tuple[float, float], axis: Array) -> Array:
    """The axis (3,) at one allowed angle from links (K, 3) that are bent by no more than twice the largest.

    Where they are straight on from each other it is turned about them as ``axis`` (3,) is.
    """
    middle, across = links.sum(axis=0), np.cross(links[0], links[-1])
    middle /= np.linalg.norm(middle)
    if np.linalg.norm(across) < 1e-9:
        across = np.cross(middle, axis)
    across /= np.linalg.norm(across)
    largest, least = np.arccos(cosines)
    angle = (max(least, np.arccos(min(links[0] @ middle, 1.0))) + largest) / 2
    along = min(np.cos(angle) / (links[0] @ middle), 1.0)
    return np.asarray(along * middle + np.sqrt(1 - along**2) * across)


def _random_axis(rng: np.random.Generator) -> Array:
    """A unit vector, uniform over the sphere."""
    vector = rng.normal(size=3)
    return np.asarray(vector / np.linalg.norm(vector))
