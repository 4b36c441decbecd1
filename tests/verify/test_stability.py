"""How stiff joints must be for a grasp to hold itself, against closed forms and the energy of rolling motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh, null_space
from scipy.spatial.transform import Rotation

from casadi_hands.problem.hand import Finger, Link
from casadi_hands.verify.figures.grasp import straight
from casadi_hands.verify.figures.stability import Mode, Stability
from casadi_hands.verify.figures.stiffness import stability_figures
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.shapes import Capsule
from tests.verify.fixture import TIP, Scene, carried, plain, read_task

TIME = np.linspace(0.0, 1.0, 11)
RADIUS, WEIGHT = 0.03, 0.2 * 9.81
BALL = """
name: ball
object: {{mass: 0.2, shapes: [{{sphere: {{center: [0, 0, 0], radius: {radius}}}}}], center_of_mass: {center}}}
palm: {{radius: 0.05, position: [0, 0, -0.5], facing: [0, 0, 1]}}
motion: [{{at: 0, position: [0, 0, 0]}}, {{at: 1, position: [0, 0, 0]}}]
fingers: {{left: {{touches: [-{radius}, 0, 0]}}, right: {{touches: [{radius}, 0, 0]}}}}
hand: {{joint_limits: [-180, 180], link_radius: 0.006, link_length: [0.001, 1]}}
fingertip: {{torsion: {torsion}}}
"""


def planar(
    directory: Path,
    fingers: Sequence[tuple[tuple[float, float], Sequence[float], Sequence[float]]],
    forces: Sequence[tuple[float, ...]],
    center: Sequence[float] = (0, 0, 0),
    torsion: float = 0.0,
    scale: float = 1.0,
) -> Folder:
    """A ball about the origin of the palm's frame, between fingers that all bend about y; nothing moves.

    Args:
        directory: for the files.
        fingers: x and z of the base, lengths and angles of each: at zero angles they point along z.
        forces: (3,) N, on the object.
        center: of mass.
        torsion: of the fingertips, m.
        scale: of all lengths.
    """
    radius, tip, center = scale * RADIUS, scale * TIP, scale * np.asarray(center)
    task = read_task(directory, BALL.format(radius=radius, center=center.tolist(), torsion=torsion))
    made = tuple(
        Finger(name, (scale * x, 0.0, scale * z), tuple(Link(scale * each, tip, (0.0, 1.0, 0.0)) for each in lengths))
        for name, ((x, z), lengths, _) in zip(task.fingers, fingers, strict=True)
    )
    scene = plain(task, TIME)
    hand = replace(scene.hand, fingers=made)
    side = np.array([[-radius, 0, 0], [radius, 0, 0]]) - center
    scene = Scene(task, hand, scene.motion).moved(
        object_position=np.tile(center, (11, 1)),
        base_position=np.zeros((11, 3)),
        base_orientation=np.tile([1.0, 0.0, 0.0, 0.0], (11, 1)),
        joint_names=hand.joint_names,
        joint_angles=np.tile(np.concatenate([angles for _, _, angles in fingers]), (11, 1)),
        contact_link=tuple(f"finger{i}_link{len(lengths) - 1}" for i, (_, lengths, _) in enumerate(fingers)),
        contact_active=np.ones((11, 2), bool),
        contact_force=np.tile(np.asarray(forces, float), (11, 1, 1)),
        contact_point_object=np.tile(side, (11, 1, 1)),
    )
    return read_folder(scene.write(directory / "result"))


def inward(length: float) -> list[tuple[tuple[float, float], list[float], list[float]]]:
    """One-joint fingers that point at each other, with the ball between their tips."""
    base = RADIUS + TIP + length
    return [((-base, 0.0), [length], [np.pi / 2]), ((base, 0.0), [length], [-np.pi / 2])]


def squeeze(force: float) -> list[tuple[float, ...]]:
    return [(force, 0.0, 0.0), (-force, 0.0, 0.0)]


def first(folder: Folder) -> Mode:
    """The mode at the first sample; all samples are alike."""
    modes = Stability(folder).modes()
    assert {round(mode.stiffness, 9) for mode in modes} == {round(modes[0].stiffness, 9)}
    return modes[0]


@pytest.mark.parametrize(("force", "length"), [(1.0, 0.05), (4.0, 0.05), (1.0, 0.02)])
def test_fingers_that_point_at_each_other_buckle_like_columns(tmp_path: Path, force: float, length: float) -> None:
    """Two bars of length L with round ends r press a ball R with F.

    Where both turn the same way by s, the tips are L s off the line, the ball rolls on them, and contacts are where
    the normals are: R L s / (R + r) off it. Force times lever, on the fingers and on the ball that has turned by
    (L + r) s / R, comes to 2 F L (1 + L / (R + r)) s; two springs resist with 2 k s. Turning against each other they
    carry the ball along, which asks for F (L + r²/(R + r)) only.
    """
    mode = first(planar(tmp_path, inward(length), squeeze(force)))
    together, against = force * length * (1 + length / (RADIUS + TIP)), force * (length + TIP**2 / (RADIUS + TIP))
    assert together > against
    assert mode.stiffness == pytest.approx(together, rel=1e-4)
    # The ball turns about y where it is.
    assert np.abs(mode.twist[[0, 1, 2, 3, 5]]).max() < 1e-6 * abs(mode.twist[4])
    # The fingertips' stiffness is the joints' over the square of the lever.
    assert mode.tips == pytest.approx(together / (length + TIP) ** 2, rel=1e-4)


def test_pushed_from_the_side_fingers_need_no_stiffness(tmp_path: Path) -> None:
    """Hinges below the ball: the bars' flanks stay beside it, and contacts move to where the forces turn it back.

    Both turn by s, the ball goes along by h s and turns back by r s / R: the squeeze resists with 2 F (R + r) s.
    """
    side = RADIUS + TIP
    fingers = [((-side, -0.04), [0.08], [0.0]), ((side, -0.04), [0.08], [0.0])]
    mode = first(planar(tmp_path, fingers, squeeze(3.0)))
    assert mode.stiffness == pytest.approx(-3.0 * (RADIUS + TIP), rel=1e-4)
    assert mode.free == pytest.approx(0.0, abs=1e-12)


def test_forces_scale_the_stiffness_and_so_do_lengths(tmp_path: Path) -> None:
    one = first(planar(tmp_path / "a", bent(), PUSHES, CENTER))
    firm = first(planar(tmp_path / "b", bent(), [tuple(7 * x for x in force) for force in PUSHES], CENTER))
    large = first(planar(tmp_path / "c", bent(), PUSHES, CENTER, scale=10.0))
    assert one.stiffness > 0.0
    assert firm.stiffness == pytest.approx(7 * one.stiffness, rel=1e-6)
    assert large.stiffness == pytest.approx(10 * one.stiffness, rel=1e-4)
    assert (firm.tips, large.tips) == pytest.approx((7 * one.tips, one.tips / 10), rel=1e-4)


# A finger of three joints, whose tip presses from the left, and one of two, the flank of which presses from the right.
CENTER, PUSHES = (0.004, 0.0, 0.007), [(2.0, 0.0, 0.3), (-2.4, 0.0, 0.9)]


def bent() -> list[tuple[tuple[float, float], list[float], list[float]]]:
    left, right = np.array([-RADIUS - TIP, 0.002]), RADIUS + TIP
    lengths, angles = [0.04, 0.03, 0.025], np.array([-0.5, 0.9, 0.6])
    reach = sum(length * np.array([np.sin(a), np.cos(a)]) for length, a in zip(lengths, np.cumsum(angles), strict=True))
    x, z = left - reach
    return [
        ((float(x), float(z)), lengths, angles.tolist()),
        ((right - 0.03 * np.sin(0.4), -0.02 - 0.03 * np.cos(0.4)), [0.03, 0.06], [0.4, -0.4]),
    ]


class Rolling:
    """Ball and fingers in the plane of x and z: coordinates are the centre of mass, the turn about y, the joints."""

    def __init__(self, fingers: Any, center: Any) -> None:
        self.fingers = fingers
        self.center = np.array([center[0], center[2]])
        self.start = np.concatenate([self.center, [0.0], *[angles for _, _, angles in fingers]])

    def rows(self, x: np.ndarray) -> np.ndarray:
        """(4, n) velocity of the ball less that of each finger at their contact."""
        cos, sin = np.cos(x[2]), np.sin(x[2])
        middle = x[:2] - np.array([[cos, sin], [-sin, cos]]) @ self.center
        found, column = [], 3
        for base, lengths, _ in self.fingers:
            joints, at, turned = [], np.array(base), 0.0
            for length, angle in zip(lengths, x[column : column + len(lengths)], strict=True):
                joints.append(at)
                turned += angle
                along = np.array([np.sin(turned), np.cos(turned)])
                at = at + length * along
            nearest = joints[-1] + np.clip((middle - joints[-1]) @ along, 0.0, lengths[-1]) * along
            contact = middle + RADIUS * (nearest - middle) / np.linalg.norm(nearest - middle)
            row = np.zeros((2, len(x)))
            row[:, :2], row[:, 2] = np.eye(2), self.turned(contact - x[:2])
            for joint in joints:
                row[:, column] = -self.turned(contact - joint)
                column += 1
            found.append(row)
        return np.vstack(found)

    @staticmethod
    def turned(arm: np.ndarray) -> np.ndarray:
        """Velocity of a point that turns about y with 1 rad/s."""
        return np.array([arm[1], -arm[0]])

    def rolled(self, way: np.ndarray, length: float, steps: int = 40) -> np.ndarray:
        """Where a motion that rolls leads, that sets out along ``way``."""

        def slope(x: np.ndarray) -> np.ndarray:
            rows = self.rows(x)
            slope: np.ndarray = way - np.linalg.pinv(rows) @ (rows @ way)
            return slope

        x, h = self.start.copy(), length / steps
        for _ in range(steps):
            middle = x + h / 2 * slope(x)
            x = x + h * slope(middle)
        return x


def test_it_is_where_the_energy_of_a_rolling_motion_ceases_to_have_a_minimum(tmp_path: Path) -> None:
    """Springs, the torques that motors exert, and all that the contacts balance have a potential in the plane.

    Contacts that roll do no work. So along rolling motions, integrated over a finite way, the energy has a minimum
    with joints stiffer than said, and none with softer ones.
    """
    rolling, forces = Rolling(bent(), CENTER), np.array(PUSHES)[:, [0, 2]].ravel()
    rows = rolling.rows(rolling.start)
    balanced = -rows.T @ forces  # what else acts: on the ball, and by the motors
    ways, h = null_space(rows), 0.01

    def energy(x: np.ndarray) -> float:
        return float(-balanced @ (x - rolling.start))

    def curvature(way: np.ndarray) -> float:
        return sum(energy(rolling.rolled(way, s * h)) for s in (1.0, -1.0)) / h**2

    count = ways.shape[1]
    bending = np.diag([curvature(way) for way in ways.T])
    for i in range(count):
        for j in range(i):
            both = curvature(ways[:, i] + ways[:, j]) - bending[i, i] - bending[j, j]
            bending[i, j] = bending[j, i] = both / 2
    moved = ways[3:]
    needed = float(eigh(-bending, moved.T @ moved, eigvals_only=True)[-1])
    assert count == 4
    assert needed > 0.01
    assert first(planar(tmp_path, bent(), PUSHES, CENTER)).stiffness == pytest.approx(needed, rel=2e-3)


@pytest.mark.parametrize("rise", [0.003, -0.003])
def test_what_stands_above_the_line_of_two_contacts_falls_over_and_what_hangs_does_not(
    tmp_path: Path, rise: float
) -> None:
    forces = [(2.0, 0.0, WEIGHT / 2), (-2.0, 0.0, WEIGHT / 2)]
    folder = planar(tmp_path, inward(0.05), forces, (0.0, 0.0, rise))
    figures = {figure.name: figure for figure in stability_figures(folder)}
    if rise < 0.0:
        assert "free_spin" not in figures
        return
    # Weight times the height of the centre of mass, for each radian.
    assert figures["free_spin"].value == pytest.approx(WEIGHT * rise, rel=0.011)
    assert figures["free_spin"].limit is None
    assert "the object turns between its contacts, which no joint resists" in figures["free_spin"].text


def test_torsion_keeps_it_from_falling_over(tmp_path: Path) -> None:
    forces = [(2.0, 0.0, WEIGHT / 2), (-2.0, 0.0, WEIGHT / 2)]
    for torsion, free in ((0.0001, True), (0.001, False)):
        folder = planar(tmp_path / str(torsion), inward(0.05), forces, (0.0, 0.0, 0.003), torsion)
        # Until 5 degrees each tip is a spring that then gives all that it has beside the force that lifts.
        stiff = 2 * torsion * np.sqrt(2.0**2 - (WEIGHT / 2 / 0.5) ** 2) / np.deg2rad(5.0)
        assert (stiff < WEIGHT * 0.003) == free
        assert (first(folder).free > 0.0) == free


def test_soft_fingertips_never_need_more_than_hard_ones(tmp_path: Path) -> None:
    scene = carried(tmp_path / "task", hard=True)
    needed = []
    for torsion in (0.0, 1e-4, 1e-3, 1e-2):
        tip = scene.task.fingertip.model_copy(update={"torsion": torsion})
        task = scene.task.model_copy(update={"fingertip": tip})
        folder = read_folder(replace(scene, task=task).write(tmp_path / str(torsion)))
        needed.append([mode.stiffness for mode in Stability(folder).modes()])
    for soft, hard in zip(needed[1:], needed[:-1], strict=True):
        assert np.all(np.array(soft) < np.array(hard) + 1e-9)
    assert max(needed[-1]) < 0.8 * max(needed[0])


def test_the_figure_is_the_worst_sample_s_and_says_what_the_object_does(tmp_path: Path) -> None:
    folder = planar(tmp_path, inward(0.05), squeeze(4.0))
    figures = {figure.name: figure for figure in stability_figures(folder)}
    least, tips = figures["least_stiffness"], figures["least_tip_stiffness"]
    assert least.value == pytest.approx(first(folder).stiffness)
    assert (least.limit, tips.limit) == (1.0, None)
    assert least.text == (
        f"the object turns about an axis 90° from the palm's at 0 s unless joints have {least.value:.3g} N·m/rad"
    )
    # Newtons per metre in the object's weights per millimetre.
    assert tips.value == pytest.approx(first(folder).tips / 1000 / WEIGHT)
    assert not replace(least, value=1.1).holds


GROUNDED = """
name: bar
object: {{mass: 0.2, shapes: [{{capsule: {{start: [-0.04, 0, 0], end: [0.04, 0, 0], radius: 0.02}}}}]}}
palm: {{radius: 0.05, position: [0, 0, 0.5], facing: [0, 0, -1]}}
motion: [{{at: 0, position: [0, 0, {height}]}}, {{at: 1, position: [0, 0, {height}]}}]
fingers: {{one: {{touches: [0, 0.02, 0]}}, two: {{touches: [0, -0.02, 0]}}}}
ground: {{height: 0}}
"""


@pytest.mark.parametrize("sticks", [True, False])
@pytest.mark.parametrize("tilt", [0.0, 5.0])
def test_a_bar_that_lies_on_the_ground_rolls_and_does_not_tip(tmp_path: Path, tilt: float, sticks: bool) -> None:
    """Where it does not stick it slides and tips, and cannot leave the ground all the same."""
    task = read_task(tmp_path, GROUNDED.format(height=0.02 + 0.04 * np.sin(np.deg2rad(tilt))))
    scene = plain(task, TIME)
    active = np.tile([False, False, True], (11, 1))
    forces = np.zeros((11, 3, 3))
    forces[:, 2, 2] = WEIGHT
    turn = Rotation.from_euler("y", tilt, degrees=True)
    points = np.zeros((11, 3, 3))
    points[:, 2] = [0.0 if tilt == 0.0 else 0.04, 0.0, -0.02]
    folder = read_folder(
        scene.moved(
            object_orientation=np.tile(turn.as_quat(scalar_first=True), (11, 1)),
            contact_names=("one", "two", "ground"),
            contact_link=("finger0_link0", "finger1_link0", "ground"),
            contact_active=active,
            contact_force=forces,
            contact_point_object=points,
            contact_point_link=np.zeros((11, 3, 3)),
        ).write(tmp_path / "result")
    )
    stability = Stability(folder)
    rows, _, _ = stability.rows(0, sticks)
    free = null_space(rows / np.r_[np.full(3, 0.06), np.ones(rows.shape[1] - 3)])[:6]
    palm = Rotation.from_quat(folder.motion.base_orientation[0], scalar_first=True)
    spins = np.linalg.matrix_rank(palm.apply(free[3:].T)[:, 1:2], tol=1e-6)
    # About y, across its axis: not while it lies flat.
    assert spins == (1 if tilt or not sticks else 0)
    still = free @ null_space(free[3:]) if free.shape[1] > 3 else np.zeros((6, 1))
    moved = palm.apply(still[:3].T)
    assert np.linalg.matrix_rank(moved, tol=1e-6) == (0 if sticks else 2)
    assert np.abs(moved[:, 2]).max() < 1e-9


@pytest.mark.parametrize(("degrees", "lies"), [(0.0, True), (2.0, True), (10.0, False), (20.0, False)])
@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_links_lie_along_bars_that_they_hardly_cross(degrees: float, lies: bool, share: float) -> None:
    bar, radius = Capsule(np.array([-0.1, 0.0, 0.0]), np.array([0.1, 0.0, 0.0]), 0.01), 0.005
    way = np.array([np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees)), 0.0])
    start = np.array([0.0, 0.0, 0.015]) - share * 0.03 * way
    sides = straight(bar, start, start + 0.03 * way, share, 0.1 * radius, radius)
    assert sides == (lies and share > 0.0, lies and share < 1.0)


@pytest.mark.parametrize("off", [0.0, 2e-4, 3e-4, 4e-4, 1e-3])
def test_links_do_not_lie_along_a_ball(off: float) -> None:
    ball, radius = Capsule(np.zeros(3), np.zeros(3), 0.03), 0.006
    start, end = (np.array([x - off, 0.0, 0.036]) for x in (-0.02, 0.03))
    assert straight(ball, start, end, 0.4, 0.1 * radius, radius) == (False, False)


def test_ground_that_may_give_way_holds_nothing_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A ball on the ground between two fingers that turn level with it buckles as it does without the ground."""
    force, length = 1.0, 0.05
    made = planar(tmp_path / "without", inward(length), squeeze(force))
    motion, turn = made.motion, Rotation.from_euler("x", 90, degrees=True)  # what is level was across
    text = BALL.format(radius=RADIUS, center=[0, 0, 0], torsion=0.0) + f"ground: {{height: {-RADIUS}}}\n"
    task = read_task(tmp_path / "task", text.replace("-0.5], facing: [0, 0, 1]", "0.5], facing: [0, 0, -1]"))
    upright = np.tile(turn.as_quat(scalar_first=True), (11, 1))

    def beside(values: np.ndarray, last: Sequence[float]) -> np.ndarray:
        return np.concatenate([values, np.tile(np.array(last, values.dtype), (11, 1, 1))], axis=1)

    scene = plain(task, TIME)
    fingers = tuple(
        Finger(name, (base[0], 0.0, base[1]), (Link(each[0], TIP, (0.0, 1.0, 0.0)),))
        for name, (base, each, _) in zip(task.fingers, inward(length), strict=True)
    )
    scene = Scene(task, replace(scene.hand, fingers=fingers), scene.motion).moved(
        object_position=np.zeros((11, 3)),
        object_orientation=upright,
        base_position=np.zeros((11, 3)),
        base_orientation=upright,
        joint_names=motion.joint_names,
        joint_angles=motion.joint_angles,
        contact_names=(*motion.contact_names, "ground"),
        contact_link=(*motion.contact_link, "ground"),
        contact_active=np.ones((11, 3), bool),
        contact_force=beside(turn.apply(motion.contact_force.reshape(-1, 3)).reshape(11, 2, 3), [0, 0, 1e-9]),
        contact_point_object=beside(motion.contact_point_object, [0, -RADIUS, 0]),
        contact_point_link=beside(motion.contact_point_link, [0, 0, -RADIUS]),
    )
    grounded = Stability(read_folder(scene.write(tmp_path / "with")))
    together = force * length * (1 + length / (RADIUS + TIP))
    assert [mode.stiffness for mode in grounded.modes()] == pytest.approx([together] * 11, rel=1e-4)

    # Where the object would rather be held, or rather not, the one that asks for more counts, and says what it does.
    one, other = Mode(0.1, 5.0, np.zeros(6), 0.3), Mode(0.2, 3.0, np.ones(6), 0.7)
    for stuck, loose in ((one, other), (other, one)):
        monkeypatch.setattr(grounded, "_modes", lambda sticks, both=(loose, stuck): [both[sticks]])
        (found,) = grounded.modes()
        assert (found.stiffness, found.tips, found.free) == (0.2, 3.0, stuck.free)
        assert found.twist is other.twist


BOX = """
name: box
object: {{mass: 0.2, shapes: [{{box: {{center: [0, 0, 0], size: [0.06, 0.06, 0.06]}}}}]}}
palm: {{radius: 0.05, position: [0, 0, -0.5], facing: [0, 0, 1]}}
motion: [{{at: 0, position: [0, 0, 0]}}, {{at: 1, position: [0, 0, 0]}}]
fingers: {{left: {{touches: [-0.03, 0, {height}]}}, right: {{touches: [0.03, 0, {height}]}}}}
hand: {{joint_limits: [-180, 180], link_radius: 0.006, link_length: [0.001, 1]}}
"""


@pytest.mark.parametrize("height", [0.0, 0.01])
def test_fingers_that_lie_along_a_box_hold_it(tmp_path: Path, height: float) -> None:
    """Neither can tip on its face, and no joint moves: springs have nothing to make up for.

    Where they meet along lines, nearest points are anywhere on these: contacts are where the plan has them.
    """
    task = read_task(tmp_path, BOX.format(height=height))
    long, low = 0.1, -0.06
    hand = tuple(
        Finger(name, (side * (0.03 + TIP), 0.0, low), (Link(long, TIP, (0.0, 1.0, 0.0)),))
        for name, side in (("left", -1.0), ("right", 1.0))
    )
    scene = plain(task, TIME)
    points = np.array([[-0.03, 0.0, height], [0.03, 0.0, height]])
    there = np.array([[TIP, 0.0, height - low], [-TIP, 0.0, height - low]])
    folder = read_folder(
        Scene(task, replace(scene.hand, fingers=hand), scene.motion)
        .moved(
            object_position=np.zeros((11, 3)),
            base_position=np.zeros((11, 3)),
            base_orientation=np.tile([1.0, 0.0, 0.0, 0.0], (11, 1)),
            joint_names=("finger0_joint0", "finger1_joint0"),
            joint_angles=np.zeros((11, 2)),
            contact_link=("finger0_link0", "finger1_link0"),
            contact_active=np.ones((11, 2), bool),
            contact_force=np.tile([squeeze(4.0)], (11, 1, 1)),
            contact_point_object=np.tile(points, (11, 1, 1)),
            contact_point_link=np.tile(there, (11, 1, 1)),
        )
        .write(tmp_path / "result")
    )
    stability = Stability(folder)
    assert stability.lying.flat.all()
    free = null_space(stability.rows(0)[0], rcond=1e-9)
    assert free.shape[1] > 0
    assert np.abs(free[6:]).max() < 1e-9
    assert first(folder).stiffness == pytest.approx(0.0, abs=1e-6)
    assert np.array(Stability(folder).first)[:, 0, :, 2] == pytest.approx(height)
