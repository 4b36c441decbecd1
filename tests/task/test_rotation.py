import numpy as np
import pytest
from scipy.spatial.transform import Rotation as ScipyRotation

from casadi_hands.task import Rotation
from casadi_hands.task.rotation import rotation_matrix


def test_matrix_agrees_with_scipy() -> None:
    for vector in np.random.default_rng(0).normal(size=(20, 3)) * 3:
        assert rotation_matrix(vector) == pytest.approx(ScipyRotation.from_rotvec(vector).as_matrix(), abs=1e-13)
    assert (rotation_matrix(np.zeros(3)) == np.eye(3)).all()


def test_quaternion_agrees_with_scipy() -> None:
    for quaternion in np.random.default_rng(0).normal(size=(20, 4)) * 3:
        turn = Rotation.model_validate({"quaternion": [float(x) for x in quaternion]})
        w, x, y, z = quaternion
        expected = ScipyRotation.from_quat([x, y, z, w])
        assert turn.matrix == pytest.approx(expected.as_matrix(), abs=1e-13)
        assert turn.vector == pytest.approx(expected.as_rotvec(), abs=1e-13)


@pytest.mark.parametrize("quaternion", [[0, 1, 0, 0], [0, 0, 1, 0], [0, 0.8, 0, 0.6], [0.1, 0, 0, 0.995], [1, 0, 0, 0]])
def test_half_turns_and_others_are_taken_as_written(quaternion: list[float]) -> None:
    w, x, y, z = quaternion
    turn = Rotation.model_validate({"quaternion": [float(value) for value in quaternion]})
    assert turn.matrix == pytest.approx(ScipyRotation.from_quat([x, y, z, w]).as_matrix(), abs=1e-13)


def test_no_turn_as_quaternion() -> None:
    assert (Rotation.model_validate({"quaternion": [-2, 0, 0, 0]}).vector == 0).all()


def test_vector_keeps_the_way_round() -> None:
    assert Rotation(axis=(0, 0, 2), degrees=180).vector == pytest.approx([0, 0, np.pi])
    assert Rotation(axis=(0, 0, 2), degrees=-180).vector == pytest.approx([0, 0, -np.pi])
    assert Rotation(axis=(3, 0, 0), degrees=270).vector == pytest.approx([1.5 * np.pi, 0, 0])
