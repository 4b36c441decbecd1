"""Exponential map and quaternions against SciPy, angular motion against a body that spins in closed form."""

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.motion import (
    angle_squared,
    angular_motion,
    conjugate,
    exponential,
    multiply,
    nearest_exponential,
    rotation_matrix,
)


def wxyz(rotation: Rotation) -> np.ndarray:
    return rotation.as_quat(scalar_first=True)


def numbers(value: ca.DM) -> np.ndarray:
    return np.asarray(value).squeeze()


@pytest.mark.parametrize("degrees", [0, 1e-6, 1, 90, 179.9999, 180, 181, 250, 300])
def test_exponential_agrees_with_scipy(degrees: float, rng: np.random.Generator) -> None:
    for _ in range(5):
        axis = rng.normal(size=3)
        vector = np.radians(degrees) * axis / np.linalg.norm(axis)
        quaternion = numbers(exponential(ca.DM(vector)))
        assert np.linalg.norm(quaternion) == pytest.approx(1, abs=1e-11)
        # SciPy's is of either sign; the half angle tells which.
        expected = wxyz(Rotation.from_rotvec(vector))
        sign = np.sign(expected[0] * np.cos(np.radians(degrees) / 2)) or 1.0
        if abs(expected[0]) < 1e-5:
            sign = np.sign(expected @ quaternion)
        np.testing.assert_allclose(quaternion, sign * expected, atol=1e-11)


def test_exponential_has_exact_derivatives_at_zero() -> None:
    x = ca.SX.sym("x", 3)
    q = exponential(x)
    jacobian = ca.jacobian(q, x)
    at_zero = ca.Function("f", [x], [jacobian, ca.jacobian(jacobian[0, :].T, x)])(np.zeros(3))
    np.testing.assert_allclose(at_zero[0], np.vstack([np.zeros(3), np.eye(3) / 2]), atol=1e-15)
    np.testing.assert_allclose(at_zero[1], -np.eye(3) / 4, atol=1e-15)  # cos(|x| / 2)


def test_products_inverses_and_matrices_agree_with_scipy(rng: np.random.Generator) -> None:
    a, b = Rotation.random(rng=rng), Rotation.random(rng=rng)
    qa, qb = ca.DM(wxyz(a)), ca.DM(wxyz(b))
    np.testing.assert_allclose(numbers(rotation_matrix(multiply(qa, qb))), (a * b).as_matrix(), atol=1e-14)
    np.testing.assert_allclose(numbers(rotation_matrix(conjugate(qa))), a.inv().as_matrix(), atol=1e-14)


@pytest.mark.parametrize("degrees", [0, 0.5, 3, 60, 180])
def test_angle_is_the_chord_of_the_half_angle(degrees: float, rng: np.random.Generator) -> None:
    a = Rotation.random(rng=rng)
    b = a * Rotation.from_rotvec([0, 0, degrees], degrees=True)
    found = float(angle_squared(ca.DM(wxyz(a)), ca.DM(wxyz(b))))
    assert found == pytest.approx(4 * np.sin(np.radians(degrees) / 2) ** 2, abs=1e-13)
    if degrees < 5:
        assert found == pytest.approx(np.radians(degrees) ** 2, rel=1e-3)


def test_angular_motion_of_a_spinning_body_in_closed_form(rng: np.random.Generator) -> None:
    # Turned about a fixed axis n by phi(t): velocity n phi', acceleration n phi'', the same in world and body.
    axis, start = np.array([2, -1, 2]) / 3, Rotation.random(rng=rng)
    phi = np.polynomial.Polynomial([0.3, 1.1, -0.7, 0.4])
    t, h = 0.6, 1e-3
    quaternions = [ca.DM(wxyz(Rotation.from_rotvec(axis * phi(t + k * h)) * start)) for k in (-1, 0, 1)]
    signs = [np.sign(float(ca.dot(q, quaternions[1]))) for q in quaternions]
    velocity, acceleration = angular_motion(*[s * q for s, q in zip(signs, quaternions, strict=True)], h)
    in_body = start.inv().apply(axis)
    np.testing.assert_allclose(numbers(velocity), phi.deriv()(t) * in_body, atol=1e-5)
    np.testing.assert_allclose(numbers(acceleration), phi.deriv(2)(t) * in_body, atol=1e-5)


def test_angular_motion_of_a_body_that_precesses_in_closed_form() -> None:
    # R = Rz(w t) Rx(v t): body velocity is v x + w Rx(-vt) z, which turns; its derivative is the acceleration.
    w, v, t, h = 0.8, 1.7, 0.9, 1e-4
    turns = [Rotation.from_rotvec([0, 0, w * s]) * Rotation.from_rotvec([v * s, 0, 0]) for s in (t - h, t, t + h)]
    quaternions = [wxyz(turn) for turn in turns]
    quaternions = [q * np.sign(q @ quaternions[1]) for q in quaternions]
    velocity, acceleration = angular_motion(*map(ca.DM, quaternions), h)
    np.testing.assert_allclose(numbers(velocity), [v, w * np.sin(v * t), w * np.cos(v * t)], atol=1e-6)
    expected = [0, w * v * np.cos(v * t), -w * v * np.sin(v * t)]
    np.testing.assert_allclose(numbers(acceleration), expected, atol=1e-6)


@pytest.mark.parametrize("expected", [[0, 0, 3.0], [0, 0, -3.0], [0, 0, 4.5], [0, 0, -5.2], [0, 0, 7.0], [0, 0, 0.1]])
def test_nearest_exponential_continues_a_motion(expected: list[float]) -> None:
    nearby = np.array(expected) + np.array([0, 0, 0.2])
    found = nearest_exponential(Rotation.from_rotvec(nearby).as_matrix(), np.array(expected))
    np.testing.assert_allclose(found, nearby, atol=1e-9)


def test_nearest_exponential_of_no_turn_is_whole_turns() -> None:
    np.testing.assert_allclose(nearest_exponential(np.eye(3), np.array([0, 6.0, 0])), [0, 2 * np.pi, 0], atol=1e-12)
    np.testing.assert_allclose(nearest_exponential(np.eye(3), np.zeros(3)), 0, atol=1e-12)
    # A whole turn about z from numbers with four digits, which leave a turn of rounding about some other axis.
    rounded = Rotation.from_rotvec([5e-5, 0, 2 * np.pi]).as_matrix()
    np.testing.assert_allclose(nearest_exponential(rounded, np.array([0, 0, 4.7])), [0, 0, 2 * np.pi], atol=1e-4)
