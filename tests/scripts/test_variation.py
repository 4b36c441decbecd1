from __future__ import annotations

from dataclasses import replace

from variation import RATES, RUNS, Run, report
from vary import Change

from tests.export.example import example_design

CHANGE = Change(1.13, 0.72, 0.9, 1.0, {"left": (-12.4, 0.3), "right": (3.0, 1.0)})


def cells(line: str) -> list[str]:
    return line.strip("| ").split(" | ")


def test_rates_are_of_each_task_and_of_all() -> None:
    states = {"lift": ["certified", "certified", "feasible", "stopped"], "turn": ["failed"]}
    runs = [
        Run(name, number, CHANGE, state, replace(example_design(), reason="slips; drops"))
        for name, each in states.items()
        for number, state in enumerate(each, start=1)
    ]
    rates, rows = (part.splitlines() for part in report(runs[::-1]).split("\n\n"))
    assert cells(rates[0]) == list(RATES)
    assert [cells(line) for line in rates[2:]] == [
        ["turn", "1", "0", "0", "1", "0", "0", "0 %"],
        ["lift", "4", "2", "1", "0", "1", "0", "50 %"],
        ["all", "5", "2", "1", "1", "1", "0", "40 %"],
    ]
    assert cells(rows[0]) == list(RUNS)
    expected = ["turn", "1", "1.13", "0.72", "0.90", "1.00", "12°, 3°", "failed", "2+2+2", "2", "slips"]
    assert cells(rows[2]) == expected
