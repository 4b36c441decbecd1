"""What the report and the page tell of sets of contacts, and of a palm that was placed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from casadi_hands.export.page.scene import draw_scene
from casadi_hands.export.report.placement import placement_section
from casadi_hands.problem.result import Result
from tests.export.example import example_design, example_task


def one_set(x: float, **more: Any) -> dict[str, Any]:
    given = {"grip": 0.625, "reach": 1.25, "wobble": 0.0312, "worst_angle": 12.4, "joints": [2, 3]}
    return {"points": {"thumb": [x, 0.02, 0.0], "index": [x, -0.02, 0.0]}, **given, **more}


PLACEMENT = {
    "palm": {"why": "the ground is 20 mm away"},
    "sets": [one_set(0.001), one_set(0.002, idle=1, joints=[2]), one_set(-0.003, broke_off="no", joints=[])],
    "chosen": 1,
    "why": "of 3 sets it takes the least & more",
}


def test_each_set_has_its_row_and_the_one_that_was_taken_is_told() -> None:
    text = placement_section(replace(example_design(), placement=PLACEMENT))
    rows = [row.split("</tr>")[0] for row in text.split("<tr>")[2:]]
    assert len(rows) == 3
    assert ["taken" in row for row in rows] == [False, True, False]
    assert "0.63" in rows[0] or "0.62" in rows[0]
    assert ["2+3" in row for row in rows] == [True, False, False]
    assert "1 idle" in rows[1]
    assert "broke off" in rows[2]
    assert "thumb [\u22123.0, 20.0, 0.0]" in rows[2]
    assert "of 3 sets it takes the least &amp; more" in text
    assert "the ground is 20 mm away" in text


@pytest.mark.parametrize(
    ("placement", "told"),
    [
        ({}, False),
        ({"sets": 3, "palm": None}, False),
        ({"sets": [{"points": []}, 7, {"points": {"a": 1}, "grip": True}]}, True),
        ({"palm": {"why": "<script>"}}, True),
    ],
)
def test_what_others_may_have_written_breaks_nothing(placement: dict[str, Any], told: bool) -> None:
    text = placement_section(replace(example_design(), placement=placement))
    assert bool(text) == told
    assert "<script>" not in text
    draw_scene(Result(task=example_task(), status="failed", placement=placement))


def test_the_page_of_a_task_shows_the_other_sets() -> None:
    scene = draw_scene(Result(task=example_task(), status="not solved", placement=PLACEMENT))
    names = [label.text for label in scene.labels]
    assert [name for name in names if "(" in name] == ["thumb (1)", "index (1)", "thumb (3)", "index (3)"]
    assert all(np.isfinite(label.color).all() for label in scene.labels)
    solved = draw_scene(replace(example_design(), placement=PLACEMENT))
    assert solved.labels == ()
