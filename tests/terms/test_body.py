"""The rigid body's terms against numeric Pinocchio and finite differences of momentum."""

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.terms import body


def numbers(value) -> np.ndarray:
    return np.asarray(ca.evalf(value) if isinstance(value, ca.SX) else value).squeeze()


def symmetric(rng: np.random.Generator) -> np.ndarray:
    a = rng.normal(size=(3, 3))
    return a @ a.T + np.eye(3)


def test_linear_momentum_is_zero_in_free_fall_and_sums_forces_by_activity(rng: np.random.Generator) -> None:
    gravity, acceleration = np.array([0, 0, -1.0]), np.array([0, 0, -9.81 / 0.06])
    none = body.linear_momentum(ca.DM.zeros(3, 2), ca.DM([1, 1]), gravity, ca.DM.zeros(3), acceleration, 0.06 / 9.81)
    np.testing.assert_allclose(numbers(none), 0, atol=1e-12)
    forces, c, external = rng.normal(size=(3, 2)), np.array([0.3, 0.8]), rng.normal(size=3)
    found = body.linear_momentum(ca.DM(forces), ca.DM(c), ca.DM(gravity), ca.DM(external), ca.DM(acceleration), 0.5)
    np.testing.assert_allclose(
        numbers(found), 0.3 * forces[:, 0] + 0.8 * forces[:, 1] + gravity + external - 0.5 * acceleration
    )


def test_gyroscopic_torque_is_that_of_pinocchio(rng: np.random.Generator) -> None:
    inertia, omega, alpha = symmetric(rng), *rng.normal(size=(2, 3))
    model = pin.Model()
    model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "free")
    model.appendBodyToJoint(1, pin.Inertia(1.0, np.zeros(3), inertia), pin.SE3.Identity())
    model.gravity.setZero()
    still = pin.neutral(model)
    torque = pin.rnea(model, model.createData(), still, np.r_[np.zeros(3), omega], np.r_[np.zeros(3), alpha])[3:]
    np.testing.assert_allclose(numbers(body.gyroscopic(*map(ca.DM, (inertia, omega, alpha)))), torque, atol=1e-12)


def test_angular_momentum_is_the_sum_of_torques_left_over(rng: np.random.Generator) -> None:
    points, forces, c = rng.normal(size=(3, 3)), rng.normal(size=(3, 3)), np.array([1, 0.5, 0])
    external, inertial = rng.normal(size=(2, 3))
    found = numbers(body.angular_momentum(*map(ca.DM, (points, forces, c, external, inertial))))
    torque = np.cross(points[:, 0], forces[:, 0]) + 0.5 * np.cross(points[:, 1], forces[:, 1])
    np.testing.assert_allclose(found, torque + external - inertial, atol=1e-12)


@pytest.mark.parametrize("degrees", [0, 1, 90, 180])
def test_task_pose_adds_squared_distance_and_angle(degrees: float, rng: np.random.Generator) -> None:
    start = Rotation.random(rng=rng)
    turned = start * Rotation.from_rotvec([degrees, 0, 0], degrees=True)
    quaternions = (r.as_quat(scalar_first=True) for r in (start, turned))
    q, goal = map(ca.DM, quaternions)
    value = float(body.task_pose(ca.DM([1, 2, 3]), q, ca.DM([1, 2.5, 2]), goal))
    assert value == pytest.approx(1.25 + (2 * np.sin(np.radians(degrees) / 2)) ** 2, abs=1e-12)


def test_task_point_is_where_the_tool_is_less_where_it_should_be(rng: np.random.Generator) -> None:
    position, tool, goal = rng.normal(size=(3, 3))
    turn = Rotation.random(rng=rng)
    found = body.task_point(*map(ca.DM, (position, turn.as_matrix(), tool, goal)))
    np.testing.assert_allclose(numbers(found), position + turn.apply(tool) - goal, atol=1e-12)
