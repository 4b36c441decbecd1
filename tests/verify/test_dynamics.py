"""The residual against closed forms of rigid-body motion."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.verify.figures import dynamics
from casadi_hands.verify.figures.dynamics import between_residual, sample_residual, shoot
from casadi_hands.verify.reading.folder import Folder, read_folder
from tests.verify.fixture import SPHERE, plain, read_task

TIME = np.linspace(0.0, 1.0, 11)
CAPSULE = "gravity: [0, 0, 0]" + SPHERE.replace(
    "sphere: {center: [0, 0, 0]", "capsule: {start: [0, 0, -0.02], end: [0, 0, 0.02]"
)


def _read(directory: Path, text: str, **arrays: np.ndarray) -> Folder:
    return read_folder(plain(read_task(directory, text), TIME, **arrays).write(directory / "result"))


def _squeezed(lift: float, points: np.ndarray, squeeze: float = 3.0) -> dict[str, np.ndarray]:
    """Two opposed contacts (S, 2, 3) that squeeze along x and lift with ``lift`` newtons each."""
    force = np.tile([[squeeze, 0.0, lift], [-squeeze, 0.0, lift]], (len(TIME), 1, 1))
    return {
        "contact_active": np.ones((len(TIME), 2), dtype=bool),
        "contact_force": force,
        "contact_point_object": points,
    }


def test_free_fall_leaves_no_residual(tmp_path: Path) -> None:
    fall = np.outer(TIME, [0.3, 0, 1.0]) + np.outer(TIME**2, [0, 0, -9.81 / 2])
    folder = _read(tmp_path, SPHERE, object_position=fall)
    force, torque = sample_residual(folder, shoot(folder))
    assert force.max() < 1e-11
    assert torque.max() == 0.0


def test_hovering_without_support_misses_the_weight(tmp_path: Path) -> None:
    folder = _read(tmp_path, SPHERE)
    force, _ = sample_residual(folder, shoot(folder))
    assert force == pytest.approx(np.ones(9), abs=1e-10)


def test_support_two_percent_short_misses_two_percent(tmp_path: Path) -> None:
    points = np.tile([[-0.03, 0, 0], [0.03, 0, 0]], (11, 1, 1))
    folder = _read(tmp_path, SPHERE, **_squeezed(0.98 * 0.2 * 9.81 / 2, points))
    force, torque = sample_residual(folder, shoot(folder))
    assert force == pytest.approx(0.02 * np.ones(9), abs=1e-10)
    assert torque.max() < 1e-12


def test_force_off_the_center_leaves_its_moment(tmp_path: Path) -> None:
    # 1 mm of height between the two squeezing forces: a moment of 3 N · 1 mm, over 0.2 · 9.81 N · 30 mm.
    points = np.tile([[-0.03, 0, 0.0005], [0.03, 0, -0.0005]], (11, 1, 1))
    folder = _read(tmp_path, SPHERE, **_squeezed(0.2 * 9.81 / 2, points))
    _, torque = sample_residual(folder, shoot(folder))
    assert torque == pytest.approx(3.0 * 0.001 / (0.2 * 9.81 * 0.03) * np.ones(9), rel=1e-3)


def test_precession_by_eulers_equations_leaves_no_residual(tmp_path: Path) -> None:
    # A free body of revolution precesses about its angular momentum L at |L| / I1 and spins about its own axis at
    # (1 - I3 / I1) w3; its angular velocity turns about the axis in the body at -(1 - I3 / I1) w3.
    task = read_task(tmp_path, CAPSULE)
    cross, _, along = np.diag(np.asarray(task.object.inertia))
    rate = np.array([2.0, 0.0, 3.0])
    momentum = np.array([cross * rate[0], 0.0, along * rate[2]])
    spin = (1 - along / cross) * rate[2]
    motion = [Rotation.from_rotvec(momentum / cross * t) * Rotation.from_rotvec([0, 0, spin * t]) for t in TIME]
    turns = np.array([turn.as_quat(scalar_first=True) for turn in motion])
    folder = _read(tmp_path, CAPSULE, object_orientation=turns)
    shots = shoot(folder)
    force, torque = sample_residual(folder, shots)
    assert force.max() < 1e-12
    assert torque.max() < 1e-7
    expected = np.stack([rate[0] * np.cos(spin * TIME), -rate[0] * np.sin(spin * TIME), np.full(11, rate[2])], axis=1)
    assert shots.launch_rate == pytest.approx(expected[:-1], abs=1e-6)
    assert shots.arrival_rate == pytest.approx(expected[1:], abs=1e-6)


def test_contact_ending_at_a_sample_pushes_until_then(tmp_path: Path) -> None:
    # One contact through the centre, active on [0, 0.1) only, its force falling from 2 N to 0: the ball gains
    # f t / (2 m) and moves by f t² / (3 m), then coasts.
    active, force = np.zeros((11, 2), dtype=bool), np.zeros((11, 2, 3))
    active[0, 0], force[0, 0] = True, [2.0, 0, 0]
    gained, moved = 2.0 * 0.1 / (2 * 0.2), 2.0 * 0.1**2 / (3 * 0.2)
    x = np.where(TIME > 0, moved + gained * (TIME - 0.1), 0.0)
    folder = _read(
        tmp_path,
        "gravity: [0, 0, 0]" + SPHERE,
        object_position=np.outer(x, [1.0, 0, 0]),
        contact_active=active,
        contact_force=force,
        contact_point_object=np.tile([[-0.03, 0, 0], [0.03, 0, 0]], (11, 1, 1)),
    )
    assert sample_residual(folder, shoot(folder))[0].max() < 1e-12


def test_chord_between_contact_points_turns_less_than_the_surface(tmp_path: Path) -> None:
    # A contact that moves by an angle a over a ball of radius r between samples is r (1 - cos(a / 2)) off the chord
    # half way: a force across lacks that much lever.
    angle = 0.2 * np.arange(11)
    points = np.zeros((11, 2, 3))
    points[:, 0, :2] = 0.03 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    force = np.zeros((11, 2, 3))
    force[:, 0, 2] = 1.5
    active = np.tile([True, False], (11, 1))
    folder = _read(tmp_path, SPHERE, contact_active=active, contact_force=force, contact_point_object=points)
    expected = 1.5 * 0.03 * (1 - np.cos(0.1)) / (0.2 * 9.81 * 0.03)
    assert between_residual(folder) == pytest.approx(expected * np.ones(10), rel=1e-9)


@pytest.mark.parametrize("squeeze", [3e1, 3e2, 3e3, 3e5])
def test_forces_that_whirl_the_object_round_leave_a_large_residual(squeeze: float, tmp_path: Path) -> None:
    points = np.tile([[-0.03, 0.004, 0.02], [0.03, 0, -0.02]], (11, 1, 1))
    folder = _read(tmp_path, CAPSULE, **_squeezed(0.1, points, squeeze))
    with np.errstate(all="ignore"):
        shots = shoot(folder)
        force, torque = sample_residual(folder, shots)
    assert np.isfinite(force).all()
    assert torque.min() > 5


def test_a_shot_that_answers_to_no_launch_is_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = _read(tmp_path, SPHERE)
    found = dynamics._miss

    def deaf(*arguments: Any) -> tuple[np.ndarray, np.ndarray]:
        miss, jacobian = found(*arguments)
        jacobian[3] = 0
        return miss, jacobian

    expected = shoot(folder)
    monkeypatch.setattr(dynamics, "_miss", deaf)
    shots = shoot(folder)
    for field in fields(shots):
        one, other = getattr(shots, field.name), getattr(expected, field.name)
        np.testing.assert_array_equal(np.delete(one, 3, axis=0), np.delete(other, 3, axis=0))
        assert np.isfinite(one[3]).all()
