"""The script that shows hands with shared motors beside those with one for every joint, on made-up records."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import motors
import pytest


def record(links: tuple[int, ...], count: int, dropped: int, status: str = "certified") -> dict[str, Any]:
    replay = {
        "mean": {"mm": 0.4, "degrees": 1.26},
        "goals": [{"mm": 0.2, "degrees": 1.0}, {"mm": 0.7, "degrees": 0.5}],
        "perturbed": {str(i): {"dropped": i < dropped} for i in range(31)},
    }
    hand = {"fingers": [{"links": [{}] * n} for n in links], "motors": count}
    return {"task": "a turn", "status": status, "hand": hand, "replays": [replay], "seconds": {"total": 33.3}}


def test_a_row_has_both_hands() -> None:
    cells = motors.row(record((2, 1), 2, 3), record((2, 2), 4, 0))
    numbers = ["0.40 mm, 1.3°", "0.70 mm, 1.0°", "3/31", "2+2", "0.40 mm, 1.3°", "33"]
    assert cells == ["a turn", "certified", "2+1", "2", *numbers]
    bare = {**record((), 0, 0, "failed"), "hand": None, "replays": []}
    assert motors.row(bare, None) == ["a turn", "failed", *7 * [motors.NONE], "33"]
    assert len(motors.row(bare, None)) == len(motors.HEAD)


def test_certified_hands_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, count, status in (("a", 1, "certified"), ("b", 3, "certified"), ("c", 1, "feasible")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "result.json").write_text(json.dumps(record((2, 2), count, 0, status)))
    folders = [str(tmp_path / name) for name in "abc"]
    monkeypatch.setattr("sys.argv", ["motors.py", *folders, "--out", str(tmp_path / "table.md")])
    motors.main()
    assert "2 of 3 certified, median 2 motors, 1 with one, at most 3" in capsys.readouterr().out
    earlier = record((2, 2), 0, 0)
    del earlier["hand"]["motors"]
    assert motors.row(earlier, None)[3] == "4"
    (tmp_path / "b" / "result.json").write_text(json.dumps(earlier))
    motors.main()
    assert "2 of 3 certified, median 2.5 motors, 1 with one, at most 4" in capsys.readouterr().out
    assert (tmp_path / "table.md").read_text().count("a turn") == 3
