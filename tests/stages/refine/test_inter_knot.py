"""Fingers that pass through each other between knots, told by coal."""

from __future__ import annotations

import itertools
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from casadi_hands.problem.resampling import resampled_model
from casadi_hands.stages.refine import stage
from casadi_hands.stages.refine.inter_knot import DEEP, pass_through
from casadi_hands.stages.refine.settings import LAST_STEP
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.stages.refine.values import Margin
from tests.stages.blocks import coal_distance, segment
from tests.stages.example import PinFinger, everything, sizes_of, with_tips
from tests.stages.refining import MadeUp

Array = np.ndarray


@pytest.fixture(scope="module")
def wide() -> MadeUp:
    _, model = everything()
    return MadeUp(resampled_model(model, model.schedule.stepped(0.3)), (0, 2), lifted={})


def shallowest(made_up: MadeUp, angles: tuple[Array, Array]) -> float:
    """Least distance of the two fingers' surfaces between knots: in the middle, or at least every 25 ms."""
    least = np.inf
    radii = [sizes_of(made_up.model, finger.joints) for finger in made_up.start.fingers]
    fingers = [PinFinger(finger, sizes[0]) for finger, sizes in zip(made_up.start.fingers, radii, strict=True)]
    for k, step in enumerate(np.diff(made_up.model.schedule.samples)):
        parts = next(n for n in range(2, 20) if step / n <= 0.025 + 1e-9)
        for homotopy in np.arange(1, parts) / parts:
            links = [f.links((1 - homotopy) * a[k] + homotopy * a[k + 1]) for f, a in zip(fingers, angles, strict=True)]
            bodies = [
                [segment(*link, radius) for link, radius in zip(*each, strict=True)]
                for each in zip(links, radii, strict=True)
            ]
            least = min([least, *(coal_distance(one, other) for one, other in itertools.product(*bodies))])
    return float(least)


@pytest.mark.parametrize("step", [0.1, 0.3])
def test_overlaps_between_knots_are_found_and_shallow_ones_are_not(step: float) -> None:
    model = with_tips(everything()[1])
    made_up = MadeUp(resampled_model(model, model.schedule.stepped(step)), (0, 2), lifted={})
    structure, rng, found = made_up.stage.structure, np.random.default_rng(0), set()
    deep = -DEEP * made_up.model.link_radius
    for _ in range(60):
        angles = tuple(rng.uniform(-1.2, 1.2, a.shape) for a in made_up.start.angles)
        least = shallowest(made_up, angles)  # type: ignore[arg-type]
        if abs(least - deep) > 1e-3:
            passes = pass_through(structure, replace(made_up.start, angles=angles))
            assert passes == (least < deep)
            assert made_up.stage.passes_through(SimpleNamespace(hand=replace(made_up.start, angles=angles))) == passes
            found.add(passes)
    assert found == {True, False}


@pytest.mark.parametrize("met", [True, False])
@pytest.mark.parametrize("passes", [True, False])
def test_what_passes_through_is_solved_again_with_guards(
    wide: MadeUp, monkeypatch: pytest.MonkeyPatch, met: bool, passes: bool
) -> None:
    taken: list[bool] = []
    monkeypatch.setattr(stage, "pass_through", lambda *_: passes)
    solve = RefineStage.take

    def told(stage: RefineStage, *given: Any) -> Any:
        taken.append(stage.built.guarded)
        return replace(solve(stage, *given), met=met)

    monkeypatch.setattr(RefineStage, "take", told)
    short = (briefly(LAST_STEP[0]),)
    refined = wide.stage.take_clear(short, wide.start, Margin())
    assert taken == [False, True][: 2 if met and passes else 1]
    assert len(refined.runs) == len(taken)


def briefly(step: Any) -> Any:
    """The same step, with hardly any iterations."""
    what, weights, options = step
    return what, weights, replace(options, max_iter=1)
