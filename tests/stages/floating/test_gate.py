"""The gate on motions that broke down."""

from __future__ import annotations

import numpy as np
import pytest

from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.gate import passes_gate
from casadi_hands.stages.floating.stage import FloatingStage
from tests.stages.synthesis.example import ball_task


@pytest.mark.parametrize("name", ["pose", "point", "invariant"])
def test_what_is_no_number_does_not_pass(name: str) -> None:
    model = build_model(ball_task())
    values = FloatingStage(model).start()
    assert passes_gate(model, values)
    values[name] = np.array(values[name])
    values[name].flat[-1] = np.nan
    assert not passes_gate(model, values)
