from __future__ import annotations

import sys
from pathlib import Path

import apart
import pretended_solves
import pytest
from shared import NOTHING
from soft_figures import HEAD, main, planned_slips

from casadi_hands import load_task, solve
from casadi_hands.verify.reading.folder import read_folder
from casadi_hands.verify.trajectory import sample_placements
from tests.export.example import TASK
from tests.verify.fixture import TIP, geared

PROBLEMS = Path(__file__).parents[2] / "problems"


def rows(monkeypatch: pytest.MonkeyPatch, folder: Path, how: str) -> list[dict[str, str]]:
    """The table of one task with seeds 0 and 1."""
    task = folder / "example.yaml"
    task.write_text(TASK, encoding="utf-8")
    monkeypatch.setattr(apart, "_work", getattr(pretended_solves, how))
    monkeypatch.setattr(sys, "argv", ["soft_figures.py", str(task), "--seeds", "0", "1", "--out", str(folder)])
    main()
    lines = (folder / "soft.md").read_text(encoding="utf-8").splitlines()[2:]
    return [dict(zip(HEAD, line.strip("| ").split(" | "), strict=True)) for line in lines]


def test_a_solve_that_crashes_is_a_row_and_the_next_is_measured(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    crashed, measured = rows(monkeypatch, tmp_path, "crashes_with_seed_0")
    assert (crashed["seed"], crashed["goals mm / deg"]) == ("0", "failed: the solver crashed (SIGSEGV)")
    assert {crashed[name] for name in HEAD[4:-1]} == {NOTHING}
    assert (measured["seed"], measured["joints"], measured["s in all"]) == ("1", "2+2+2", "2")
    # The example is at its goals and on both surfaces.
    assert measured["goals mm / deg"] == "0.00 / 0.00"
    assert measured["contact from object mm"] == measured["contact from finger mm"] == "0.00"
    # Two fingers press with 0.6 N and lift with 0.327 N of 0.981 N.
    assert float(measured["friction excess on object (m·g)"]) == pytest.approx((0.327 - 0.5 * 0.6) / 0.981, abs=1e-3)


def test_a_solve_that_leaves_nothing_is_a_row(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for row in rows(monkeypatch, tmp_path, "raises"):
        assert row["goals mm / deg"] == "failed: the solver crashed: ArithmeticError: no numbers left"
        assert row["joints"] == row["s in all"] == NOTHING


@pytest.mark.parametrize(("ball", "finger"), [(0.4, -2.0), (0.3, 1.0)])
def test_planned_slip_is_the_difference_of_arc_lengths(tmp_path: Path, ball: float, finger: float) -> None:
    folder = read_folder(geared(tmp_path, ball, finger).write(tmp_path / "result"))
    slips = planned_slips(folder, sample_placements(folder))
    # Outer gears run opposite: no slip when 30 mm · ball = -6 mm · finger.
    assert slips == {"left": pytest.approx(abs(0.03 * ball + TIP * finger), abs=1e-4), "right": 0}


@pytest.mark.slow
def test_poor_contacts_slip_more_on_the_pencil(tmp_path: Path) -> None:
    """What figure 3.5 shows."""
    slips = {}
    for name in ("pencil_pick_up", "pencil_pick_up_poor_contacts"):
        solve(load_task(PROBLEMS / f"{name}.yaml"), until="whole_hand", out=tmp_path / name)
        folder = read_folder(tmp_path / name)
        slips[name] = sum(planned_slips(folder, sample_placements(folder)).values())
    assert slips["pencil_pick_up"] < 0.9 * slips["pencil_pick_up_poor_contacts"]
