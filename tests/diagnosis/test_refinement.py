"""What is said of refinements that failed: who, when, by how much, on made-up violations."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from casadi_hands.diagnosis.refinement import failing_fingers, refined_reason
from casadi_hands.nlp import Constraint
from casadi_hands.problem.model import Model
from casadi_hands.problem.si import build_model
from casadi_hands.stages.refine.result import Refined, Run, Worst
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.stages.refine.values import Margin
from casadi_hands.task import parse_task
from casadi_hands.terms import constraints as limits
from tests.stages.example import made_up_solution
from tests.stages.refining import carrying, sketching
from tests.stages.synthesis.example import BALL

pytestmark = pytest.mark.usefixtures("interpreted")

# Half an extent is 3 cm, the weight 0.1 · 9.81 N; samples are 0.1 s apart.
TORQUE_UNIT = 0.1 * 9.81 * 0.03


def ball() -> Model:
    return build_model(parse_task(BALL))


def refined(
    declared: Constraint,
    contacts: tuple[int, ...],
    violation: float,
    time: float | None = None,
    step: str = "hard constraints",
    homotopy: float = 1.0,
) -> Refined:
    """A refinement that is left with one violation."""
    hand = SimpleNamespace(contacts=(0, 1), fingers=(SimpleNamespace(joints=2), SimpleNamespace(joints=1)))
    slips, runs = {"left": 0.02, "right": 0.4}, (Run(step, made_up_solution({}), Margin()),)
    worst, slips_hopelessly = (
        Worst("shade.dark", violation, time, contacts, declared),
        not step.endswith("hard constraints"),
    )
    return Refined(hand, False, worst, slips, slips_hopelessly, slips_hopelessly, runs, {}, Margin(), homotopy)  # type: ignore[arg-type]


def test_an_exact_motion_needs_no_reason() -> None:
    met = replace(refined(limits.ACTUATED, (0,), 0.0), met=True)
    assert refined_reason(ball(), met) == []
    assert failing_fingers(ball(), met) == set()  # whatever its limits miss, it is not the worst of what is met


def test_slip_is_laid_to_the_finger_that_slips_most() -> None:
    made = refined(limits.NO_SLIP, (0,), 0.1, step="coarse stiff penalty")
    (reason,) = refined_reason(ball(), made)
    assert reason.what == "finger 'right' with 1 joint cannot roll with the object: it slips 12.0 mm"
    assert "search.max_joints" in reason.advice
    assert failing_fingers(ball(), made) == {"right"}


@pytest.mark.parametrize(
    ("declared", "contacts", "violation", "words"),
    [
        (limits.ACTUATED, (0,), 0.25, "finger 'left' cannot supply its force with its joints at {}, by 0.25 weights"),
        (limits.ON_LINK, (1,), 0.1, "finger 'right' cannot reach its contact at {}, by 3 mm"),
        (limits.WITHIN_TORQUE, (1,), 2.0, f"within the torque limit at {{}}, by {2 * TORQUE_UNIT:.2g} N·m"),
        (
            limits.WITHIN_SPEED,
            (0,),
            1.5,
            "finger 'left' cannot keep within the joints' speed limit at {}, by 1.5 rad/s",
        ),
        (
            limits.CLEAR_OF_EACH_OTHER,
            (1, 0),
            0.1,
            "fingers 'left' and 'right' cannot stay clear of each other at {}, by 3 mm",
        ),
        (limits.DEFECT, (), 0.1, "the object cannot be moved as planned by the forces of its contacts at {}"),
    ],
)
def test_who_cannot_do_what_when_and_by_how_much(
    declared: Constraint, contacts: tuple[int, ...], violation: float, words: str
) -> None:
    (reason,) = refined_reason(ball(), refined(declared, contacts, violation, 0.2))
    assert reason.what.startswith("no exact motion was found with 2+1 joints: ")
    assert reason.what.endswith(words.format("0.2 s (between goals 1 and 2)"))
    assert reason.advice


def test_no_time_is_told_where_there_is_none() -> None:
    (reason,) = refined_reason(ball(), refined(limits.ON_LINK, (0,), 0.1))
    assert reason.what.endswith("finger 'left' cannot reach its contact, by 3 mm")


def test_how_far_a_hand_can_roll_is_told() -> None:
    (reason,) = refined_reason(ball(), replace(refined(limits.ON_LINK, (0,), 0.0, homotopy=0.75), met=True))
    assert reason.what == "fingers can roll with the object over 75% of the way to its goals, and no farther"
    assert reason.explains == {"goal_position", "goal_angle"}


def test_a_constraint_without_words_is_told_by_its_name() -> None:
    (reason,) = refined_reason(ball(), refined(Constraint("dark"), (0,), 0.1))
    assert reason.what.endswith("finger 'left' cannot meet shade.dark")


def test_every_constraint_of_the_stage_has_words() -> None:
    task = parse_task(BALL + "actuator: {torque: 1, speed: 1}\n")
    model = build_model(task)
    active = np.ones((len(model.schedule.samples), 2), bool)
    active[3, 0] = False
    told = set()
    for stage in (RefineStage(model, (0, 1), (1, 2), active), carrying().stage, sketching().stage):
        for name in stage.problem.constraint_rows:
            block_name, constraint = name.split(".")
            block = stage.built.blocks[block_name]
            declared = block.kernel.declared[constraint]
            (reason,) = refined_reason(stage.model, refined(declared, block.contacts, 0.1))
            assert declared.cannot, name
            assert declared.cannot in reason.what, name
            told.add(name)
    assert {"disturbed_ground.cone", "tool_point.on_path", "joint_motion0.speed", "fingers_apart1_0.clear"} <= told
