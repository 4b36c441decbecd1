"""A fingertip's surface and a joint's axis in coordinates, against closed forms."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.kinematics.numeric import contact_kinematics
from casadi_hands.kinematics.symbols import axes_of, axis, bend_rotation, cosines_from_links, tip_point, turns_of
from tests.stages.example import PinFinger, everything, made_up_finger, project, sizes_of, with_tips

LENGTH, RADIUS = 0.7, 0.2


@pytest.mark.parametrize("arc", [0.0, 1e-7, 0.05, 0.2, 0.31, 0.32, 0.5])
@pytest.mark.parametrize("azimuth", [0.0, 1.0, 4.0])
def test_tip_points_are_on_the_surface_at_their_arc_length(arc: float, azimuth: float) -> None:
    coordinates = arc * np.array([np.cos(azimuth), np.sin(azimuth)])
    point, normal = (np.asarray(v).ravel() for v in tip_point(*map(ca.DM, (coordinates, LENGTH, RADIUS))))
    on_surface, outward = project(point + 0.01 * normal, np.array([0, 0, 0, 0, 0, LENGTH, RADIUS]))
    np.testing.assert_allclose(on_surface, point, atol=1e-9)
    np.testing.assert_allclose(outward, normal, atol=1e-9)
    if arc > 1e-3:
        assert np.arctan2(point[1], point[0]) % (2 * np.pi) == pytest.approx(azimuth, abs=1e-6)
        quarter = RADIUS * np.pi / 2
        expected = LENGTH + RADIUS * np.cos(arc / RADIUS) if arc < quarter else LENGTH - (arc - quarter)
        assert point[2] == pytest.approx(expected, abs=1e-8)


def test_axis_is_unit_and_leans_towards_its_coordinates() -> None:
    rng = np.random.default_rng(0)
    for coordinates in ([0, 0], [0.4, 0], [0, -1.0], [1.2, 1.5]):
        frame = Rotation.random(rng=rng).as_matrix()
        found = np.asarray(ca.evalf(axis(ca.SX(coordinates), ca.SX(ca.DM(frame.T.ravel()))))).ravel()
        x, y = coordinates
        expected = frame @ Rotation.from_rotvec([-y, x, 0]).apply([0, 0, 1])
        np.testing.assert_allclose(found, expected, atol=1e-5)
        assert np.linalg.norm(found) == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize("bend", [[0, 0], [1e-7, 0], [0.3, -0.2], [0, np.pi / 2], [-1.5, 1.4]])
def test_bent_is_the_rotation_of_its_vector(bend: list[float]) -> None:
    found = np.asarray(ca.evalf(bend_rotation(ca.SX(ca.DM(bend)))))
    # The angle is rounded off at zero, by 1e-5 rad.
    np.testing.assert_allclose(found, pin.exp3(np.array([*bend, 0.0])), atol=1e-9)
    np.testing.assert_allclose(found.T @ found, np.eye(3), atol=2e-9)


def test_turns_of_a_seed_are_those_of_the_symbols() -> None:
    seed = made_up_finger(everything()[1], 3, 1, 7)
    found = np.asarray(ca.evalf(turns_of(ca.SX(ca.DM(seed.bends.ravel())))))
    assert found.shape == (3, 9)
    np.testing.assert_allclose(found, np.hstack(list(seed.turns)), atol=1e-9)
    np.testing.assert_allclose(seed.turns, [pin.exp3(np.array([*bend, 0.0])) for bend in seed.bends], atol=1e-12)


@pytest.mark.parametrize("joints", [1, 2, 3])
def test_cosines_are_those_of_axes_and_links_that_pinocchio_has(joints: int) -> None:
    seed = made_up_finger(everything()[1], joints, 1, 8)
    model, parent = pin.Model(), 0
    for axis_, bend in zip(PinFinger(seed, RADIUS).axes, seed.bends, strict=True):
        place = pin.SE3(pin.exp3(np.array([*bend, 0.0])), np.zeros(3))
        parent = model.addJoint(parent, pin.JointModelRevoluteUnaligned(axis_), place, f"j{parent}")
    data, angles = model.createData(), np.random.default_rng(0).uniform(-1, 1, joints)
    # Whatever the angles: an axis stands in its link and in the one before as they are turned about it.
    pin.computeJointJacobians(model, data, angles)
    axes = [pin.getJointJacobian(model, data, j + 1, pin.WORLD).reshape(6, joints)[3:, j] for j in range(joints)]
    links = [data.oMi[j + 1].rotation[:, 2] for j in range(joints)]
    expected = [a @ b for a, b in zip(axes, links, strict=True)] + [
        a @ b for a, b in zip(axes[1:], links, strict=False)
    ]
    frames = ca.SX(ca.DM(seed.frames.transpose(0, 2, 1).ravel()))
    symbols = axes_of(ca.SX(ca.DM(seed.axes.ravel())), frames), turns_of(ca.SX(ca.DM(seed.bends.ravel())))
    found = np.asarray(ca.evalf(cosines_from_links(*symbols))).ravel()
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_derivatives_of_a_bend_are_finite_where_the_link_is_straight() -> None:
    x = ca.SX.sym("x", 2)
    jacobian = ca.jacobian(ca.vec(bend_rotation(x)), x)
    first, second = (np.asarray(v) for v in ca.Function("f", [x], [jacobian, ca.jacobian(ca.vec(jacobian), x)])([0, 0]))
    assert np.isfinite(second).all()
    for k, generator in enumerate(np.eye(3)[:2]):
        np.testing.assert_allclose(first[:, k].reshape(3, 3).T, pin.skew(generator), atol=1e-9)


def test_derivatives_are_finite_at_the_pole_and_at_the_seed_axis() -> None:
    x = ca.SX.sym("x", 2)
    out = ca.vertcat(*tip_point(x, ca.SX(LENGTH), ca.SX(RADIUS)), axis(x, ca.vec(ca.SX.eye(3))))
    jacobian = ca.jacobian(out, x)
    for found in ca.Function("f", [x], [jacobian, ca.jacobian(ca.vec(jacobian), x)])(np.zeros(2)):
        assert np.isfinite(np.asarray(found)).all()
    # The map is the plane's identity there: over the pole and over the sphere of axes.
    at_pole = np.asarray(ca.Function("f", [x], [jacobian])(np.zeros(2)))
    np.testing.assert_allclose(at_pole[:2], np.eye(2), atol=1e-9)
    np.testing.assert_allclose(at_pole[6:8], np.eye(2), atol=1e-9)


@pytest.mark.parametrize("joints", [1, 2, 3])
def test_contact_kinematics_in_numbers(joints: int) -> None:
    model = with_tips(everything()[1])
    seed = made_up_finger(model, joints, 2, 5)
    strings = np.arange(len(seed.angles)) % 2
    points, jacobians = contact_kinematics(seed, strings, sizes_of(model, joints))
    finger = PinFinger(seed, sizes_of(model, joints)[0])
    for k, (angles, string) in enumerate(zip(seed.angles, strings, strict=True)):
        u, v = seed.tips[string]
        lean = np.hypot(u, v) / model.tip_radius
        on_link = np.array([0, 0, seed.lengths[-1]])
        quarter = np.pi / 2
        side = np.array([u, v, 0]) / np.hypot(u, v)
        on_link = on_link + model.tip_radius * (
            np.sin(min(lean, quarter)) * side + np.cos(min(lean, quarter)) * np.array([0, 0, 1])
        )
        on_link[2] -= max(lean - quarter, 0) * model.tip_radius
        np.testing.assert_allclose(points[k], finger.point(angles, on_link), atol=1e-6)
        np.testing.assert_allclose(jacobians[k], finger.jacobian(angles, on_link), atol=1e-5)
    np.testing.assert_allclose(seed.axis_vectors, finger.axes, atol=1e-6)
