"""Which limit is told to be in the way of a motion, on made-up multipliers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from casadi_hands.diagnosis.refinement import refined_reason
from casadi_hands.nlp import Solution
from casadi_hands.problem.si import build_model
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.stages.refine.tightest import LEAST, Tightest, tightest
from casadi_hands.task import parse_task
from tests.stages.refining import MadeUp, carrying
from tests.stages.synthesis.example import BALL

pytestmark = pytest.mark.usefixtures("interpreted")


@pytest.fixture(scope="module")
def made() -> MadeUp:
    return carrying()


def pressed(
    made: MadeUp, limits: dict[str, float], bounds: dict[str, tuple[int, int, float]] | None = None
) -> Solution:
    """A solution whose limits are pressed so hard at their second instance, variables at the given entry."""
    problem = made.stage.problem
    multipliers = {name: np.zeros(rows.shape) for name, rows in problem.constraint_rows.items()}
    for name, size in limits.items():
        multipliers[name][1, 0] = size
    bound = {name: np.zeros(np.shape(value)) for name, value in made.values.items()}
    for name, (row, column, size) in (bounds or {}).items():
        bound[name][row, column] = size
    return replace(made.solution(), multipliers=multipliers, bound_multipliers=bound)


def test_no_limit_is_told_where_none_is_pressed(made: MadeUp) -> None:
    assert tightest(made.stage.built, pressed(made, {}), "rolling0.no_slip") is None


def test_the_hardest_pressed_limit_is_told_with_its_time_and_finger(made: MadeUp) -> None:
    solution = pressed(made, {"apart2.clear": 7.0, "contact0.structural": 3.0})
    found = tightest(made.stage.built, solution, "rolling0.no_slip")
    block = made.stage.built.blocks["apart2"]
    assert found is not None
    assert (found.limit, found.contacts) == ("apart2.clear", (2,))
    assert found.time == made.model.schedule.samples[block.knots[1]]
    assert found.declared is not None
    assert found.declared.cannot == "stay clear of the other bodies"


def test_what_is_violated_is_not_in_its_own_way(made: MadeUp) -> None:
    solution = pressed(made, {"apart2.clear": 7.0}, {"angles0": (3, 0, 5.0)})
    found = tightest(made.stage.built, solution, "apart2.clear")
    assert found == Tightest("angles", float(made.model.schedule.samples[3]), (0,))
    slight = pressed(made, {"apart2.clear": 7.0}, {"angles0": (3, 0, 0.9 * LEAST * 7.0)})
    assert tightest(made.stage.built, slight, "apart2.clear") is None


WORDS = {
    "angles2": "are the limits of the joints of finger '{}' (hand.joint_limits) at ",
    "lengths2": "is how long or short links of finger '{}' may be (hand.link_length)",
    "base2": "is that finger '{}' must stand on the palm (palm.radius)",
    "bends2": "is how far links of finger '{}' may be bent (hand.bend)",
}


@pytest.mark.parametrize("name", WORDS)
def test_bounds_of_variables_are_told_by_the_fields_that_they_come_from(made: MadeUp, name: str) -> None:
    solution = pressed(made, {}, {name: (0, 0, 2.0)})
    excess = {"rolling0.no_slip": np.ones(made.stage.problem.constraint_rows["rolling0.no_slip"].shape)}
    refined = made.refined(replace(solution, excess=excess))
    assert refined.tightest is not None
    (reason,) = refined_reason(made.model, refined)
    words = f"; in the way {WORDS[name]}".format(made.model.contact_names[2])
    assert words in reason.what
    assert reason.what.startswith("no exact motion was found with 1+2 joints: finger ")


def test_a_force_is_of_the_finger_whose_column_it_is_in(made: MadeUp) -> None:
    found = tightest(made.stage.built, pressed(made, {}, {"force": (2, 4, 1.0)}), "rolling0.no_slip")
    assert found is not None
    assert found.contacts == (made.stage.structure.columns[1],)


def test_goals_are_told(made: MadeUp) -> None:
    solution = pressed(made, {}, {"pose": (0, 2, 1.0)})
    excess = {"rolling0.no_slip": np.ones(made.stage.problem.constraint_rows["rolling0.no_slip"].shape)}
    (reason,) = refined_reason(made.model, made.refined(replace(solution, excess=excess)))
    assert reason.what.endswith("; in the way is that the object must be at goal 1 (0 s)")


def test_a_limit_is_told_beside_what_it_keeps_from_being_met(made: MadeUp) -> None:
    solution = pressed(made, {"apart2.clear": 2.0})
    excess = {"rolling0.no_slip": np.ones(made.stage.problem.constraint_rows["rolling0.no_slip"].shape)}
    (reason,) = refined_reason(made.model, made.refined(replace(solution, excess=excess)))
    other = made.model.contact_names[2]
    assert f"; in the way is that finger '{other}' must stay clear of the other bodies at " in reason.what


def test_limits_narrower_than_their_margins_leave_joints_a_range() -> None:
    narrow = "hand: {joint_limits: [-0.001, 0.001]}\n"
    model = build_model(parse_task(BALL + narrow))
    stage = RefineStage(model, (0, 1), (1, 2), np.ones((len(model.schedule.samples), 2), bool))
    bounds = [stage.problem.variables.unpack(side)["angles0"] for side in (stage.problem.lower, stage.problem.upper)]
    np.testing.assert_allclose(np.rad2deg(bounds[0]), -0.0005)
    np.testing.assert_allclose(np.rad2deg(bounds[1]), 0.0005)
