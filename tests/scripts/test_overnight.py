"""How a night's solves are counted."""

from __future__ import annotations

from dataclasses import replace

import pytest
from overnight import ELSE, WAYS, way_of

from tests.export.example import example_design

DESIGN = example_design()


@pytest.mark.parametrize(
    ("status", "how", "way"),
    [
        ("certified", "", WAYS[0]),
        ("certified", "stopped after 6 min", WAYS[0]),  # its folder held a certified hand
        ("certified", "the solver crashed (SIGSEGV)", ELSE),
        ("feasible", "stopped after 6 min", ELSE),
        ("failed", "", WAYS[3]),
        ("failed", "stopped after 6 min", ELSE),
    ],
)
def test_what_a_solve_left_is_counted_by_how_it_ended(status: str, how: str, way: str) -> None:
    found, why = way_of(replace(DESIGN, status=status, reason="finger 'a' cannot reach goal 2; try more joints"), how)
    assert found == way
    assert how in why
