"""The finger's terms against SVD, the thesis's explicit matrices and finite differences."""

import casadi as ca
import numpy as np
import pytest

from casadi_hands.terms import finger


def evaluated(expression) -> np.ndarray:
    return np.asarray(ca.evalf(expression)).squeeze()


def sx(*arrays) -> list[ca.SX]:
    return [ca.SX(ca.DM(a)) for a in arrays]


@pytest.mark.parametrize("joints", [1, 2, 3, 4])
def test_null_space_is_the_svd_projection_in_the_limit_of_no_damping(joints: int, rng: np.random.Generator) -> None:
    jacobian, force = rng.normal(size=(3, joints)), rng.normal(size=3)
    left, singular, _ = np.linalg.svd(jacobian)
    free = left[:, int((singular > 1e-9).sum()) :]
    expected = free @ free.T @ force
    found = evaluated(finger.null_space_force(*sx(jacobian, force), damping=1e-5))
    np.testing.assert_allclose(found, expected, atol=1e-6)
    size = float(evaluated(finger.null_space(*sx(jacobian, force))))
    if joints < 3:
        assert size == pytest.approx(np.sqrt(expected @ expected + 1e-4), rel=5e-3)


def test_damping_counts_a_force_without_a_lever_as_unsupplied() -> None:
    # Singular values s are supplied to a share s² / (s² + λ²).
    jacobian = np.diag([1.0, 0.02, 0.002])
    found = evaluated(finger.null_space_force(*sx(jacobian, np.ones(3))))
    np.testing.assert_allclose(found, 0.02**2 / (np.array([1, 0.02, 0.002]) ** 2 + 0.02**2), rtol=1e-10)
    assert finger.NULL_SPACE_DAMPING == 0.02


@pytest.mark.parametrize("joints", [1, 2, 3])
def test_torques_are_those_of_eq_a5_with_its_matrix_written_out(joints: int, rng: np.random.Generator) -> None:
    # A.5: f = X α + rest with the columns of X the joints' directions over their levers, J_i / ‖J_i‖²; the damped
    # least-squares α is (XᵀX + λ²)⁻¹ Xᵀ f.
    # Far from singular: near it, rounding counts for more than the damping.
    jacobian, force = 2 * np.eye(3, joints) + 0.3 * rng.normal(size=(3, joints)), rng.normal(size=3)
    x = jacobian / (jacobian**2).sum(axis=0)
    expected = np.linalg.solve(x.T @ x + 1e-6 * np.eye(joints), x.T @ force)
    np.testing.assert_allclose(evaluated(finger.joint_torques(*sx(jacobian, force))), expected, rtol=1e-6, atol=1e-6)


def test_torques_of_orthogonal_joints_are_force_times_lever() -> None:
    jacobian, torque = np.diag([0.5, 2.0, 1.0]), np.array([0.3, -0.4, 0.1])
    force = torque / np.diag(jacobian)
    np.testing.assert_allclose(evaluated(finger.joint_torques(*sx(jacobian, force))), torque, atol=1e-5)


def test_terms_of_a_joint_without_lever_are_finite() -> None:
    jacobian = ca.SX.sym("J", 3, 2)
    force = ca.SX([0, 0.5, -1])
    out = ca.vertcat(finger.null_space(jacobian, force), finger.joint_torques(jacobian, force))
    derivative = ca.jacobian(out, ca.vec(jacobian))
    function = ca.Function("f", [jacobian], [out, derivative])
    for at in (np.zeros((3, 2)), np.ones((3, 2)), np.array([[0, 1.0], [0, 0], [0, 0]])):
        for found in function(at):
            assert np.isfinite(np.asarray(found)).all()


@pytest.mark.parametrize("size", [1, 2, 3, 5])
def test_positive_system(size: int, rng: np.random.Generator) -> None:
    a = rng.normal(size=(size, size))
    matrix, right = a @ a.T + 0.1 * np.eye(size), rng.normal(size=size)
    np.testing.assert_allclose(
        np.atleast_1d(evaluated(finger.solve_positive(*sx(matrix, right)))), np.linalg.solve(matrix, right), rtol=1e-8
    )


def test_beyond_limits_is_the_square_of_what_is_beyond() -> None:
    low, high = -np.pi / 2, np.pi / 2
    found = evaluated(finger.beyond_limits(*sx([-2, -1.5, 0, 1.5, 2.5], low, high)))
    np.testing.assert_allclose(found, [(2 + low) ** 2, 0, 0, 0, (2.5 - high) ** 2], atol=1e-6)


def test_off_palm_is_the_square_of_the_distance_from_the_disc() -> None:
    assert evaluated(finger.off_palm(*sx([0.3, 0.4], 1.0))) == 0
    assert evaluated(finger.off_palm(*sx([1.2, 1.6], 1.0))) == pytest.approx(1, rel=1e-5)


def test_tip_acceleration_of_a_parabola() -> None:
    a, h = np.array([2.0, -1, 0.5]), 0.1
    points = [a * t**2 / 2 + 3 * t for t in (0.4 - h, 0.4, 0.4 + h)]
    np.testing.assert_allclose(evaluated(finger.tip_acceleration(*sx(*points, h))), a, atol=1e-10)
