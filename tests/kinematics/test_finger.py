"""The compiled kinematics against numeric Pinocchio, closed forms and finite differences."""

from __future__ import annotations

import ctypes
import re
import sys
from dataclasses import dataclass

import casadi
import numpy as np
import pinocchio
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.errors import KinematicsError
from casadi_hands.kinematics import finger_kinematics

OUTPUTS = ("origins", "rotations", "tip", "contact", "jacobian")


@dataclass(frozen=True)
class Inputs:
    base: np.ndarray
    turns: np.ndarray
    axes: np.ndarray
    lengths: np.ndarray
    angles: np.ndarray
    point: np.ndarray

    def evaluate(self) -> dict[str, np.ndarray]:
        values = finger_kinematics(len(self.lengths))(**vars(self))
        return {name: np.array(value) for name, value in values.items()}


def random_inputs(joints: int, seed: int) -> Inputs:
    rng = np.random.default_rng([joints, seed])
    axes = rng.normal(size=(3, joints))
    return Inputs(
        base=rng.uniform(-0.1, 0.1, 3),
        turns=np.hstack(list(Rotation.random(joints, rng=rng).as_matrix())),
        axes=axes / np.linalg.norm(axes, axis=0),
        lengths=rng.uniform(0.01, 0.1, joints),
        angles=rng.uniform(-np.pi, np.pi, joints),
        point=rng.uniform(-0.02, 0.05, 3),
    )


def numeric_pinocchio(inputs: Inputs) -> dict[str, np.ndarray]:
    """The same quantities from the wheel's own double-precision model."""
    model, joint = pinocchio.Model(), 0
    offsets = [inputs.base, *([0.0, 0.0, length] for length in inputs.lengths)]
    for j, axis in enumerate(inputs.axes.T):
        placement = pinocchio.SE3(inputs.turns[:, 3 * j : 3 * j + 3], np.array(offsets[j]))
        joint = model.addJoint(joint, pinocchio.JointModelRevoluteUnaligned(axis), placement, f"j{j}")
    data = model.createData()
    pinocchio.computeJointJacobians(model, data, inputs.angles)
    last = data.oMi[joint]
    twist = pinocchio.getJointJacobian(model, data, joint, pinocchio.LOCAL_WORLD_ALIGNED)
    twist = twist.reshape(6, -1)  # the bindings return a flat vector for a single joint
    lever = last.rotation @ inputs.point
    return {
        "origins": np.column_stack([m.translation for m in data.oMi[1:]]),
        "rotations": np.hstack([m.rotation for m in data.oMi[1:]]),
        "tip": last.act(np.array(offsets[-1]))[:, None],
        "contact": last.act(inputs.point)[:, None],
        "jacobian": twist[:3] + np.cross(twist[3:], lever, axis=0),
    }


@pytest.mark.parametrize("joints", [1, 2, 3, 4])
def test_equals_numeric_pinocchio(joints: int) -> None:
    for seed in range(25):
        inputs = random_inputs(joints, seed)
        ours, theirs = inputs.evaluate(), numeric_pinocchio(inputs)
        for name in OUTPUTS:
            np.testing.assert_allclose(ours[name], theirs[name], rtol=0, atol=1e-12, err_msg=name)


@pytest.mark.parametrize("joints", [1, 2, 3, 4])
def test_jacobian_is_the_derivative_of_the_contact_point(joints: int) -> None:
    inputs = random_inputs(joints, seed=7)
    step = 1e-6
    for j in range(joints):
        ahead, behind = (
            Inputs(**{**vars(inputs), "angles": inputs.angles + sign * step * np.eye(joints)[j]}) for sign in (1, -1)
        )
        slope = (ahead.evaluate()["contact"] - behind.evaluate()["contact"]) / (2 * step)
        np.testing.assert_allclose(inputs.evaluate()["jacobian"][:, [j]], slope, rtol=0, atol=1e-9)


def test_zero_configuration_stands_straight_up_from_the_base() -> None:
    inputs = random_inputs(3, seed=1)
    straight = Inputs(**{**vars(inputs), "angles": np.zeros(3), "turns": np.tile(np.eye(3), 3)})
    heights = np.concatenate([[0.0], np.cumsum(inputs.lengths)])
    values = straight.evaluate()
    up = np.outer([0.0, 0.0, 1.0], heights) + inputs.base[:, None]
    np.testing.assert_allclose(values["origins"], up[:, :3], rtol=0, atol=1e-15)
    np.testing.assert_allclose(values["tip"], up[:, 3:], rtol=0, atol=1e-15)
    np.testing.assert_allclose(values["rotations"], np.tile(np.eye(3), 3), rtol=0, atol=1e-15)


def symbols(joints: int) -> dict[str, casadi.SX]:
    shapes = {
        "base": (3, 1),
        "turns": (3, 3 * joints),
        "axes": (3, joints),
        "lengths": (joints, 1),
        "angles": (joints, 1),
        "point": (3, 1),
    }
    return {name: casadi.SX.sym(name, *shape) for name, shape in shapes.items()}


def test_expands_inside_a_larger_symbolic_expression() -> None:
    arguments = symbols(2)
    outputs = finger_kinematics(2)(**arguments)
    error = casadi.jacobian(outputs["contact"], arguments["angles"]) - outputs["jacobian"]
    function = casadi.Function("error", {**arguments, "error": error}, list(arguments), ["error"])
    assert function.is_a("SXFunction")
    assert {function.instruction_id(k) for k in range(function.n_instructions())}.isdisjoint({casadi.OP_CALL})
    for seed in range(10):
        residual = function(**vars(random_inputs(2, seed)))["error"]
        np.testing.assert_allclose(np.array(residual), 0.0, rtol=0, atol=1e-14)


def test_second_derivatives_at_zero_angles_match_the_double_cross_product() -> None:
    # For one joint the contact point is base + T R(q) p, so its second derivative at q = 0 is T (a × (a × p)).
    arguments = symbols(1)
    contact = finger_kinematics(1)(**arguments)["contact"]
    second = casadi.jacobian(casadi.jacobian(contact, arguments["angles"]), arguments["angles"])
    function = casadi.Function("second", {**arguments, "second": second}, list(arguments), ["second"])
    inputs = Inputs(**{**vars(random_inputs(1, seed=3)), "angles": np.zeros(1)})
    axis = inputs.axes[:, 0]
    expected = inputs.turns @ np.cross(axis, np.cross(axis, inputs.point))
    np.testing.assert_allclose(np.array(function(**vars(inputs))["second"])[:, 0], expected, rtol=0, atol=1e-15)


def test_inputs_outputs_and_name() -> None:
    function = finger_kinematics(3)
    assert function.name() == "finger_kinematics_3"
    assert function.name_in() == ["base", "turns", "axes", "lengths", "angles", "point"]
    assert function.name_out() == list(OUTPUTS)
    assert [function.size_out(i) for i in range(5)] == [(3, 3), (3, 9), (3, 1), (3, 1), (3, 3)]
    assert finger_kinematics(3) is function


def test_no_joint_is_refused() -> None:
    with pytest.raises(ValueError, match="a finger has at least one joint, not 0"):
        finger_kinematics(0)


class Untouchable:
    """Stands in for the extension where it must not be called."""

    def finger_kinematics(self, joints: int) -> str:
        pytest.fail("the extension was called although its CasADi is not the one loaded")


def test_another_casadi_is_refused_before_the_extension_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    built_with = casadi.CasadiMeta.version()
    monkeypatch.setattr(casadi.CasadiMeta, "version", staticmethod(lambda: "3.6.7"))
    monkeypatch.setitem(sys.modules, "casadi_hands.kinematics._extension", Untouchable())
    message = (
        f"the kinematics extension was built against casadi {built_with} but casadi 3.6.7 is loaded: "
        f"go back with pip install casadi=={built_with}, or build the extension for the newest casadi with "
        "pip install . in the source folder of casadi-hands"
    )
    with pytest.raises(KinematicsError, match=f"^{re.escape(message)}$"):
        finger_kinematics.__wrapped__(2)


def test_missing_extension_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "casadi_hands.kinematics._built_with", None)
    with pytest.raises(KinematicsError, match=r"extension is missing.*pip install"):
        finger_kinematics.__wrapped__(2)


def test_unloadable_extension_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "casadi_hands.kinematics._extension", None)
    with pytest.raises(KinematicsError, match=r"extension does not load: .*_extension"):
        finger_kinematics.__wrapped__(2)


def test_the_process_holds_one_libcasadi() -> None:
    finger_kinematics(1)
    extension = sys.modules["casadi_hands.kinematics._extension"].__file__
    # Where a function of libcasadi stands, seen from either module: a second copy would have its own.
    files = extension, casadi._casadi.__file__
    addresses = {ctypes.cast(ctypes.CDLL(file).casadi_c_clear, ctypes.c_void_p).value for file in files}
    assert len(addresses) == 1
    assert addresses != {None}
