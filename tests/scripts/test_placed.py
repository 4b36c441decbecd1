"""The script that takes contacts out of tasks, on records with known numbers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import placed
import pytest

from casadi_hands.task import load_task, parse_task
from tests.export.example import example_design

FILE = Path("problems/circle.yaml")


def record(status: str, joints: list[int], **more: Any) -> dict[str, Any]:
    hand = {"fingers": [{"links": [{}] * count} for count in joints]}
    return {
        "task": "t",
        "status": status,
        "reason": "",
        "hand": hand,
        "degrees_of_freedom": sum(joints),
        "seconds": {"total": 9.6},
        "placement": {},
        **more,
    }


@pytest.mark.parametrize(("fingers", "names", "optional"), [("same", 2, 0), ("auto", 5, 3)])
def test_contacts_are_taken_out_and_nothing_else(fingers: str, names: int, optional: int) -> None:
    task = parse_task(placed.asked(FILE.read_text(), fingers), name="circle")
    assert len(task.fingers) == names
    assert sum(bool(finger.optional) for finger in task.fingers.values()) == optional
    assert not task.is_placed
    given = load_task(FILE)
    assert (task.object, task.motion, task.palm) == (given.object, given.motion, given.palm)


def test_a_row() -> None:
    told = {"sets": [{}, {}], "chosen": 1}
    cells = placed.row(
        record("certified", [2, 3], placement=told, seconds={"total": 9.6, "placement": 3.2}),
        record("feasible", [3, 3]),
    )
    assert cells == ["t", "2", "certified", "2+3", "3+3, not certified", "2, number 2 taken", "3", "10", "–"]


def test_joints_are_counted_where_both_are_certified() -> None:
    pairs = [
        (record("certified", [2, 2]), record("certified", [2, 3])),
        (record("failed", [3, 3]), record("certified", [2, 3])),
        (record("certified", [1, 1]), record("feasible", [2, 3])),
        (record("certified", [1, 1]), None),
    ]
    assert placed.in_all(pairs) == "3 of 4 certified; 4 joints where given contacts take 5"


def test_what_is_solved_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def solve(task: Any, folder: Path, *_: Any) -> Any:
        calls.append(task)
        design = example_design()
        design.save(folder)
        (folder / "placement.json").write_text(json.dumps({"sets": [], "chosen": 0}))
        return design

    monkeypatch.setattr(placed, "solve_apart", solve)
    text = placed.asked(FILE.read_text(), "same")
    for _ in range(2):
        found = placed.solved(text, FILE, tmp_path / "circle", 1, None)
    assert found["placement"]["chosen"] == 0
    assert len(calls) == 1
    placed.solved(placed.asked(FILE.read_text(), "auto"), FILE, tmp_path / "circle", 1, None)
    assert len(calls) == 2
