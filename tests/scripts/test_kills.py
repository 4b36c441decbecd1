"""What the script that kills solves takes for the same design."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

from kills import compare

from tests.export.example import example_design


def test_designs_that_took_other_seconds_are_the_same_and_others_are_not(tmp_path: Path) -> None:
    design = replace(example_design(), stages=[])
    again = {name: 2 * seconds + 1.0 for name, seconds in {"total": 0.0, **design.seconds}.items()}
    others = {"slower": replace(design, seconds=again), "other": replace(design, reason="another")}
    for name, each in {"reference": design, **others}.items():
        each.save(tmp_path / name)
    found = Counter[str]()
    compare(tmp_path / "slower", tmp_path / "reference", "same", found)
    assert found == {"same": 1}
    (tmp_path / "slower" / "report.html").unlink()
    for name in others:
        compare(tmp_path / name, tmp_path / "reference", "same", found)
    assert found == {"same": 1, "BAD: other report.html": 1, "BAD: other result.json": 1}
