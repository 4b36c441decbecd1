"""Which fingers can be built, against NumPy and Pinocchio's exponential."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from casadi_hands.problem.si import build_model
from casadi_hands.stages.buildable import buildable, buildable_bounds
from casadi_hands.task import parse_task
from tests.stages.blocks import check_block, frames, numbers, random_finger
from tests.stages.example import PinFinger
from tests.stages.synthesis.example import BALL


@pytest.mark.parametrize("joints", [1, 2, 3])
@pytest.mark.parametrize(("hinged", "bent"), [(True, True), (True, False), (False, True)])
def test_squares_of_cosines_and_bends(joints: int, hinged: bool, bent: bool) -> None:
    finger = random_finger(joints, np.random.default_rng(joints))
    variables, parameters = {"axes": finger.axes, "bends": finger.bends}, {"frames": frames(finger)}
    kernel = buildable(joints, hinged, bent)
    found = numbers(kernel, variables, parameters)
    axes, own = PinFinger(finger, 0.1).axes, np.array([0.0, 0.0, 1.0])
    before = [pin.exp3(np.array([*bend, 0.0])).T @ own for bend in finger.bends]
    cosines = [axis @ own for axis in axes] + [a @ b for a, b in zip(axes[1:], before[1:], strict=True)]
    expected = {"from_link": np.square(cosines)} if hinged else {}
    expected |= {"bent": (finger.bends**2).sum(axis=1)} if bent else {}
    assert set(found) == set(expected)
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, atol=1e-8)
    check_block(kernel, variables, parameters)


@pytest.mark.parametrize(
    ("given", "from_link", "bent"),
    [
        ("", (0.0, 0.25), np.pi**2 / 4),
        ("hand: {bend: 0}", (0.0, 0.25), 0.0),
        ("hand: {bend: 120, axes: {from_link: [30, 60]}}", (0.25, 0.75), (2 * np.pi / 3) ** 2),
        ("hand: {axes: {from_link: [0, 45]}}", (0.5, 1.0), np.pi**2 / 4),
        ("hand: {axes: {from_link: [0, 90]}}", (0.0, 1.0), np.pi**2 / 4),
    ],
)
def test_bounds_are_the_task_s(given: str, from_link: tuple[float, float], bent: float) -> None:
    model = build_model(parse_task(f"{BALL}{given}\n"))
    bounds = buildable_bounds(model)
    assert bounds["from_link"] == pytest.approx(from_link, abs=1e-12)
    assert bounds["bent"] == pytest.approx((0.0, bent), abs=1e-12)
    assert model.hinged == (from_link != (0.0, 1.0))
