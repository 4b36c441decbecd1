"""Where the refine stage starts: SciPy's rotations and closed forms of motion, and least changes of forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

from casadi_hands.motion import Schedule
from casadi_hands.stages.refine.initial_guess import balanced, disturbance_wrenches, rates_and_wrenches
from tests.stages.example import everything

Array = np.ndarray
DURATION = 1.5


def wave(one: Array, two: Array, t: float) -> Array:
    """At rest at 0 and at the end, with no third derivative there."""
    w = np.pi / DURATION
    return one * (1 - np.cos(w * t)) + two * (1 - np.cos(2 * w * t))


def test_rates_and_wrenches_are_those_of_newton_and_euler(rng: np.random.Generator) -> None:
    a, b, c, d = rng.uniform(-0.5, 0.5, (4, 3))
    _, model = everything()
    model = replace(model, schedule=Schedule.of([0, DURATION], DURATION, 0, 0.01))
    times, w = model.schedule.samples, np.pi / DURATION
    reference = Rotation.from_quat(model.reference, scalar_first=True)
    position, vector = (np.array([wave(*ends, t) for t in times]) for ends in ((a, b), (c, d)))
    rates, wrenches = rates_and_wrenches(model, position, vector)

    def spin(t: float, h: float = 1e-4) -> Array:
        before, after = (Rotation.from_rotvec(wave(c, d, t + k * h)) * reference for k in (-1, 1))
        return (before.inv() * after).as_rotvec() / (2 * h)

    for t, rate, wrench in zip(times, rates, wrenches, strict=True):
        turn = Rotation.from_rotvec(wave(c, d, t)) * reference
        speed = a * w * np.sin(w * t) + b * 2 * w * np.sin(2 * w * t)
        acceleration = a * w**2 * np.cos(w * t) + b * 4 * w**2 * np.cos(2 * w * t)
        omega, alpha = spin(t), (spin(t + 1e-3) - spin(t - 1e-3)) / 2e-3
        np.testing.assert_allclose(rate, [*speed, *omega], atol=1e-4)
        force = turn.inv().apply(model.units.inertial * acceleration - [0, 0, -1])
        torque = model.units.inertial * (np.cross(omega, model.inertia @ omega) + model.inertia @ alpha)
        np.testing.assert_allclose(wrench, [*force, *torque], atol=2e-5)
    assert np.abs(rates[[0, -1]]).max() < 1e-12
    assert np.abs(wrenches[:, 3:]).max() > 2e-3


def test_perturbations_are_turned_into_the_object() -> None:
    _, model = everything()
    vectors = np.random.default_rng(2).normal(size=model.disturbance.force.shape)
    turns = Rotation.from_rotvec(vectors) * Rotation.from_quat(model.reference, scalar_first=True)
    found = disturbance_wrenches(model, vectors)
    for columns, given in ((found[:, :3], model.disturbance.force), (found[:, 3:], model.disturbance.torque)):
        np.testing.assert_allclose(turns.apply(columns), given, atol=1e-12)
    assert found.any()


def test_forces_change_as_little_as_the_wrench_allows() -> None:
    rng = np.random.default_rng(1)
    points, forces, wrenches = rng.normal(size=(6, 4, 3)), rng.normal(size=(6, 4, 3)), rng.normal(size=(6, 6))
    active = np.ones((6, 4), bool)
    active[2:4, 1] = False
    found = balanced(points, forces, active, wrenches)
    for k in range(6):
        made = np.r_[found[k].sum(axis=0), np.cross(points[k], found[k]).sum(axis=0)]
        np.testing.assert_allclose(made, wrenches[k], atol=1e-9)
        # A least change has no part that makes no wrench.
        columns = [np.r_[e, np.cross(point, e)] for point in points[k, active[k]] for e in np.eye(3)]
        change = (found - forces)[k, active[k]].ravel()
        np.testing.assert_allclose(null_space(np.column_stack(columns)).T @ change, 0, atol=1e-9)
        np.testing.assert_array_equal(found[k, ~active[k]], 0)


@pytest.mark.parametrize("apart", [0.0, 1e-4])
def test_what_contacts_cannot_make_does_not_blow_their_forces_up(apart: float) -> None:
    # Contacts on a line, or as good as: no torque about it. The rest of the wrench is made.
    points = np.array([[[-1.0, 0, 0], [1.0, 0, 0], [0, apart, 0]]])
    wrench = np.array([[0.3, -0.2, 1.0, 0.5, 0.1, -0.4]])
    found = balanced(points, np.zeros((1, 3, 3)), np.ones((1, 3), bool), wrench)[0]
    made = np.r_[found.sum(axis=0), np.cross(points[0], found).sum(axis=0)]
    np.testing.assert_allclose(made, [0.3, -0.2, 1.0, 0, 0.1, -0.4], atol=1e-3)
    assert np.abs(found).max() < 1


def test_without_contacts_there_are_no_forces() -> None:
    forces = np.ones((2, 3, 3))
    found = balanced(np.eye(3)[None].repeat(2, 0), forces, np.zeros((2, 3), bool), np.ones((2, 6)))
    np.testing.assert_array_equal(found, 0)
