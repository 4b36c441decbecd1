"""Closed forms against sums over many small cells."""

import numpy as np
import pytest

from casadi_hands.problem.inertia import capsule_inertial, palm_inertial
from tests.export.example import example_hand


def summed(inside, lower, upper, density, cells=160):
    """Mass, centre of mass and inertia about it of a solid, summed over the cells of a grid in its bounding box."""
    axes = [low + (np.arange(cells) + 0.5) * (high - low) / cells for low, high in zip(lower, upper, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    points = points[inside(points)]
    mass = density * np.prod((np.array(upper) - lower) / cells)
    center = points.mean(axis=0)
    arms = points - center
    inertia = mass * ((arms**2).sum() * np.eye(3) - arms.T @ arms)
    return mass * len(points), center, inertia


def check(inertial, mass, center, inertia, size):
    assert inertial.mass == pytest.approx(mass, rel=2e-3)
    assert inertial.center == pytest.approx(center, abs=1e-3 * size)
    assert inertial.inertia == pytest.approx(inertia, rel=4e-3, abs=4e-3 * inertia.max())


def test_a_capsule_is_a_cylinder_and_two_half_spheres():
    length, radius = 0.05, 0.02

    def inside(points):
        nearest = np.clip(points[:, 2], 0, length)
        return points[:, 0] ** 2 + points[:, 1] ** 2 + (points[:, 2] - nearest) ** 2 < radius**2

    result = summed(inside, (-radius, -radius, -radius), (radius, radius, length + radius), 1150.0)
    check(capsule_inertial(length, radius, 1150.0), *result, length)


def test_the_palm_is_a_disc_below_its_surface():
    hand = example_hand()
    radius, thickness = hand.palm_radius, hand.palm_thickness

    def inside(points):
        return points[:, 0] ** 2 + points[:, 1] ** 2 < radius**2

    result = summed(inside, (-radius, -radius, -thickness), (radius, radius, 0.0), hand.density)
    check(palm_inertial(hand), *result, radius)
