"""The file of a motion."""

from dataclasses import fields, replace

import numpy as np
import pytest

from casadi_hands.errors import DesignError
from casadi_hands.export.arrays import load_motion, save_motion
from tests.export.example import example_motion


def same(one, other):
    return all(np.array_equal(getattr(one, item.name), getattr(other, item.name)) for item in fields(one))


def test_a_motion_comes_back_as_it_was(tmp_path):
    motion = example_motion()
    save_motion(motion, tmp_path / "motion.npz")
    loaded = load_motion(tmp_path / "motion.npz")
    assert same(motion, loaded)
    assert loaded.joint_names == motion.joint_names
    assert loaded.contact_active.dtype == bool


def test_plain_numpy_reads_the_names_and_shapes_of_the_format(tmp_path):
    save_motion(example_motion(), tmp_path / "motion.npz")
    with np.load(tmp_path / "motion.npz") as file:
        shapes = {name: file[name].shape for name in file.files}
        assert list(file["contact_link"]) == ["finger0_link1", "finger1_link1", "finger2_link1"]
    assert shapes == {
        "time": (21,),
        "object_position": (21, 3),
        "object_orientation": (21, 4),
        "base_position": (21, 3),
        "base_orientation": (21, 4),
        "joint_angles": (21, 6),
        "joint_names": (6,),
        "contact_names": (3,),
        "contact_link": (3,),
        "contact_active": (21, 3),
        "contact_force": (21, 3, 3),
        "contact_point_object": (21, 3, 3),
        "contact_point_link": (21, 3, 3),
        "external_force": (21, 3),
        "external_torque": (21, 3),
    }


def test_equal_motions_give_equal_bytes_whatever_their_memory_layout(tmp_path, monkeypatch):
    motion = example_motion()
    save_motion(motion, tmp_path / "one.npz")
    monkeypatch.setattr("time.localtime", lambda *_: (2031, 5, 6, 7, 8, 9, 0, 0, 0))
    turned = replace(motion, joint_angles=np.asfortranarray(motion.joint_angles), time=list(motion.time))
    save_motion(turned, tmp_path / "two.npz")
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()


def test_a_motion_without_a_hand_has_no_joints(tmp_path):
    motion = replace(example_motion(), joint_angles=np.zeros((21, 0)), joint_names=())
    save_motion(motion, tmp_path / "motion.npz")
    assert same(load_motion(tmp_path / "motion.npz"), motion)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joint_angles": np.zeros((21, 5))}, r"joint_names has shape \(6,\); it must be \(J=5\)"),
        ({"contact_force": np.zeros((21, 3))}, r"contact_force has shape \(21, 3\); it must be \(S=21, C=3, 3\)"),
        ({"object_position": np.full((21, 3), np.nan)}, "object_position holds numbers that are not finite"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(tmp_path, change, message):
    with pytest.raises(DesignError, match=message):
        save_motion(replace(example_motion(), **change), tmp_path / "motion.npz")


def test_an_incomplete_file_is_refused(tmp_path):
    np.savez(tmp_path / "motion.npz", time=np.zeros(2))
    with pytest.raises(DesignError, match="lacks object_position"):
        load_motion(tmp_path / "motion.npz")


def test_another_kind_of_file_is_refused(tmp_path):
    (tmp_path / "motion.npz").write_text("not a zip file")
    with pytest.raises(DesignError, match="not a NumPy archive"):
        load_motion(tmp_path / "motion.npz")
