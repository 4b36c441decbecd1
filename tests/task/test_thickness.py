"""The default thickness of fingers, against beams by Euler and Bernoulli and the tasks' own limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from casadi_hands.task import Task, load_task
from casadi_hands.task.thickness import usual_force, usual_link_radius

BALL = {"mass": 0.015, "shapes": [{"sphere": {"center": [0, 0, 0], "radius": 0.01}}]}


def task(height: float = 0.08, **fields: Any) -> Task:
    """A ball below the palm."""
    given: dict[str, Any] = {
        "name": "ball",
        "object": BALL,
        "palm": {"position": [0, 0, height], "facing": [0, 0, -1]},
        "motion": [{"at": 0, "position": [0, 0, 0]}, {"at": 1, "position": [0, 0, 0.01]}],
        "fingers": {"left": {"touches": [0.01, 0, 0]}, "right": {"touches": [-0.01, 0, 0]}},
    }
    return load_task({**given, **fields})


def bent(radius: float, force: float, length: float, stiffness: float) -> float:
    """Deflection of a cantilever's end, m, by its differential equation."""
    rigidity = stiffness * np.pi * radius**4 / 4
    x = np.linspace(0, length, 20)

    def slopes(at: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.vstack([y[1], force * (length - at) / rigidity])

    solved = solve_bvp(slopes, lambda start, _: start, x, np.zeros((2, x.size)), tol=1e-8)
    return float(solved.sol(length)[0])


def test_a_finger_of_the_default_radius_bends_as_far_as_tips_may() -> None:
    radius = usual_link_radius(0.01, 0.01, 0.2, 0.1, None, ())
    assert radius > 0.13 * 0.01
    assert bent(radius, 0.2, 0.1, 2.5e9) == pytest.approx(0.02 * 0.01, rel=1e-6)


def test_light_objects_are_held_as_firmly_as_errors_of_joints_ask_for() -> None:
    # Joints of 1 N·m/rad that are off by 0.75 degrees press by so much less at the end of 0.1 m.
    assert usual_force(0.05, 0.5, 0.1) == pytest.approx(np.radians(0.75) / 0.1, rel=0.01)
    assert usual_force(0.01, 0.5, 0.1) == pytest.approx(6 * 0.01)
    assert usual_force(1.0, 0.5, 0.1) == 2.0


def test_palms_far_away_and_heavy_objects_need_thicker_fingers_and_stiff_materials_thinner_ones() -> None:
    near, far = task(0.03).hand.link_radius, task(0.08).hand.link_radius
    least = 0.13 * task().palm.radius
    assert far > 1.2 * near
    heavy = task(object={**BALL, "mass": 0.03}).hand.link_radius
    assert heavy == pytest.approx(2**0.25 * far)
    stiff = task(hand={"material": "aluminium-6061"}).hand.link_radius
    assert stiff == pytest.approx(max((2.5 / 68.9) ** 0.25 * far, least))
    assert task(friction=1.0).hand.link_radius == pytest.approx(2**-0.25 * far)
    assert task(hand={"link_radius": 0.001}).hand.link_radius == 0.001


def test_fingertips_leave_room_between_contacts_and_are_smaller_than_the_object() -> None:
    assert usual_link_radius(0.01, 0.01, 9.0, 0.3, None, ((0, 0, 0), (0.01, 0, 0))) == pytest.approx(0.0045)
    assert usual_link_radius(0.01, 0.01, 9.0, 0.3, None, ((0, 0, 0),)) == pytest.approx(0.005)
    assert usual_link_radius(0.1, 0.01, 9.0, 0.3, None, ((0, 0, 0), (0.01, 0, 0))) == pytest.approx(0.013)
