"""The order of designs and which are kept."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from casadi_hands.export.design import Design
from casadi_hands.pipeline.alternatives.ranking import largest_torque, margin, rank
from casadi_hands.task import parse_task
from casadi_hands.verify import audit_files
from tests.export.example import TASK, example_design, example_hand, example_task
from tests.pipeline.alternatives.example import certified, changed, figure, shifted
from tests.verify.fixture import carried


def seeds(designs: dict[int, Design]) -> list[int]:
    return [one.seed for one in rank(designs)]


def test_certified_then_fewer_joints_then_margin_then_torque() -> None:
    fewer = changed(1, links=example_hand().fingers[1].links[:1])
    designs = {
        0: Design(task=example_task(), status="failed", reason="nothing"),
        1: replace(certified(fewer, 0.1, 0.01), status="feasible"),
        2: certified(friction_use=0.5, torque=0.1),
        3: certified(friction_use=0.2, torque=0.3),
        4: certified(friction_use=0.21, torque=0.2),
        5: certified(fewer, friction_use=0.9, torque=9.0),
    }
    assert seeds(designs) == [5, 4, 3, 2, 1, 0]
    assert seeds(dict(reversed(designs.items()))) == [5, 4, 3, 2, 1, 0]


def test_equals_keep_the_order_of_their_seeds() -> None:
    assert seeds({7: certified(), 3: certified(), 5: certified()}) == [3, 5, 7]


def test_near_duplicates_of_a_better_hand_are_dropped() -> None:
    # Half the object's extent is 0.06 m, so hands 0.017 m apart are alike, and 0.019 m apart are not.
    ranked = rank({0: certified(), 1: certified(shifted(0.017)), 2: certified(shifted(0.019)), 3: certified()})
    assert [(one.seed, one.kept, one.like) for one in ranked] == [
        (0, True, None),
        (1, False, 0),
        (2, True, None),
        (3, False, 0),
    ]


def test_what_is_like_a_dropped_hand_only_is_kept() -> None:
    ranked = rank({0: certified(), 1: certified(shifted(0.01)), 2: certified(shifted(0.02))})
    assert [one.kept for one in ranked] == [True, False, True]


def test_at_most_four_are_kept_and_failures_never() -> None:
    designs = {seed: certified(shifted(0.02 * seed)) for seed in range(6)}
    designs[6] = replace(example_design(), status="failed")
    ranked = rank(designs)
    assert [one.kept for one in ranked] == [True] * 4 + [False] * 3
    assert all(one.like is None for one in ranked)


def test_margin_is_the_smallest_share_left() -> None:
    held = {
        "slip": figure(0.05, 0.2),
        "gap_between": figure(0.04, 0.1),
        "torque": figure(5.0, None),
        "pull": figure(-2.0, 0.0),
    }

    def of(**figures):
        return margin(replace(example_design(), certificate={**held, **figures}))

    assert of() == pytest.approx(0.6)
    assert of(friction_use=figure(0.7, None)) == pytest.approx(0.3)
    assert of(slip=figure(0.3, 0.2, False)) == pytest.approx(-0.5)
    # A least value: 1.2 of at least 1, then 0.4 of it.
    assert of(disturbance_radius=figure(1.2, 1.0)) == pytest.approx(0.2)
    assert of(disturbance_radius=figure(0.4, 1.0, False)) == pytest.approx(-0.6)
    assert of(goal_position=figure(0.0004, 0.0005)) == pytest.approx(0.6)
    assert of(goal_position=figure(0.001, 0.0005, False)) == pytest.approx(-1.0)
    assert of(motors=figure(2.0, 2.0)) == pytest.approx(0.6)
    assert of(motors=figure(6.0, 2.0, False)) == pytest.approx(-2.0)
    assert of(pull=figure(0.1, 0.0, False)) == -math.inf
    assert of(gap_between=figure(None, 0.1, False)) == -math.inf
    assert margin(replace(example_design(), certificate={})) == -math.inf


def test_margin_of_an_audit(tmp_path) -> None:
    found = audit_files(carried(tmp_path / "task").write(tmp_path / "result"))
    assert found.certified
    design = replace(example_design(), certificate=found.as_certificate())
    share = {name: 1 - f.value / f.limit for name, f in found.figures.items() if f.limit}
    named = ("gap_between", "slip", "penetration", "joint_limit", "unsupplied_force")
    assert set(named) <= set(share)
    expected = min(*(share[name] for name in named), 1 - found.figures["friction_use"].value)
    assert margin(design) == pytest.approx(expected)


def test_torque_is_in_newton_metres_whatever_the_certificate_counts_in() -> None:
    assert largest_torque(certified(torque=0.3)) == 0.3
    motors = parse_task(TASK + "actuator: {torque: 0.5, speed: 6}\n")
    assert largest_torque(replace(certified(torque=0.3), task=motors)) == pytest.approx(0.15)
    assert largest_torque(replace(certified(), certificate={})) == math.inf
