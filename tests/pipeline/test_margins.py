"""How firmly a hand is to grip, against levers by hand."""

from __future__ import annotations

import numpy as np
import pytest

from casadi_hands.pipeline.margins import AMPLE, FIRMER, FIRMEST, SENSOR, SPARING, SURER, WEAKEST, Margins, margins_for
from casadi_hands.pipeline.warm_start import warm_start
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.si import build_model
from casadi_hands.task import parse_task
from tests.export.example import BASES, LENGTHS, LINK_RADIUS, example_motion
from tests.pipeline.test_warm_start import HELD, earlier


def held(stiffness: float = 1.0, mass: float = 0.1) -> tuple[Model, WholeHand]:
    """Three planar fingers of two joints that hold a capsule."""
    task = parse_task(HELD.replace("mass: 0.1", f"mass: {mass}") + f"actuator: {{stiffness: {stiffness}}}\n")
    model = build_model(task)
    return model, warm_start(earlier(), task, model)


def found(stiffness: float, mass: float = 0.1) -> Margins:
    return margins_for(*held(stiffness, mass))


def floor(stiffness: float, mass: float = 0.1) -> float:
    """What is asked where replays drop the object; twice of what a refinement begins with is less here."""
    return found(stiffness, mass).larger.normal_force


def test_it_is_what_errors_of_the_sensors_take_off_a_fingertip_s_force() -> None:
    """Held at the contact, a joint that is off by e gives K e; normal force is what both joints' torques come to."""
    motion = example_motion()
    changes = []
    for i, (base, angles) in enumerate(zip(BASES.values(), np.split(motion.joint_angles, 3, axis=1), strict=True)):
        side, taken = np.sign(base[1]), []
        for first, second in angles:
            # In the plane of y and z; turning about x takes (y, z) to (-z, y).
            elbow = LENGTHS[0] * np.array([-np.sin(first), np.cos(first)])
            tip = elbow + LENGTHS[1] * np.array([-np.sin(first + second), np.cos(first + second)])
            touch = tip - np.array([side * LINK_RADIUS, 0.0])
            arms = [touch, touch - elbow]
            jacobian = np.array([[-arm[1], arm[0]] for arm in arms]).T
            taken.append(SENSOR * np.abs(np.linalg.inv(jacobian)[:, 0]).sum())
        changes.append(float(np.median(taken)))
        assert len(taken) == 21, i
    for stiffness in (2.0, 4.0, 18.0):
        due = stiffness * max(changes) / (0.1 * 9.81)
        assert WEAKEST < due < FIRMEST
        assert found(stiffness).ample.normal_force == pytest.approx(min(due, AMPLE), abs=0.006)
        assert floor(stiffness) == pytest.approx(max(due, FIRMER * min(due, AMPLE)), abs=0.011)
        assert found(stiffness).ample.normal_force < found(stiffness).firmer.normal_force < floor(stiffness)
    assert due > FIRMER * AMPLE


def test_it_grows_with_the_stiffness_and_falls_with_the_weight() -> None:
    one = floor(2.0)
    assert floor(4.0) == pytest.approx(2 * one, abs=0.03)
    assert floor(2.0, mass=0.05) == pytest.approx(2 * one, abs=0.03)
    assert floor(4.0, mass=0.2) == pytest.approx(one, abs=0.03)


def test_it_is_neither_too_little_nor_too_much() -> None:
    assert found(0.01).ample.normal_force == WEAKEST
    assert floor(0.01) == FIRMER * WEAKEST
    assert found(1000.0).ample.normal_force == AMPLE
    assert floor(1000.0) == FIRMEST


@pytest.mark.parametrize("stiffness", [0.01, 4.0, 1000.0])
def test_the_larger_presses_at_least_twice_as_much_and_uses_less_of_the_friction(stiffness: float) -> None:
    margins = found(stiffness)
    assert margins.larger.normal_force >= FIRMER * margins.ample.normal_force
    assert (margins.larger.friction, margins.larger.structural) == (SURER, margins.ample.structural)
    assert margins.larger.friction < margins.ample.friction < margins.softer.friction == SPARING
    assert margins.softer.normal_force == WEAKEST


def test_a_finger_that_never_touches_has_no_say() -> None:
    model, whole = held(8.0)
    active = whole.active.copy()
    active[:, list(whole.contacts)] = False
    idle = WholeHand(**{**vars(whole), "active": active})
    assert margins_for(model, idle).ample.normal_force == WEAKEST
