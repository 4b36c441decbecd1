"""A solve in a process of its own is told of, can be stopped, and gives what `solve` gives."""

from __future__ import annotations

import sys
import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.cli.studio import SOLVE
from casadi_hands.export.page.robot import Robot
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.pipeline import solve
from casadi_hands.studio.animation import OBJECT, animation_of
from casadi_hands.studio.session import Session
from casadi_hands.studio.solving import Solve, Watched
from casadi_hands.task import load_task
from tests.export.example import example_design


class Heard:
    def __init__(self, *command):
        self.lines, self.end = [], []
        self.solve = Solve(command, self.lines.append, lambda *end: self.end.append(end))

    def wait(self, what, seconds=300.0):
        until = time.monotonic() + seconds
        while not what():
            assert time.monotonic() < until, (self.lines, self.end)
            time.sleep(0.05)


def test_a_task_from_the_studio_is_solved_as_its_file_is(tmp_path):
    session = Session(tmp_path / "new.yaml")
    session.save()
    watched = Watched(tmp_path / "out")
    arguments = [str(session.path), "--out", str(watched.folder), "--until", "floating", "--jobs", "1"]
    heard = Heard(*SOLVE, *arguments)
    heard.wait(lambda: heard.end)
    assert heard.end[0][0] == 0, (heard.lines, heard.end)
    assert any("floating" in line for line in heard.lines)
    assert watched.changed()
    assert not watched.changed()
    mine = solve(load_task(session.path), until="floating", jobs=1, out=tmp_path / "mine")
    with np.load(tmp_path / "out/motion.npz") as one, np.load(tmp_path / "mine/motion.npz") as other:
        assert one.files == other.files
        for name in one.files:
            assert np.array_equal(one[name], other[name]), name
    assert mine.status == "feasible"


def test_a_solve_that_is_stopped_ends_as_by_ctrl_c():
    code = (
        "import signal, sys, time\n"
        "signal.signal(signal.SIGINT, lambda *_: (print('stopped', file=sys.stderr, flush=True), sys.exit(130)))\n"
        "print('going', file=sys.stderr, flush=True)\ntime.sleep(60)"
    )
    heard = Heard(sys.executable, "-c", code)
    heard.wait(lambda: heard.lines)
    assert heard.solve.running
    heard.solve.stop()
    assert not heard.solve.running
    assert heard.lines == ["going", "stopped"]
    assert heard.end == [(130, "")]


def test_a_folder_is_new_when_its_last_file_is_written(tmp_path):
    example_design().save(tmp_path / "out")
    watched = Watched(tmp_path / "out")
    assert not watched.changed()
    example_design().save(tmp_path / "out")
    assert watched.changed()
    (tmp_path / "out/result.json").unlink()
    assert not watched.changed()


def test_bodies_are_where_the_motion_has_them_and_between():
    design = example_design()
    moving = animation_of(design, Robot(hand_urdf(design.hand)))
    motion, which = design.motion, moving.names.index(OBJECT)
    for sample in (0, 7, 20):
        positions, orientations = moving.at(motion.time[sample])
        assert positions[which] == pytest.approx(motion.object_position[sample], abs=1e-12)
        same = abs(orientations[which] @ motion.object_orientation[sample])
        assert same == pytest.approx(1.0, abs=1e-12)
    positions, orientations = moving.at((motion.time[7] + motion.time[8]) / 2)
    assert positions[which] == pytest.approx((motion.object_position[7] + motion.object_position[8]) / 2, abs=1e-12)
    both = Rotation.from_quat(motion.object_orientation[7:9], scalar_first=True)
    turned = Rotation.from_quat(orientations[which], scalar_first=True)
    assert (both[0].inv() * turned).magnitude() == pytest.approx((both[0].inv() * both[1]).magnitude() / 2, abs=1e-9)
    assert np.array_equal(moving.at(99.0)[0], moving.at(moving.end)[0])
