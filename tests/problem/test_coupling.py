"""Lines through the commands of joints, against SciPy's singular values and closed forms."""

import numpy as np
import pytest
from scipy.linalg import svdvals

from casadi_hands.problem.coupling import fit_coupling
from casadi_hands.problem.drive import Drive

SAMPLES, JOINTS = 40, 7


def commands_of(rng: np.random.Generator, motors: int) -> np.ndarray:
    """Commands (S, J) on so many lines."""
    along = np.cumsum(rng.normal(size=(SAMPLES, motors)), axis=0)
    return rng.normal(size=JOINTS) + along @ rng.normal(size=(motors, JOINTS))


@pytest.mark.parametrize("motors", [1, 2, 3])
def test_commands_on_lines_are_found_again(motors: int, rng: np.random.Generator) -> None:
    commands = commands_of(rng, motors)
    found = fit_coupling(commands, motors, rng.uniform(0.2, 2.0, JOINTS))
    np.testing.assert_allclose(found.commands, commands, atol=1e-10)
    np.testing.assert_allclose(found.positions[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(found.offsets, commands[0], atol=1e-10)


@pytest.mark.parametrize("motors", [1, 2, 3])
def test_no_lines_are_nearer(motors: int, rng: np.random.Generator) -> None:
    commands, weights = rng.normal(size=(SAMPLES, JOINTS)), rng.uniform(0.2, 2.0, JOINTS)
    found = fit_coupling(commands, motors, weights)
    left = np.linalg.norm((found.commands - commands) * weights)
    sizes = svdvals((commands - commands.mean(axis=0)) * weights)
    assert left == pytest.approx(np.linalg.norm(sizes[motors:]), rel=1e-9)


@pytest.mark.parametrize("motors", [1, 2, 3])
def test_every_motor_leads_a_joint_that_goes_as_far_as_any(motors: int, rng: np.random.Generator) -> None:
    found = fit_coupling(commands_of(rng, motors), motors, np.ones(JOINTS))
    assert len(set(found.leaders)) == motors
    np.testing.assert_array_equal(found.ratios[list(found.leaders)], np.eye(motors))
    assert np.abs(found.ratios).max() < 1.02


def test_more_motors_than_the_commands_need_stand_still_or_share(rng: np.random.Generator) -> None:
    commands = commands_of(rng, 2)
    np.testing.assert_allclose(fit_coupling(commands, 2, np.ones(JOINTS)).commands, commands, atol=1e-10)
    assert np.isfinite(fit_coupling(commands + 1e-9 * rng.normal(size=commands.shape), 3, np.ones(JOINTS)).ratios).all()


@pytest.mark.parametrize("samples", [1, 2, 3])
def test_fewer_samples_than_motors_are_met(samples: int, rng: np.random.Generator) -> None:
    commands = rng.normal(size=(samples, JOINTS))
    found = fit_coupling(commands, 3, rng.uniform(0.2, 2.0, JOINTS))
    np.testing.assert_allclose(found.commands, commands, atol=1e-10)
    np.testing.assert_array_equal(found.ratios[list(found.leaders)], np.eye(3))
    assert np.abs(found.ratios).max() < 1.02


def test_motors_do_the_work_of_joints(rng: np.random.Generator) -> None:
    """Power: what motors exert, by virtual work, times how fast they turn is what springs do at commands' rates."""
    ratios = np.array([[1.0, 0.0], [0.0, 1.0], [-0.5, 0.0], [0.7, -1.3]])
    drive = Drive(tuple(map(tuple, ratios.tolist())), (0.1, 0.2, 0.3, 0.4), 1.0, 1.0)
    positions, torques = rng.normal(size=(5, 2)), rng.normal(size=(5, 4))
    rates = np.diff(drive.commands(positions), axis=0)
    expected = np.sum(torques[1:] * rates, axis=1)
    np.testing.assert_allclose(
        np.sum((torques @ np.array(drive.ratios))[1:] * np.diff(positions, axis=0), axis=1), expected
    )


def test_a_joint_of_one_motor_follows_the_first_that_it_turns_alone() -> None:
    drive = Drive(((1.0, 0.0), (0.4, 0.5), (-0.5, 0.0), (0.0, 1.0), (0.0, 0.0)), (0.1, 0.2, 0.3, 0.4, 0.5), 1.0, 1.0)
    assert drive.leader(0) is None
    assert drive.leader(1) is None  # two motors turn it
    assert drive.leader(3) is None
    for joint, leader in ((2, 0), (4, 0)):
        found = drive.leader(joint)
        assert found is not None
        first, multiplier, offset = found
        assert first == leader
        for position in (-1.0, 0.0, 2.0):
            commands = drive.commands(np.array([[position, 0.7]]))[0]
            assert commands[joint] == pytest.approx(multiplier * commands[first] + offset)
