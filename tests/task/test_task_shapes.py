from itertools import pairwise

import coal
import numpy as np
import pytest
from scipy.integrate import dblquad

from casadi_hands.task import Capsule, Sphere


def revolved(capsule: Capsule) -> tuple[float, float, float]:
    """Volume, and unit inertia along and across the axis, by integrating over the profile."""
    half = np.linalg.norm(np.subtract(capsule.end, capsule.start)) / 2
    radius = capsule.radius

    def profile(z: float) -> float:
        beyond = max(abs(z) - half, 0.0)
        return float(np.sqrt(max(radius**2 - beyond**2, 0.0)))

    def over_solid(weight: object) -> float:
        # Rings of radius r at height z: 2 π r dr dz. Split where the profile has a kink.
        cuts = [-half - radius, -half, half, half + radius]
        pieces = pairwise(cuts)
        return sum(dblquad(weight, a, b, 0, profile, epsabs=1e-16, epsrel=1e-9)[0] for a, b in pieces)

    volume = over_solid(lambda r, z: 2 * np.pi * r)
    along = over_solid(lambda r, z: 2 * np.pi * r * r**2) / volume
    across = over_solid(lambda r, z: 2 * np.pi * r * (r**2 / 2 + z**2)) / volume
    return volume, along, across


def test_solid_of_a_capsule_agrees_with_quadrature() -> None:
    capsule = Capsule(start=(0.01, 0.02, -0.03), end=(0.03, -0.01, 0.02), radius=0.015)
    volume, along, across = revolved(capsule)
    assert capsule.volume == pytest.approx(volume, rel=1e-8)
    axis = np.subtract(capsule.end, capsule.start) / np.linalg.norm(np.subtract(capsule.end, capsule.start))
    assert axis @ capsule.unit_inertia @ axis == pytest.approx(along, rel=1e-8)
    assert np.linalg.eigvalsh(capsule.unit_inertia) == pytest.approx([along, across, across], rel=1e-8)


def test_solid_of_a_sphere() -> None:
    sphere = Sphere(center=(1, 2, 3), radius=0.5)
    assert sphere.volume == pytest.approx(np.pi / 6)
    assert sphere.unit_inertia == pytest.approx(0.1 * np.eye(3))
    same = Capsule(start=(1, 2, 3), end=(1, 2, 3), radius=0.5)
    assert same.volume == pytest.approx(sphere.volume)
    assert same.unit_inertia == pytest.approx(sphere.unit_inertia)


def test_signed_distance_agrees_with_coal(rng: np.random.Generator) -> None:
    start, end, radius = np.array([0, 0, -0.03]), np.array([0, 0, 0.05]), 0.02
    capsule = Capsule(start=tuple(start), end=tuple(end), radius=radius)
    body = coal.Capsule(radius, 0.08)
    placed = coal.Transform3s(np.eye(3), (start + end) / 2)
    for point in rng.uniform(-0.1, 0.1, (50, 3)):
        # Coal has no points; a small ball's distance is the point's less its radius.
        result = coal.DistanceResult()
        place = coal.Transform3s(np.eye(3), point)
        found = coal.distance(body, placed, coal.Sphere(1e-4), place, coal.DistanceRequest(), result)
        assert capsule.signed_distance(point) == pytest.approx(found + 1e-4, abs=1e-6)


def test_moved() -> None:
    assert Sphere(center=(1, 2, 3), radius=0.5).moved(np.array([1, 0, -1])).center == (2, 2, 2)
    moved = Capsule(start=(0, 0, 0), end=(0, 0, 1), radius=0.5).moved(np.array([1, 0, -1]))
    assert (moved.start, moved.end) == ((1, 0, -1), (1, 0, 0))
