"""Sixty of the mutants, of a small certified design: the same each time, and nothing of them goes wrong."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from fuzz_results import MEGABYTES, WAYS, fuzz, read_in_every_way

from casadi_hands.export.commands import commanded
from casadi_hands.export.design import Design
from casadi_hands.task import Task
from tests.verify.fixture import carried


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scene = carried(tmp_path_factory.mktemp("task"))
    motion = commanded(scene.task, scene.hand, scene.motion)
    folder = tmp_path_factory.mktemp("good")
    Design(task=scene.task, status="certified", hand=scene.hand, motion=motion).save(folder)
    return folder


def test_spoilt_folders_are_refused_or_read_and_nothing_else(good: Path) -> None:
    outcomes = list(fuzz([good], range(60), seed=0, ways=["audit", "load", "view"]))
    wrong = [
        (each.number, each.spoilt, reading)
        for each in outcomes
        for reading in each.readings
        # How long it takes depends on what else the machine does.
        if reading.wrong not in ("", "slow")
    ]
    assert wrong == []
    assert max(each.megabytes for each in outcomes) < MEGABYTES
    found = [reading.what for each in outcomes for reading in each.readings]
    assert found.count("refused") > len(found) / 3
    assert "ok" in found
    assert "certified" in found
    again = list(fuzz([good], range(3), seed=0, ways=["load"]))
    assert [each.spoilt for each in again] == [each.spoilt for each in outcomes[:3]]


def test_what_goes_wrong_is_counted(good: Path) -> None:
    def raises(folder: Path, task: Task) -> str:
        raise TypeError("not this")

    def dies(folder: Path, task: Task) -> str:
        os.kill(os.getpid(), signal.SIGKILL)
        return "ok"

    def takes_all(folder: Path, task: Task) -> str:
        return str(len(bytes(64 << 30)))

    task = Design.load(good).task
    ways = {"raises": raises, "takes all": takes_all, "load": WAYS["load"]}
    readings, _ = read_in_every_way(good, task, ways)
    assert [(each.way, each.wrong) for each in readings] == [
        ("raises", "traceback"),
        ("takes all", "traceback"),
        ("load", ""),
    ]
    assert "not this" in readings[0].message
    assert "MemoryError" in readings[1].message
    readings, _ = read_in_every_way(good, task, {"dies": dies})
    assert [each.wrong for each in readings] == ["ended"]
