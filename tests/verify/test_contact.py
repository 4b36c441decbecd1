"""Gap, slip, spin and friction against closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.verify.figures.contact import (
    active_runs,
    friction_figures,
    gap_at_samples,
    gap_between_samples,
    slip_figure,
    spin_figure,
)
from casadi_hands.verify.figures.dynamics import shoot
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.trajectory import build_trajectory, sample_placements
from tests.verify.fixture import SPHERE, TIP, geared, plain, read_task

TIME = np.linspace(0.0, 1.0, 11)
GROUND = (
    SPHERE.replace("[0, 0, -0.5], facing: [0, 0, 1]", "[0, 0, 0.5], facing: [0, 0, -1]") + "ground: {height: -0.03}\n"
)


def _on_ground(directory: Path, travel: np.ndarray, turned: np.ndarray) -> Folder:
    """A ball that travels along x (S,) m over the ground while it turns by (S,) rad about y; it carries its weight."""
    task = read_task(directory, GROUND)
    position = np.outer(travel, [1.0, 0, 0])
    turn = Rotation.from_rotvec(np.outer(turned, [0, 1.0, 0]))
    at = turn.apply([0, 0, -0.03], inverse=True)
    contacts = {
        "contact_names": ("left", "right", "ground"),
        "contact_link": ("finger0_link0", "finger1_link0", "ground"),
        "contact_active": np.tile([False, False, True], (11, 1)),
        "contact_force": np.tile([[0, 0, 0], [0, 0, 0], [0, 0, 0.2 * 9.81]], (11, 1, 1)),
        "contact_point_object": np.stack([0 * at, 0 * at, at], axis=1),
        "contact_point_link": np.stack([0 * at, 0 * at, position - np.array([0, 0, 0.03])], axis=1),
    }
    scene = plain(task, TIME, object_position=position, object_orientation=turn.as_quat(scalar_first=True), **contacts)
    return read_folder(scene.write(directory / "result"))


@pytest.mark.parametrize("rolled", [0.0, 0.5, 1.0, 1.25])
def test_slip_is_the_travel_that_rolling_does_not_explain(tmp_path: Path, rolled: float) -> None:
    travel = 0.06 * TIME
    folder = _on_ground(tmp_path, travel, rolled * travel / 0.03)
    slip = slip_figure(folder, build_trajectory(folder, shoot(folder)))
    # Steps of 0.06 rad leave a share of 0.06² / 24 of the path.
    assert slip.value == pytest.approx(abs(1 - rolled) * 0.06, abs=2e-5)
    if rolled != 1.0:
        assert "contact 'ground' slips" in slip.text
        assert "between 0 s and 1 s" in slip.text
    assert gap_at_samples(folder, sample_placements(folder)).value < 1e-12


def test_turning_on_the_spot_spins_and_does_not_slip(tmp_path: Path) -> None:
    folder = _on_ground(tmp_path, 0 * TIME, 0 * TIME)
    turn = Rotation.from_rotvec(np.outer(0.7 * TIME, [0, 0, 1.0])).as_quat(scalar_first=True)
    np.savez(folder.path / "motion.npz", **{**np.load(folder.path / "motion.npz"), "object_orientation": turn})
    folder = read_folder(folder.path)
    path = build_trajectory(folder, shoot(folder))
    assert slip_figure(folder, path).value < 1e-9
    assert spin_figure(folder, path).value == pytest.approx(np.rad2deg(0.7), rel=1e-6)


def test_bounce_opens_a_gap(tmp_path: Path) -> None:
    folder = _on_ground(tmp_path, 0 * TIME, 0 * TIME)
    up = np.zeros((11, 3))
    up[5, 2] = 2e-3
    arrays = {**np.load(folder.path / "motion.npz"), "object_position": up}
    np.savez(folder.path / "motion.npz", **arrays)
    folder = read_folder(folder.path)
    gap = gap_at_samples(folder, sample_placements(folder))
    assert gap.value == pytest.approx(2e-3)
    assert gap.text.endswith("at 0.5 s")
    between = gap_between_samples(folder, build_trajectory(folder, shoot(folder)))
    assert 1e-3 < between.value < 2.1e-3
    assert between.by_interval is not None
    assert between.by_interval.max() == between.value
    assert set(np.flatnonzero(between.by_interval > 1e-3)) <= {4, 5}


@pytest.mark.parametrize(("ball", "finger"), [(0.4, -2.0), (0.4, 0.0), (0.3, 1.0), (0.0, 1.5)])
def test_geared_bodies_slip_by_the_difference_of_arc_lengths(tmp_path: Path, ball: float, finger: float) -> None:
    folder = read_folder(geared(tmp_path, ball, finger).write(tmp_path / "result"))
    slip = slip_figure(folder, build_trajectory(folder, shoot(folder)))
    # Outer gears run opposite: no slip when 30 mm · ball = -6 mm · finger.
    assert slip.value == pytest.approx(abs(0.03 * ball + TIP * finger), abs=2e-6)
    assert slip.by_interval is not None
    np.testing.assert_allclose(slip.by_interval.sum(axis=1).max(), slip.value, rtol=1e-9)
    assert gap_at_samples(folder, sample_placements(folder)).value < 1e-12


def _pinched(directory: Path, force: np.ndarray) -> Folder:
    scene = geared(directory, 0.0, 0.0)
    forces = np.zeros((11, 2, 3))
    forces[:, 0] = force
    return read_folder(scene.moved(contact_force=forces).write(directory / "result"))


def test_friction_is_tangential_less_mu_normal_over_the_weight(tmp_path: Path) -> None:
    folder = _pinched(tmp_path, np.array([2.0, 0.6, 0.8]))
    excess, use, pull = friction_figures(folder, sample_placements(folder))
    weight = 0.2 * 9.81
    assert excess.value == pytest.approx((1.0 - 0.5 * 2.0) / weight, abs=1e-12)
    assert use.value == pytest.approx(1.0)
    assert pull.value == pytest.approx(-2.0 / weight)


def test_pull_is_the_normal_force_outwards(tmp_path: Path) -> None:
    folder = _pinched(tmp_path, np.array([-1.0, 0.0, 0.3]))
    excess, use, pull = friction_figures(folder, sample_placements(folder))
    weight = 0.2 * 9.81
    assert pull.value == pytest.approx(1.0 / weight)
    assert excess.value == pytest.approx(0.3 / weight)
    assert not pull.holds
    assert "contact 'left'" in pull.reason
    assert np.isinf(use.value)


def test_runs_last_from_touch_to_lift(tmp_path: Path) -> None:
    active = np.zeros((11, 2), dtype=bool)
    active[1:4, 0] = active[8:, 0] = True
    folder = read_folder(plain(read_task(tmp_path, SPHERE), TIME, contact_active=active).write(tmp_path / "result"))
    path = build_trajectory(folder, shoot(folder))
    assert active_runs(folder, path, 0) == [(1, 4), (8, 10)]
    assert active_runs(folder, path, 1) == []


@pytest.mark.parametrize("lifted", [False, True])
def test_a_contact_that_only_lets_go_has_not_been_lifted(tmp_path: Path, lifted: bool) -> None:
    """Or its slip would count anew, however far it has come."""
    folder = _on_ground(tmp_path, 0.06 * TIME, 0 * TIME)
    arrays = dict(np.load(folder.path / "motion.npz"))
    arrays["contact_active"][5, 2] = False
    arrays["time"][6] = arrays["time"][5] + 1e-4  # in which nothing falls far
    for name in ("object_position", "contact_point_link"):
        arrays[name][6] = arrays[name][5]
    if lifted:
        arrays["object_position"][5, 2] = 2e-3
    np.savez(folder.path / "motion.npz", **arrays)
    folder = read_folder(folder.path)
    path = build_trajectory(folder, shoot(folder))
    assert active_runs(folder, path, 2) == ([(0, 5), (6, 10)] if lifted else [(0, 10)])
    assert slip_figure(folder, path).value == pytest.approx(0.03 if lifted else 0.06, abs=1e-4)
