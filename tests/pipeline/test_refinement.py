"""What is said of refinements that failed: who, when, by how much, on made-up violations."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from casadi_hands.pipeline.refinement import failing_fingers, refined_reason
from casadi_hands.stages.model import Model, build_model
from casadi_hands.stages.refine import Refined
from casadi_hands.task import parse_task
from tests.search.example import BALL
from tests.stages.example import made_up_solution

# Half an extent is 3 cm, the weight 0.1 · 9.81 N; samples are 0.1 s apart.
TORQUE_UNIT = 0.1 * 9.81 * 0.03


def ball() -> Model:
    return build_model(parse_task(BALL))


def refined(
    worst: tuple[str, float], excess: np.ndarray | None = None, *, step: str = "exact", lifted: tuple[int, ...] = ()
) -> Refined:
    """A refinement that is left with one violation; the left finger lifts at samples ``lifted``."""
    solution = made_up_solution({})
    solution = replace(solution, excess={} if excess is None else {worst[0]: excess})
    active = np.ones((7, 2), bool)
    active[list(lifted), 0] = False
    hand = SimpleNamespace(
        contacts=(0, 1), fingers=(SimpleNamespace(joints=2), SimpleNamespace(joints=1)), active=active
    )
    slips = {"left": 0.02, "right": 0.4}
    return Refined(hand, False, worst, slips, ((step, solution),), {})  # type: ignore[arg-type]


def test_an_exact_motion_needs_no_reason() -> None:
    assert refined_reason(ball(), replace(refined(("contact0.passive", 0.0)), exact=True)) == []


def test_slip_is_laid_to_the_finger_that_slips_most() -> None:
    made = refined(("rolling0.no_slip", 0.1), step="firm")
    (reason,) = refined_reason(ball(), made)
    assert reason.what == "finger 'right' with 1 joint cannot roll with the object: it slips 12.0 mm"
    assert "search.max_joints" in reason.advice
    assert failing_fingers(ball(), made) == {"right"}


@pytest.mark.parametrize(
    ("name", "violation", "words"),
    [
        ("contact0.passive", 0.25, "finger 'left' cannot supply its force with its joints at {}, by 0.25 weights"),
        ("contact1.on_link", 0.1, "finger 'right' cannot reach its contact at {}, by 3 mm"),
        ("contact1.torque", 2.0, f"within the torque limit at {{}}, by {2 * TORQUE_UNIT:.2g} N·m"),
        ("joint_motion0.speed", 1.5, "finger 'left' cannot keep within the joints' speed limit at {}, by 1.5 rad/s"),
        ("fingers_apart1_0.clear", 0.1, "fingers 'left' and 'right' cannot stay clear of each other at {}, by 3 mm"),
        ("physics.defect", 0.1, "the object cannot be moved as planned by the forces of its contacts at {}"),
    ],
)
def test_who_cannot_do_what_when_and_by_how_much(name: str, violation: float, words: str) -> None:
    excess = np.zeros((6 if name == "physics.defect" else 7, 3))
    excess[2, 1] = violation
    (reason,) = refined_reason(ball(), refined((name, violation), excess))
    assert reason.what.startswith("no exact motion was found with 2+1 joints: ")
    assert reason.what.endswith(words.format("0.2 s (between goals 1 and 2)"))
    assert reason.advice


def test_rows_are_the_samples_where_a_finger_touches() -> None:
    # It is off at 0.2, 0.3 and 0.4 s; a contact's point is on both bodies until the sample at which it lifts.
    rows = np.zeros((5, 2))
    rows[3, 0] = 0.2
    (reason,) = refined_reason(ball(), refined(("contact0.on_link", 0.2), rows, lifted=(2, 3, 4)))
    assert " at 0.5 s " in reason.what


def test_the_time_is_when_most_is_missing_and_not_when_least_is_pressed() -> None:
    # Near a touch little force is asked: what counts is how much less there is than asked.
    excess = np.array([[0.0], [0.5], [0.0], [0.1], [0.2]])
    (reason,) = refined_reason(ball(), refined(("contact0.pressing", 0.5), excess, lifted=(2, 3, 4)))
    assert " cannot press firmly enough at 0.1 s (between goals 1 and 2), by 0.5 weights" in reason.what


def test_no_time_is_told_where_rows_are_not_samples() -> None:
    (reason,) = refined_reason(ball(), refined(("contact0.on_link", 0.1), np.ones((4, 2))))
    assert reason.what.endswith("finger 'left' cannot reach its contact, by 3 mm")


def test_a_constraint_without_words_is_told_by_its_name() -> None:
    (reason,) = refined_reason(ball(), refined(("shade0.dark", 0.1)))
    assert reason.what.endswith("finger 'left' cannot meet shade0.dark")


def test_every_constraint_of_the_stage_has_words() -> None:
    from casadi_hands.stages.refine import RefineStage
    from tests.stages.refining import carrying, sketching

    task = parse_task(BALL + "actuator: {torque: 1, speed: 1}\n")
    model = build_model(task)
    active = np.ones((len(model.schedule.samples), 2), bool)
    active[3, 0] = False
    stages = (RefineStage(model, (0, 1), (1, 2), active), carrying().stage, sketching().stage)
    names = {name for stage in stages for name in stage.problem.constraint_rows}
    assert {"ground_held.cone", "tool_point.on_path", "joint_motion0.speed"} <= names
    for name in names:
        made = refined((name, 0.1))
        made.hand.active = np.ones((7, 4), bool)  # type: ignore[misc]
        (reason,) = refined_reason(model, made)
        assert "cannot meet" not in reason.what, name
