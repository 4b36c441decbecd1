"""Torsional moments of soft fingertips: what they turn, what tips bear, and that they act against the spin."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.export.commands import joint_torques
from casadi_hands.verify.audit import audit_files
from casadi_hands.verify.figures.dynamics import sample_residual, shoot
from casadi_hands.verify.figures.torsion import spin_rates, torsion_figures
from casadi_hands.verify.figures.wrench import disturbance_figure, planned_torques
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.report import Figure
from casadi_hands.verify.trajectory import build_trajectory, place_links, sample_placements
from tests.verify.fixture import NORMALS, SPHERE, Scene, carried, plain, read_task

TIME = np.linspace(0.0, 1.0, 11)
RADIUS, MASS, WEIGHT, FRICTION = 0.03, 0.2, 0.2 * 9.81, 0.5
TORSION = 0.002  # m
FREE = "gravity: [0, 0, 0]" + SPHERE + f"fingertip: {{torsion: {TORSION}}}\n"
# Contacts on the ball's left and right, which press with 3 N.
POINTS = np.tile([[-RADIUS, 0, 0], [RADIUS, 0, 0]], (11, 1, 1))
PRESS, ALONG = 3.0, np.array([[-1.0, 0, 0], [1.0, 0, 0]])


def pressed(
    directory: Path, moments: tuple[float, float] | None, turn: float = 0.0, lift: float = 0.0, text: str = FREE
) -> Folder:
    """A ball between two fingertips, each with a moment about its outward normal, N·m, that turns about the line.

    Args:
        directory: for the files.
        moments: of both; None leaves them out of the file.
        turn: rad, in all, evenly.
        lift: N, of each, along z.
        text: of the task.
    """
    turned = Rotation.from_rotvec(np.outer(turn * TIME, [1.0, 0, 0]))
    given = None if moments is None else np.tile(np.array(moments)[:, None] * ALONG, (11, 1, 1))
    scene = plain(
        read_task(directory, text),
        TIME,
        object_orientation=turned.as_quat(scalar_first=True),
        contact_active=np.ones((11, 2), bool),
        contact_force=np.tile([[PRESS, 0, lift], [-PRESS, 0, lift]], (11, 1, 1)),
        contact_point_object=POINTS,
        contact_moment=given,
    )
    return read_folder(scene.write(directory / "result"))


def figures(folder: Folder) -> dict[str, Figure]:
    path = build_trajectory(folder, shoot(folder))
    return {figure.name: figure for figure in torsion_figures(folder, sample_placements(folder), path)}


@pytest.mark.parametrize("stated", [True, False])
def test_a_constant_moment_turns_a_free_ball_ever_faster(tmp_path: Path, stated: bool) -> None:
    moment, inertia = 4e-5, 0.4 * MASS * RADIUS**2
    turned = Rotation.from_rotvec(np.outer(moment * TIME**2 / (2 * inertia), [1.0, 0, 0]))
    # A left contact's outward normal is -x.
    moments = np.tile([[0.25 * moment, 0, 0], [0.75 * moment, 0, 0]], (11, 1, 1)) if stated else None
    scene = plain(
        read_task(tmp_path, FREE),
        TIME,
        object_orientation=turned.as_quat(scalar_first=True),
        contact_active=np.ones((11, 2), bool),
        contact_force=np.tile([[PRESS, 0, 0], [-PRESS, 0, 0]], (11, 1, 1)),
        contact_point_object=POINTS,
        contact_moment=moments,
    )
    folder = read_folder(scene.write(tmp_path / "result"))
    force, torque = sample_residual(folder, shoot(folder))
    assert force.max() < 1e-12
    due = 0.0 if stated else moment / (WEIGHT * RADIUS)
    assert torque == pytest.approx(np.full(9, due), abs=1e-9)


@pytest.mark.parametrize("lift", [0.0, 0.9])
def test_a_tip_bears_what_its_ellipse_leaves_beside_the_force_along_the_surface(tmp_path: Path, lift: float) -> None:
    most = TORSION * np.sqrt(PRESS**2 - (lift / FRICTION) ** 2)
    for share in (0.5, 1.0, 1.1):
        found = figures(pressed(tmp_path / str(share), (share * most, -0.2 * most), lift=lift))
        over = (share - 1.0) * most / TORSION / WEIGHT
        assert found["torsion_excess"].value == pytest.approx(max(over, 0.0), abs=1e-12)
        assert found["torsion_excess"].holds == (share <= 1.0)
        assert found["torsion_use"].value == pytest.approx(share)
        assert found["torsion_use"].limit is None
    assert "contact 'left' at " in found["torsion_excess"].text


@pytest.mark.parametrize(
    ("share", "off"), [(-1.0, 0.0), (-0.9, 0.1), (-0.8, 0.2), (0.0, 1.0), (0.5, 1.5), (1.0, 2.0), (None, 1.0)]
)
@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_where_a_contact_spins_its_moment_is_at_the_limit_against_the_spin(
    tmp_path: Path, share: float | None, off: float, turn: float
) -> None:
    # The ball turns about x: about the right contact's outward normal, and against the left one's.
    most = TORSION * PRESS
    moments = None if share is None else (-share * turn * most, share * turn * most)
    folder = pressed(tmp_path, moments, turn)
    path = build_trajectory(folder, shoot(folder))
    assert spin_rates(folder, path, 0) == pytest.approx(np.full(10, -turn))
    assert spin_rates(folder, path, 1) == pytest.approx(np.full(10, turn))
    found = figures(folder)
    assert found["torsion_shortfall"].value == pytest.approx(off, abs=1e-9)
    assert found["torsion_shortfall"].holds == (off <= 0.15)
    assert found["torsion_excess"].holds


@pytest.mark.parametrize("share", [-0.8, -0.1, 0.1, 0.3])
def test_a_moment_does_not_drive_a_slow_spin(tmp_path: Path, share: float) -> None:
    moment = share * TORSION * PRESS
    found = figures(pressed(tmp_path, (-moment, moment), 0.4))["torsion_shortfall"]
    assert found.value == pytest.approx(max(share, 0.0), abs=1e-9)
    assert found.holds == (share < 0.15)
    assert ("drives its spin" in found.text) == (share > 0.0)


def test_where_it_hardly_spins_nothing_is_asked(tmp_path: Path) -> None:
    for turn in (0.0, 0.15):
        assert figures(pressed(tmp_path / str(turn), (0.0, 0.0), turn))["torsion_shortfall"].value == 0.0


def test_hard_points_bear_no_moment(tmp_path: Path) -> None:
    hard = FREE.replace(f"torsion: {TORSION}", "torsion: 0")
    assert figures(pressed(tmp_path / "a", None, text=hard)) == {}
    excess = figures(pressed(tmp_path / "b", (1e-6, 0.0), text=hard))["torsion_excess"]
    assert not excess.holds
    assert "at contact 'left'" in excess.text


def test_the_ground_bears_no_moment(tmp_path: Path) -> None:
    above = FREE.replace("position: [0, 0, -0.5], facing: [0, 0, 1]", "position: [0, 0, 0.5], facing: [0, 0, -1]")
    task = read_task(tmp_path, above + f"ground: {{height: {-RADIUS}, touches: [0, 0, {-RADIUS}]}}\n")
    force = np.zeros((11, 3, 3))
    force[:, 2, 2] = WEIGHT
    for moment, holds in ((0.0, True), (1e-5, False)):
        moments = np.zeros((11, 3, 3))
        moments[4, 2, 2] = moment
        scene = plain(task, TIME).moved(
            contact_names=("left", "right", "ground"),
            contact_link=("finger0_link0", "finger1_link0", "ground"),
            contact_active=np.tile([False, False, True], (11, 1)),
            contact_force=force,
            contact_point_object=np.tile([[0, 0, 0], [0, 0, 0], [0, 0, -RADIUS]], (11, 1, 1)),
            contact_point_link=np.tile([[0, 0, 0], [0, 0, 0], [0, 0, -RADIUS]], (11, 1, 1)),
            contact_moment=moments,
        )
        excess = figures(read_folder(scene.write(tmp_path / str(holds))))["torsion_excess"]
        assert excess.holds == holds
    assert "at contact 'ground' at 0.4 s" in excess.text


@pytest.fixture(scope="module")
def held(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return carried(tmp_path_factory.mktemp("held"))


def test_joints_bear_the_moments_too(held: Scene, tmp_path: Path) -> None:
    """Virtual work: torque · dq = force · displacement + moment · turn, by differences of forward kinematics."""
    rng = np.random.default_rng(0)
    moments = 1e-3 * rng.normal(size=held.motion.contact_force.shape)  # not about the normals, which no joint turns
    motion = replace(held.motion, contact_moment=moments)
    folder = read_folder(replace(held, motion=motion).write(tmp_path / "result"))
    torques, base = planned_torques(folder), sample_placements(folder)["palm"]
    for joint in range(6):
        moved = []
        for sign in (1.0, -1.0):
            angles = motion.joint_angles.copy()
            angles[:, joint] += sign * 1e-5
            moved.append(place_links(folder, angles, base[0], base[1]))
        work = np.zeros(len(motion.time))
        for c, link in enumerate(motion.contact_link):
            (ahead, there), (behind, here) = moved[0][link], moved[1][link]
            point = motion.contact_point_link[:, c]
            step = np.einsum("sij,sj->si", ahead - behind, point) + there - here
            turn = Rotation.from_matrix(ahead @ np.swapaxes(behind, 1, 2)).as_rotvec()
            work += np.sum(step * motion.contact_force[:, c] + turn * moments[:, c], axis=1) / 2e-5
        assert torques[:, joint] == pytest.approx(work, abs=1e-8)
    assert joint_torques(held.hand, motion) == pytest.approx(torques, abs=1e-12)
    without = joint_torques(held.hand, replace(motion, contact_moment=None))
    assert np.abs(without - torques).max() > 1e-3


def test_a_moment_off_the_normal_or_of_an_idle_contact_is_refused(held: Scene, tmp_path: Path) -> None:
    moments = held.motion.contact_moment
    assert moments is not None
    turned = Rotation.from_quat(held.motion.object_orientation, scalar_first=True)
    for name, change, words in (
        ("across", turned[5].apply([0.0, 0.0, 2e-3]), "a moment exceeds what the tip bears by .* 'two' at 0.5 s"),
        ("along", turned[5].apply(2e-3 * NORMALS[1]), "a moment exceeds what the tip bears by .* 'two' at 0.5 s"),
    ):
        other = moments.copy()
        other[5, 1] = change
        found = audit_files(held.moved(contact_moment=other).write(tmp_path / name)).figures["torsion_excess"]
        assert not found.holds
        assert re.search(words, found.text)
    active, force = held.motion.contact_active.copy(), held.motion.contact_force.copy()
    active[5, 1], force[5, 1] = False, 0.0
    idle = held.moved(contact_active=active, contact_force=force).write(tmp_path / "idle")
    assert "a contact that is not active has a moment" in audit_files(idle).figures["torsion_excess"].text


def test_two_soft_fingertips_resist_every_small_wrench_and_two_hard_ones_no_spin(tmp_path: Path) -> None:
    radius = {}
    for torsion in (0.0, TORSION, 2 * TORSION):
        text = SPHERE + f"fingertip: {{torsion: {torsion}}}\n"
        folder = pressed(tmp_path / str(torsion), None, lift=WEIGHT / 2, text=text)
        radius[torsion] = disturbance_figure(folder, sample_placements(folder)).value
    assert radius[0.0] == 0.0
    # Pressing with all that the hand may, both resist a twist about their line by at most torsion times that.
    budget = 2.0 * 2 * PRESS / WEIGHT
    assert 0.0 < radius[TORSION] <= TORSION / RADIUS * budget
    assert radius[2 * TORSION] > 1.5 * radius[TORSION]


def test_a_task_s_other_tips_are_other_limits(held: Scene, tmp_path: Path) -> None:
    use = []
    for torsion in (0.00108, 0.00216):
        tip = held.task.fingertip.model_copy(update={"torsion": torsion})
        task = held.task.model_copy(update={"fingertip": tip})
        found = audit_files(replace(held, task=task).write(tmp_path / str(torsion)))
        assert found.figures["torsion_excess"].holds
        use.append(found.figures["torsion_use"].value)
    assert use[0] == pytest.approx(2 * use[1])
