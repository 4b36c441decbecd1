"""Tasks of the thesis, solved whole; what its figures show must be in the motion that is written."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands import Design, load_task, solve
from casadi_hands.problem.motion import Motion
from casadi_hands.task import Task
from casadi_hands.verify import replay

PROBLEMS = Path(__file__).parent.parent / "problems"
ABOUT_THE_TABLE = ("overhead", "from_the_side")
Array = np.ndarray


def certified(name: str, folder: Path) -> Motion:
    """The motion of a task solved with its own seed; it is certified and its replay does not drop the object."""
    design = solve(load_task(PROBLEMS / f"{name}.yaml"), out=folder)
    assert design.status == "certified", design.reason
    assert not replay(folder).dropped
    motion = Design.load(folder).motion
    assert motion is not None
    return motion


@pytest.mark.slow
def test_the_top_finger_lets_go_of_the_capsule_and_takes_its_other_half(tmp_path: Path) -> None:
    breaks_and_takes_anew(certified("half_turn", tmp_path))


def breaks_and_takes_anew(motion: Motion) -> None:
    top = motion.contact_names.index("top")
    changes = np.flatnonzero(np.diff(motion.contact_active[:, top].astype(int)))
    assert [int(motion.contact_active[k + 1, top]) for k in changes] == [0, 1]
    lifted, touched = changes + 1
    before, after = motion.contact_point_object[lifted - 1, top], motion.contact_point_object[touched, top]
    # It pushes one half, rolls with it, and takes the object anew on the other half.
    assert motion.contact_point_object[0, top, 2] > 0.005
    assert np.linalg.norm(after - before) > 0.004
    assert after[2] < -0.002
    assert motion.contact_point_object[-1, top, 2] < -0.005
    others = [c for c in range(3) if c != top]
    assert motion.contact_active[:, others].all()
    # Only two hold it meanwhile: it rests.
    turns = Rotation.from_quat(motion.object_orientation[[lifted, touched]], scalar_first=True)
    assert np.degrees((turns[0].inv() * turns[1]).magnitude()) < 3


@pytest.mark.slow
def test_the_table_carries_the_capsule_that_is_turned_on_it(tmp_path: Path) -> None:
    the_ground_carries(certified("tabletop_rotation_overhead", tmp_path))


def the_ground_carries(motion: Motion) -> None:
    ground = motion.contact_link.index("ground")
    upward = motion.contact_force[:, ground, 2]
    assert upward.min() >= 0
    assert upward.mean() > 0.1 * 0.15 * 9.81
    turn = Rotation.from_quat(motion.object_orientation[[0, len(motion.time) // 2]], scalar_first=True)
    assert np.degrees((turn[0].inv() * turn[1]).magnitude()) == pytest.approx(90, abs=0.6)
    # The capsule lies on the table all the time: its axis is level, a radius above it.
    axes = Rotation.from_quat(motion.object_orientation, scalar_first=True).apply([1, 0, 0])
    assert np.abs(axes[:, 2]).max() < 0.003
    assert np.abs(motion.object_position[:, 2] - 0.02).max() < 1e-4


@pytest.mark.slow
def test_the_pen_draws_its_triangle(tmp_path: Path) -> None:
    assert farthest_from_the_triangle(certified("draw_triangle", tmp_path)) < 0.001


def farthest_from_the_triangle(motion: Motion) -> float:
    turns = Rotation.from_quat(motion.object_orientation, scalar_first=True)
    tip = motion.object_position + turns.apply([0, 0, -0.06])
    corners = np.array([[0, 0, 0], [0.03, 0, 0], [0.015, 0.026, 0], [0, 0, 0]])
    distances = [[_from_segment(point, *side) for side in pairwise(corners)] for point in tip]
    return float(np.min(distances, axis=1).max())


@pytest.mark.slow
def test_a_sphere_is_turned_half_round_either_way_without_letting_go(tmp_path: Path) -> None:
    rolls_half_round(certified("sphere_rotation", tmp_path))


def rolls_half_round(motion: Motion) -> None:
    assert motion.contact_active.all()
    turned = Rotation.from_quat(motion.object_orientation, scalar_first=True)
    about_z = np.unwrap(turned.as_rotvec()[:, 2])
    assert np.degrees([about_z.max(), about_z.min()]) == pytest.approx([180, -180], abs=0.6)


@pytest.mark.slow
def test_the_top_finger_acts_only_against_the_push_towards_the_palm() -> None:
    task = load_task(PROBLEMS / "sphere_rotation_and_translation.yaml")
    pushed, free = (planned(each) for each in (task, task.model_copy(update={"perturbations": []})))
    top = pushed.contact_names.index("top")
    acting = pushed.time[pushed.contact_active[:, top]]
    assert acting.min() == pytest.approx(8)
    assert acting.max() == pytest.approx(12)
    assert not free.contact_active[:, top].any()
    for motion in (pushed, free):
        assert np.delete(motion.contact_active, top, axis=1).all()


@pytest.mark.slow
def test_two_palms_turn_the_capsule_on_the_table_alike() -> None:
    overhead, side = (planned(load_task(PROBLEMS / f"tabletop_rotation_{where}.yaml")) for where in ABOUT_THE_TABLE)
    for name in ("object_position", "object_orientation", "contact_force", "contact_point_object"):
        np.testing.assert_allclose(getattr(overhead, name), getattr(side, name), atol=1e-9)
    # By far more than what is compared above, the object turns where it lies, forces change and contacts creep (m).
    for name, least in (("object_orientation", 1e-3), ("contact_force", 1e-3), ("contact_point_object", 1e-5)):
        assert np.ptp(getattr(overhead, name), axis=0).max() > least


def planned(task: Task) -> Motion:
    """What stage 1 plans for a task."""
    motion = solve(task, until="floating").motion
    assert motion is not None
    return motion


def _from_segment(point: Array, start: Array, end: Array) -> float:
    along = end - start
    fraction = np.clip((point - start) @ along / (along @ along), 0, 1)
    return float(np.linalg.norm(point - start - fraction * along))
