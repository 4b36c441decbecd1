"""Scripts that measure hand the documents tables of a readable size."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from benchmark import CONSTRAINED, METHODS, OURS, PEERS, side_by_side
from gallery import main as gallery
from growth import HEAD, by_size

OTHERS = [name for name in METHODS if name not in (OURS, CONSTRAINED)]


def peer(stage: str, name: str, **cells: str) -> list[str]:
    known = {"task": "ball", "stage": stage, "optimiser": name, "reached at the limit": "0 of 2", **cells}
    return [known.get(column, "1") for column in PEERS]


def test_optimisers_stand_side_by_side() -> None:
    rows = [
        peer("1", OURS, **{"building s": "0.16", "solving s": "0.091"}),
        peer("1", CONSTRAINED),
        peer("1", OTHERS[0], **{"times slower to its own objective": "6.4", "times slower in all": "3.7"}),
        peer("1", OTHERS[1], **{"times slower in all": "41", "reached at the limit": "1 of 2"}),
        peer("1", OTHERS[2], **{"building s": "the process died", "times slower in all": "–"}),
        peer("2, hand", OURS),
    ]
    head, lines = side_by_side(rows)
    assert head == ["task", "stage", "ours: building + solving s", *OTHERS]
    assert lines[0][:6] == ["ball", "1", "0.16 + 0.09", "6.4 / 3.7", "1 / > 41", "the process died"]
    assert lines[1] == ["ball", "2, hand", "1.00 + 1.00", *["–"] * len(OTHERS)]


def test_stages_stand_side_by_side() -> None:
    rows = [
        ["fingers", "2", "floating", "540", "0.06", "6.5", "186"],
        ["fingers", "2", "refine", "1500", "0.2", "60.5", "220"],
        ["fingers", "3", "floating", "–", "stopped after 3 s", "–", "–"],
    ]
    assert {len(row) for row in rows} == {len(HEAD)}
    head, lines = by_size(rows)
    assert head[2:] == [
        "floating: building s, ms an iteration",
        "refine: building s, ms an iteration",
        "most memory MB",
    ]
    assert lines == [
        ["fingers", "2", "0.06, 6.5", "0.2, 60.5", "220"],
        ["fingers", "3", "stopped after 3 s, –", "–", "–"],
    ]


def test_the_gallery_writes_a_record_where_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    problems = tmp_path / "problems"
    problems.mkdir()
    (problems / "bad.yaml").write_text("name: [\n")
    given = ["gallery.py", str(problems), "--no-solve", "--out", str(tmp_path / "out"), "--json", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", given)
    monkeypatch.setattr("tables.commit_of", lambda root: "1234567")
    gallery()
    record = json.loads((tmp_path / "gallery.json").read_text())
    assert record["rows"][0][0] == "bad"
    assert len(record["columns"]) == len(record["rows"][0])
