"""The least grip against closed forms and a programme of another form; bounds never above it."""

import numpy as np
import pytest

from casadi_hands.placement.grip import Bounds, least_grip, reactions
from casadi_hands.placement.loads import MARGIN, Contacts, Load, disturbances
from casadi_hands.statics.grasp import friction_edges, grasp_map
from casadi_hands.statics.programmes import least_largest

NOTHING = np.zeros((0, 6))
NO_GROUND = np.zeros((6, 0))
WEIGHT = Load(np.array([0, 0, 1.0, 0, 0, 0]), NO_GROUND)
ALL = np.arange


def on_ball(count: int, seed: int) -> np.ndarray:
    directions = np.random.default_rng(seed).normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def test_a_pinch_presses_half_the_weight_over_friction() -> None:
    points = np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    contacts = Contacts.of(points, points, 0.5, 0.0)
    grip = least_grip(contacts, ALL(2), [WEIGHT], NOTHING)
    assert grip.most == pytest.approx(1 / (2 * MARGIN * 0.5))
    assert grip.forces[0].sum(axis=0) == pytest.approx([0, 0, 1])


def test_two_hard_points_cannot_stand_a_torque_about_their_line() -> None:
    points = np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    hard, soft = (Contacts.of(points, points, 0.5, torsion) for torsion in (0.0, 0.05))
    assert least_grip(hard, ALL(2), [WEIGHT], disturbances()).most == np.inf
    # A quarter of weight × length, shared by two that press.
    assert least_grip(soft, ALL(2), [WEIGHT], disturbances()).most == pytest.approx(0.125 / (MARGIN * 0.05))
    assert np.isfinite(least_grip(hard, ALL(2), [WEIGHT], disturbances(torques=False)).most)


@pytest.mark.parametrize("seed", range(8))
def test_the_same_as_by_the_cones_edges(seed: int) -> None:
    points = on_ball(4, seed)
    contacts = Contacts.of(points, points, 0.8, 0.0)
    edges = friction_edges(-points, np.full(4, MARGIN * 0.8))
    spread = np.tile(edges, (4, 1)) * np.kron(np.eye(4), np.ones((3, 8)))
    wanted = least_largest(np.kron(np.eye(4), np.ones(8)), grasp_map(points) @ spread, WEIGHT.wrench)
    assert least_grip(contacts, ALL(4), [WEIGHT], NOTHING).most == pytest.approx(wanted, rel=1e-6)


def test_the_ground_bears_the_weight() -> None:
    points = np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    ground = np.array([[0, 0, 1.0, 0, 0, 0]]).T
    contacts = Contacts.of(points, points, 0.5, 0.0)
    assert least_grip(contacts, ALL(2), [Load(WEIGHT.wrench, ground)], NOTHING).most == pytest.approx(0, abs=1e-9)
    assert least_grip(contacts, ALL(2), [Load(2 * WEIGHT.wrench, ground)], NOTHING).most == pytest.approx(
        1 / (2 * MARGIN * 0.5)
    )


def test_springs_balance_what_disturbs() -> None:
    points = on_ball(3, 3)
    contacts = Contacts.of(points, points, 0.5, 0.05)
    met = reactions(contacts, ALL(3)[None], disturbances())[0]
    made = np.einsum("kia,kdi->da", contacts.maps, met)
    assert made == pytest.approx(disturbances(), abs=1e-6)


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_forces_stay_in_the_cones_whatever_disturbs(seed: int) -> None:
    points = on_ball(4, seed)
    contacts = Contacts.of(points, points, 0.8, 0.0)
    grip = least_grip(contacts, ALL(4), [WEIGHT], disturbances())
    assert np.isfinite(grip.most)
    met = reactions(contacts, ALL(4)[None], disturbances())[0][..., :3]
    planned = np.einsum("kij,kj->ki", contacts.frames, grip.forces[0])
    assert planned[:, 0].max() == pytest.approx(grip.most)
    both = planned[:, None] + met
    assert (np.linalg.norm(both[..., 1:], axis=-1) <= MARGIN * 0.8 * both[..., 0] + 1e-7).all()


@pytest.mark.parametrize("torsion", [0.0, 0.05])
def test_bounds_are_below(torsion: float) -> None:
    points = on_ball(12, 5)
    contacts, rng = Contacts.of(points, points, 0.7, torsion), np.random.default_rng(0)
    sets = np.array([rng.choice(12, 3, replace=False) for _ in range(40)])
    for disturbed in (NOTHING, disturbances()):
        bounds = Bounds(contacts, [WEIGHT], disturbed, rng)
        least = [least_grip(contacts, chosen, [WEIGHT], disturbed) for chosen in sets]
        for grip in least:
            bounds.add(grip.prices)
        most = np.array([grip.most for grip in least])
        assert (bounds.all(sets) <= most * (1 + 1e-6)).all()
        # Prices of a programme are tight for its own set, where nothing disturbs.
        finite = np.isfinite(most)
        assert finite.any()
        if not len(disturbed):
            assert bounds.all(sets)[finite] == pytest.approx(most[finite], rel=1e-6)
