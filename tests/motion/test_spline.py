"""Interpolation weights against SciPy's Hermite splines and finite differences."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from casadi_hands.motion import catmull_rom, held, linear

KNOTS = np.array([0.0, 0.5, 1.2, 2.0, 2.1, 3.0])
VALUES = np.random.default_rng(0).normal(size=(6, 2))


def tangents() -> np.ndarray:
    """Slope between the neighbours; none at the mirrored ends."""
    slopes = np.zeros_like(VALUES)
    slopes[1:-1] = (VALUES[2:] - VALUES[:-2]) / (KNOTS[2:] - KNOTS[:-2])[:, None]
    return slopes


def test_catmull_rom_is_the_hermite_spline_with_those_tangents() -> None:
    times = np.linspace(0, 3, 101)
    expected = CubicHermiteSpline(KNOTS, VALUES, tangents())(times)
    np.testing.assert_allclose(catmull_rom(KNOTS, times) @ VALUES, expected, atol=1e-12)


def test_catmull_rom_passes_through_keyframes_and_keeps_constants() -> None:
    np.testing.assert_allclose(catmull_rom(KNOTS, KNOTS), np.eye(6), atol=1e-15)
    np.testing.assert_allclose(catmull_rom(KNOTS, np.linspace(-0.1, 3.1, 50)).sum(axis=1), 1, atol=1e-14)


@pytest.mark.parametrize("end", [0.0, 3.0])
def test_catmull_rom_is_at_rest_and_mirrored_at_its_ends(end: float) -> None:
    h = 1e-4
    before, after = catmull_rom(KNOTS, [end - h, end + h]) @ VALUES
    np.testing.assert_allclose(before, after, atol=1e-15)
    # At rest: from the end the motion leaves quadratically.
    moved = np.abs(catmull_rom(KNOTS, [end + h]) @ VALUES - catmull_rom(KNOTS, [end]) @ VALUES).max()
    assert 0 < moved < 100 * h**2


def test_linear_against_numpy_and_constant_beyond_its_ends() -> None:
    times = np.linspace(-1, 4, 77)
    expected = np.column_stack([np.interp(times, KNOTS, column) for column in VALUES.T])
    np.testing.assert_allclose(linear(KNOTS, times) @ VALUES, expected, atol=1e-12)


def test_held_changes_at_its_knot() -> None:
    times = [-1, 0, 0.49999, 0.5, 1.19, 2.0 - 1e-12, 2.05, 3.0, 9.0]
    assert held(KNOTS, times).tolist() == [0, 0, 0, 1, 1, 3, 3, 5, 5]
