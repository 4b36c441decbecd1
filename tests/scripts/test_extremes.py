"""Extreme and random tasks are tasks, and what a person cannot use is seen."""

from __future__ import annotations

from dataclasses import replace

import pytest
from extreme_tasks import EXTREME, text_of
from extremes import HEAD, faults, row
from memory import HEAD as MEMORY_HEAD
from memory import row as memory_row
from memory import tasks
from overnight import ELSE, WAYS, way_of
from random_tasks import random_task

from casadi_hands.errors import TaskError
from casadi_hands.task import parse_task, task_to_yaml
from tests.export.example import example_design


@pytest.mark.parametrize("kind", EXTREME)
def test_extreme_tasks_are_tasks_and_come_back_the_same(kind: str) -> None:
    task = parse_task(text_of(kind))
    assert task.name == kind
    assert parse_task(task_to_yaml(task)) == task


def test_there_are_26_of_them() -> None:
    assert len(EXTREME) == 26


@pytest.mark.parametrize(
    ("reason", "seen"),
    [
        ("", "no reason"),
        ("the grasp slips; try more friction", ""),
        ("the grasp slips", "says nothing to try"),
        (".../casadi/core/nlpsol.cpp:887: failed; try another seed", "says '/casadi/core'"),
        ("/usr/lib/libipopt failed; try another seed", "says '/usr/lib'"),
        ("it weighs nan kg; try another seed", "says 'nan'"),
        ("the solve broke off: ValueError: no; try another seed", "says"),
        ("it needs 3 N·m/rad and 4 m/s; try " + "x" * 1200, "characters"),
        ("an infinite, nanometric error; try less", ""),
    ],
)
def test_what_a_person_cannot_use_is_seen(reason: str, seen: str) -> None:
    design = replace(example_design(), status="failed", reason=reason)
    found = faults(design)
    assert len(found) == bool(seen)
    assert all(seen in fault for fault in found)
    assert faults(replace(design, status="certified")) == []
    assert len(row("kind", design, "", 1.0)) == len(HEAD)


def test_a_number_gives_one_random_task() -> None:
    texts = [random_task(number) for number in range(40)]
    assert texts == [random_task(number) for number in range(40)]
    assert len(set(texts)) == 40
    given = 0
    for text in texts:
        try:
            parse_task(text)
        except TaskError:
            continue
        given += 1
    assert given > 30


def test_each_way_to_end_is_told_from_all_else() -> None:
    design = replace(example_design(), certificate={"slip": {"holds": True}}, reason="it slips; try more friction")
    assert way_of(replace(design, status="certified"), "")[0] == WAYS[0]
    dropped = {"replay_dropped": {"holds": False}}
    assert way_of(replace(design, status="feasible", certificate=dropped), "")[0] == WAYS[1]
    assert way_of(replace(design, status="feasible", certificate={"slip": {"holds": False}}), "")[0] == WAYS[2]
    both = dropped | {"slip": {"holds": False}}
    assert way_of(replace(design, status="feasible", certificate=both), "")[0] == WAYS[2]
    assert way_of(replace(design, status="failed"), "")[0] == WAYS[3]
    assert way_of(replace(design, status="failed", reason=""), "")[0] == ELSE
    assert way_of(design, "stopped after 30 min") == (ELSE, "stopped after 30 min")


def test_growth_is_that_after_caches_are_filled() -> None:
    sizes = [100.0] + [200.0 + 0.5 * k for k in range(19)]
    line = memory_row("floating", sizes, {"feasible"})
    assert len(line) == len(MEMORY_HEAD)
    assert line[2:6] == ["200", "204", "209", "512.0"]
    assert len({task.object.mass for task in tasks(5)}) == 5
