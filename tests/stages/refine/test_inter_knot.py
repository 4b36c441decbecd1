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
CLOSE_TO = 1e-3  # lengths, by which distances of kernels may be rounded


@pytest.fixture(scope="module")
def wide() -> MadeUp:
    _, model = everything()
    return MadeUp(resampled_model(model, model.schedule.stepped(0.3)), (0, 2), lifted={})


def shallowest(made_up: MadeUp, angles: tuple[Array, Array], apart: float, deep: float) -> float:
    """Least distance of two fingers between knots at which they are no deeper: in the middle, or at least so often.

    Where it is that of those which are just as deep at a knot, this depth.
    """
    least = unsure = np.inf
    radii = [sizes_of(made_up.model, finger.joints) for finger in made_up.start.fingers]
    fingers = [PinFinger(finger, sizes[0]) for finger, sizes in zip(made_up.start.fingers, radii, strict=True)]
    for k, step in enumerate(np.diff(made_up.model.schedule.samples)):
        parts = next(n for n in range(2, 20) if step / n <= apart + 1e-9)
        found = []
        for share in np.arange(parts + 1) / parts:
            links = [f.links((1 - share) * a[k] + share * a[k + 1]) for f, a in zip(fingers, angles, strict=True)]
            bodies = [
                [segment(*link, radius) for link, radius in zip(*each, strict=True)]
                for each in zip(links, radii, strict=True)
            ]
            found.append(min(coal_distance(one, other) for one, other in itertools.product(*bodies)))
        ends = min(found[0], found[-1])
        if abs(ends - deep) < CLOSE_TO:
            unsure = min(unsure, *found[1:-1])
        elif ends > deep:
            least = min(least, *found[1:-1])
    return deep if unsure < deep < least else float(least)


@pytest.mark.parametrize("step", [0.1, 0.3])
def test_overlaps_between_knots_are_found_and_shallow_ones_are_not(step: float) -> None:
    model = with_tips(everything()[1])
    made_up = MadeUp(resampled_model(model, model.schedule.stepped(step)), (0, 2), lifted={})
    structure, rng, found = made_up.stage.structure, np.random.default_rng(0), set()
    deep = -DEEP * made_up.model.link_radius
    for _ in range(60):
        angles = tuple(rng.uniform(-2.5, 2.5, a.shape) for a in made_up.start.angles)
        moved = replace(made_up.start, angles=angles)
        for apart, times in ((0.1, structure.inner), (0.025, structure.close_times)):
            least = shallowest(made_up, angles, apart, deep)  # type: ignore[arg-type]
            if abs(least - deep) > CLOSE_TO:
                passes = pass_through(structure, moved, times)
                assert passes == (least < deep)
                found.add((apart, passes))
        assert made_up.stage.passes_through(SimpleNamespace(hand=moved)) == passes
    assert found == {(0.1, True), (0.1, False), (0.025, True), (0.025, False)}


def test_fingers_that_overlap_where_they_are_do_not_pass_through_each_other() -> None:
    model = with_tips(everything()[1])
    made_up = MadeUp(resampled_model(model, model.schedule.stepped(0.1)), (0, 2), lifted={})
    structure, rng, overlap = made_up.stage.structure, np.random.default_rng(0), 0
    for _ in range(60):
        angles = tuple(np.tile(rng.uniform(-1.2, 1.2, a.shape[1]), (len(a), 1)) for a in made_up.start.angles)
        deep = -DEEP * made_up.model.link_radius
        overlap += shallowest(made_up, angles, 0.1, -np.inf) < deep  # type: ignore[arg-type]
        assert not pass_through(structure, replace(made_up.start, angles=angles), structure.close_times)
    assert overlap > 0


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
