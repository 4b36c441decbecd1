"""Branches of fingers against numeric Jacobians of made-up motions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.kinematics.singularity import margin_directions, passes_singularity
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.placement import contact_jacobians
from tests.stages.example import PinFinger, everything, made_up_solution

Array = np.ndarray
MODEL = everything()[1]
COUNT = len(MODEL.schedule.samples)


def bending(elbow: Array) -> tuple[WholeHand, Array]:
    """A motion of one finger whose second joint has the angles (S,) given, and the Jacobians (S, 3, n) of its contact.

    Its joints have parallel axes but for the first of three; the object moves at random and is touched by the tip.
    """
    rng, joints = np.random.default_rng(4), 3 if elbow.ndim == 2 else 2
    across, upright = [[0, 0, 1], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    frames = np.array([upright, across, across][3 - joints :], float)
    angles = np.column_stack([np.linspace(0.3, 0.5, COUNT), elbow])
    finger = FingerSeed(
        base=np.array([0.2, -0.1]),
        lengths=np.array([1.1, 1.3, 0.9])[:joints],
        frames=frames,
        axes=np.zeros((joints, 2)),
        bends=np.zeros((joints, 2)),
        angles=angles[:1],
        tips=np.zeros((1, 2)),
    )
    position, vector = rng.normal(size=(COUNT, 3)), rng.uniform(-1, 1, (COUNT, 3))
    palms = Rotation.from_quat(MODEL.palm_quaternion, scalar_first=True)
    numeric, end = PinFinger(finger, MODEL.link_radius), np.array([0, 0, finger.lengths[-1]])
    world = palms.apply([numeric.point(q, end) for q in angles]) + MODEL.palm_position
    turns = Rotation.from_rotvec(vector) * Rotation.from_quat(MODEL.reference, scalar_first=True)
    point = np.zeros((COUNT, MODEL.contacts + 1, 3))
    point[:, 1] = turns.inv().apply(world - position)
    hand = WholeHand(
        fingers=(finger,),
        contacts=(1,),
        angles=(angles,),
        palm_position=MODEL.palm_position,
        palm_quaternion=MODEL.palm_quaternion,
        position=position,
        vector=vector,
        point=point,
        force=np.zeros_like(point),
        active=np.ones(point.shape[:2], bool),
        solution=made_up_solution({}),
    )
    return hand, np.array([numeric.jacobian(q, end) for q in angles])


def sides(elbow: Array, active: Array | None = None) -> tuple[Array, Array]:
    """The singularity_margin of the motion at each knot on the branch that is kept, and its size."""
    hand, jacobians = bending(elbow)
    singularity_margin = (
        np.linalg.det(jacobians)[:, None] if elbow.ndim == 2 else np.cross(*jacobians.transpose(2, 0, 1))
    )
    active = np.ones(COUNT, bool) if active is None else active
    branch = margin_directions(contact_jacobians(MODEL, hand, 0), active, active | np.append(False, active[:-1]))
    assert branch.shape == singularity_margin.shape
    return (branch * singularity_margin).sum(axis=1), np.linalg.norm(singularity_margin, axis=1)


def with_elbow(joints: int, angles: Array) -> Array:
    """The angles of all joints after the first."""
    return angles if joints == 2 else np.column_stack([np.linspace(0.4, 0.7, COUNT), angles])


@pytest.mark.parametrize("joints", [2, 3])
@pytest.mark.parametrize("side", [1, -1])
def test_a_finger_that_stays_bent_is_on_one_branch(joints: int, side: int) -> None:
    found, size = sides(with_elbow(joints, side * np.linspace(0.4, 1.2, COUNT)))
    np.testing.assert_allclose(found, size / np.median(size), rtol=1e-6)


@pytest.mark.parametrize("joints", [2, 3])
@pytest.mark.parametrize("side", [1, -1])
def test_a_finger_that_folds_over_for_a_moment_is_kept_on_its_usual_branch(joints: int, side: int) -> None:
    angles = np.full(COUNT, 0.8 * side)
    angles[:2] *= -1
    found, size = sides(with_elbow(joints, angles))
    np.testing.assert_allclose(found, np.where(np.arange(COUNT) < 2, -1, 1) * size / np.median(size), rtol=1e-6)


@pytest.mark.parametrize("joints", [2, 3])
def test_a_finger_that_is_on_both_branches_is_kept_on_none(joints: int) -> None:
    found, _ = sides(with_elbow(joints, np.where(np.arange(COUNT) < COUNT // 2, 0.8, -0.8)))
    np.testing.assert_array_equal(found, 0)


@pytest.mark.parametrize("joints", [2, 3])
def test_each_touch_has_its_own_branch(joints: int) -> None:
    first = COUNT // 2
    active = np.arange(COUNT) != first
    angles = np.where(np.arange(COUNT) <= first, 0.8, -0.8)
    found, _ = sides(with_elbow(joints, angles), active)
    assert np.all(found > 0.5)
    # Away for longer, the finger touches until the knot at which it lets go, and is free then.
    active[first + 1] = False
    found, _ = sides(with_elbow(joints, angles), active)
    assert found[first + 1] == 0
    assert np.all(np.delete(found, first + 1) > 0.5)


@pytest.mark.parametrize("joints", [2, 3])
def test_a_finger_that_is_always_stretched_out_is_kept_on_no_branch(joints: int) -> None:
    found, size = sides(with_elbow(joints, np.linspace(1e-9, 1e-7, COUNT)))
    assert 0 < size.max() < 1e-6
    np.testing.assert_array_equal(found, 0)


@pytest.mark.parametrize("joints", [2, 3])
def test_a_finger_folds_where_it_passes_a_singular_pose_or_is_near_one_while_it_touches(joints: int) -> None:
    always = np.ones(COUNT, bool)

    def folds_with(elbow: Array, active: Array) -> bool:
        return passes_singularity(bending(with_elbow(joints, elbow))[1], active)

    bent, over = np.full(COUNT, 0.8), np.where(np.arange(COUNT) < 4, 0.8, -0.8)
    assert not folds_with(bent, always)
    assert folds_with(over, always)
    straight = np.where(np.arange(COUNT) == 4, 0.01, bent)
    assert folds_with(straight, always)
    assert not folds_with(straight, np.arange(COUNT) != 4)
    assert not folds_with(over, np.arange(COUNT) != 4)
    assert not folds_with(over, np.zeros(COUNT, bool))


@pytest.mark.parametrize("joints", [1, 4])
def test_fingers_of_one_joint_or_many_never_fold(joints: int) -> None:
    assert not passes_singularity(np.zeros((5, 3, joints)), np.ones(5, bool))
