"""Interpolation weights against SciPy's Hermite splines and finite differences."""

import numpy as np
import pytest
from scipy.interpolate import BPoly, CubicHermiteSpline

from casadi_hands.motion import catmull_rom, linear, time_scaled, zero_order_hold

KNOTS = np.array([0.0, 0.5, 1.2, 2.0, 2.1, 3.0])


@pytest.fixture
def values(rng: np.random.Generator) -> np.ndarray:
    return rng.normal(size=(len(KNOTS), 2))


def tangents(values: np.ndarray) -> np.ndarray:
    """Slope between the neighbours; none at the mirrored ends."""
    slopes = np.zeros_like(values)
    slopes[1:-1] = (values[2:] - values[:-2]) / (KNOTS[2:] - KNOTS[:-2])[:, None]
    return slopes


def test_catmull_rom_is_the_hermite_spline_with_those_tangents(values: np.ndarray) -> None:
    times = np.linspace(0, 3, 101)
    expected = CubicHermiteSpline(KNOTS, values, tangents(values))(times)
    np.testing.assert_allclose(catmull_rom(KNOTS, times) @ values, expected, atol=1e-12)


def test_catmull_rom_passes_through_keyframes_and_keeps_constants() -> None:
    np.testing.assert_allclose(catmull_rom(KNOTS, KNOTS), np.eye(6), atol=1e-15)
    np.testing.assert_allclose(catmull_rom(KNOTS, np.linspace(-0.1, 3.1, 50)).sum(axis=1), 1, atol=1e-14)


@pytest.mark.parametrize("resting", [[2], [1, 4], np.array([0, 3, 5])])
def test_catmull_rom_rests_where_it_is_told_to(resting: list[int], values: np.ndarray) -> None:
    slopes = tangents(values)
    slopes[resting] = 0
    times = np.linspace(0, 3, 101)
    expected = CubicHermiteSpline(KNOTS, values, slopes)(times)
    np.testing.assert_allclose(catmull_rom(KNOTS, times, resting) @ values, expected, atol=1e-12)


@pytest.mark.parametrize("end", [0.0, 3.0])
def test_catmull_rom_is_at_rest_and_mirrored_at_its_ends(end: float, values: np.ndarray) -> None:
    h = 1e-4
    before, after = catmull_rom(KNOTS, [end - h, end + h]) @ values
    np.testing.assert_allclose(before, after, atol=1e-15)
    # At rest: from the end the motion leaves quadratically.
    moved = np.abs(catmull_rom(KNOTS, [end + h]) @ values - catmull_rom(KNOTS, [end]) @ values).max()
    assert 0 < moved < 100 * h**2


def test_linear_against_numpy_and_constant_beyond_its_ends(values: np.ndarray) -> None:
    times = np.linspace(-1, 4, 77)
    expected = np.column_stack([np.interp(times, KNOTS, column) for column in values.T])
    np.testing.assert_allclose(linear(KNOTS, times) @ values, expected, atol=1e-12)


def test_held_changes_at_its_knot() -> None:
    times = [-1, 0, 0.49999, 0.5, 1.19, 2.0 - 1e-12, 2.05, 3.0, 9.0]
    assert zero_order_hold(KNOTS, times).tolist() == [0, 0, 0, 1, 1, 3, 3, 5, 5]


def test_eased_time_is_the_quintic_that_rests_at_every_knot() -> None:
    times = np.linspace(0, 3, 301)
    expected = BPoly.from_derivatives(KNOTS, [[knot, 0, 0] for knot in KNOTS])(times)
    np.testing.assert_allclose(time_scaled(KNOTS, times), expected, atol=1e-12)


def test_eased_time_keeps_its_knots_and_never_turns_back() -> None:
    np.testing.assert_allclose(time_scaled(KNOTS, KNOTS), KNOTS, atol=1e-12)
    np.testing.assert_array_equal(time_scaled(KNOTS, [-1.0, 4.0]), [0.0, 3.0])
    assert (np.diff(time_scaled(KNOTS, np.linspace(0, 3, 2001))) >= 0).all()
    # Halfway it is on time, whatever the interval's length, and nearly twice as fast.
    middles = (KNOTS[1:] + KNOTS[:-1]) / 2
    np.testing.assert_allclose(time_scaled(KNOTS, middles), middles, atol=1e-12)
    h = 1e-5
    speeds = (time_scaled(KNOTS, middles + h) - time_scaled(KNOTS, middles - h)) / (2 * h)
    np.testing.assert_allclose(speeds, 15 / 8, rtol=1e-6)


@pytest.mark.parametrize("knot", KNOTS)
def test_what_follows_eased_time_rests_at_every_knot(knot: float, values: np.ndarray) -> None:
    h = 1e-3
    before, at, after = (linear(KNOTS, time_scaled(KNOTS, [knot + k * h])) @ values for k in (-1, 0, 1))
    # It leaves a knot by the third power of time: no speed, no acceleration.
    for moved in (after - at, at - before):
        assert np.abs(moved).max() < 10 * np.ptp(values) * (h / 0.1) ** 3
