"""Costs and bounds of one's own: what they do to a motion, what is reported of them, and what is refused."""

from __future__ import annotations

import pickle
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands import Bound, Cost, Design, solve
from casadi_hands.errors import SolveError
from casadi_hands.pipeline.record import Record
from casadi_hands.pipeline.steps import prepare_search, run_floating
from casadi_hands.problem.motion import Motion
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.stage import FloatingStage
from casadi_hands.stages.object_motion.values import object_parameters, term_weights
from casadi_hands.stages.own_terms import own_weights, try_out
from casadi_hands.task import parse_task
from casadi_hands.terms.own import Instant
from tests.documents import README, ROOT, blocks
from tests.stages.example import check_derivatives, everything
from tests.stages.synthesis.example import BALL

# Two fingers carry a ball 1.5 cm to the side.
TASK = parse_task(f"name: ball{BALL}search: {{trials: 6, recombinations: 3, max_joints: 2}}\n")
EXAMPLE = ROOT / "examples" / "own_cost.py"


def lowered(at: Instant) -> Any:
    """Height above 8 cm, in cm; the ball is to be at 9 cm at both goals."""
    return (at.position[2] - 0.08) / 0.01


def squeezing(at: Instant) -> Any:
    return [ca.sumsqr(force) for force in at.forces.values()]


def cost_of(stage: str, **weights: float) -> Design:
    terms = [Cost(name, lowered, stage, weight) for name, weight in weights.items()]
    return solve(TASK, jobs=1, until=stage, terms=terms)


def motion_of(design: Design) -> Motion:
    assert design.motion is not None
    return design.motion


# Residuals of everything that an instant has, and what they are of a motion, written with NumPy.
RESIDUALS: dict[str, tuple[Callable[[Instant], Any], Callable[[Motion], np.ndarray]]] = {
    "place": (lambda at: at.position / 0.05, lambda m: m.object_position / 0.05),
    "turned": (
        lambda at: ca.mtimes(at.rotation, ca.DM([1, 2, 3])),
        lambda m: Rotation.from_quat(m.object_orientation, scalar_first=True).apply([1, 2, 3]),
    ),
    "left": (lambda at: at.points["left"] * 20, lambda m: m.contact_point_object[:, 0] * 20),
    "pushed": (
        lambda at: [*ca.vertsplit(at.forces["left"]), at.forces["right"][1]],
        lambda m: np.hstack([m.contact_force[:, 0], m.contact_force[:, 1, 1:2]]),
    ),
    "late": (
        lambda at: at.time * at.position[1] * 10,
        lambda m: (m.time * m.object_position[:, 1] * 10)[:, None],
    ),
}
ANGLES: dict[str, tuple[Callable[[Instant], Any], Callable[[Motion], np.ndarray]]] = {
    "bent": (
        lambda at: ca.vertcat(2 * at.angles["left"][0], at.angles["right"][-1]),
        lambda m: np.column_stack([2 * m.joint_angles[:, 0], m.joint_angles[:, -1]]),
    )
}


@pytest.mark.parametrize("stage", ["floating", "whole_hand"])
def test_what_is_reported_is_the_weight_times_the_mean_of_the_residuals_of_the_motion(stage: str) -> None:
    chosen = RESIDUALS if stage == "floating" else {**RESIDUALS, **ANGLES}
    terms = [Cost(name, given, stage, 0.01 * k) for k, (name, (given, _)) in enumerate(chosen.items(), 1)]
    total = Cost("total", lambda at: ca.sum1(at.forces["left"] ** 2), stage, 0.02, "sum")
    design = solve(TASK, jobs=1, until=stage, terms=[*terms, total])
    motion, reported = motion_of(design), design.costs[stage]
    assert list(reported)[-len(terms) - 1 :] == [*chosen, "total"]  # after the stage's own
    for term in terms:
        residual = chosen[term.name][1](motion)
        # Contacts are written where they are nearest the surface, which soft stages leave them off a little.
        close = 5e-2 if term.name == "left" and stage != "floating" else 1e-6
        expected = term.weight * (residual**2).sum(axis=1).mean()
        assert reported[term.name] == {"weight": term.weight, "value": pytest.approx(expected, rel=close)}
    assert reported["total"]["value"] == pytest.approx(0.02 * (motion.contact_force[:, 0] ** 2).sum(axis=1).mean())


def test_a_heavier_cost_takes_the_motion_farther() -> None:
    heights = [motion_of(cost_of("floating", low=weight)).object_position[:, 2].mean() for weight in (0.0, 5.0, 50.0)]
    assert heights[0] == pytest.approx(0.09, abs=1e-5)
    assert heights[0] - 1e-5 > heights[1] > heights[2] + 1e-4


def test_bounds_are_kept_by_every_entry_at_every_sample() -> None:
    free = motion_of(solve(TASK, jobs=1, until="floating"))
    forces = np.linalg.norm(free.contact_force, axis=2)
    assert forces.max() > 1.1
    bound = Bound("gentle", squeezing, "floating", upper=[1.1**2, 1.2**2])
    design = solve(TASK, jobs=1, until="floating", terms=[bound])
    held = np.linalg.norm(motion_of(design).contact_force, axis=2)
    assert (held.max(axis=0) < [1.1 + 1e-3, 1.2 + 1e-3]).all()
    assert held.max() > 1.09  # and no farther than needed
    assert (design.status, design.reason) == ("feasible", "stopped after the stage floating, as asked")


@pytest.mark.parametrize("stage", ["floating", "whole_hand"])
def test_a_stage_that_cannot_meet_a_bound_fails_and_says_so(stage: str) -> None:
    bound = Bound("below", lambda at: at.position[2], stage, upper=0.085)
    design = solve(TASK, jobs=1, until=stage, terms=[bound])
    assert design.status == "failed"
    # The goals are as high as each other.
    assert re.match(
        rf"the stage {stage} cannot meet 'below' at goal [12] \(0(\.6)? s\), by 0\.005; try ", design.reason
    )


def test_the_refinement_says_which_bound_it_cannot_meet() -> None:
    bound = Bound("below", lambda at: at.position[2], upper=0.085)
    design = solve(TASK, jobs=1, terms=[bound])
    assert design.status != "certified"
    assert "no exact motion was found with 2+2 joints: it cannot meet 'below' at " in design.reason
    assert ", by 0.00" in design.reason


@pytest.mark.slow
def test_a_refined_motion_goes_where_a_cost_takes_it_and_keeps_bounds() -> None:
    free = motion_of(solve(TASK, jobs=1))
    assert free.object_position[:, 2].min() > 0.0895
    low = Cost("low", lowered, weight=100.0)
    above = Bound("above", lambda at: at.position[2], lower=0.0885)
    for terms, least in (([low], 0.0), ([low, above], 0.0885)):
        design = solve(TASK, jobs=1, terms=terms)
        assert design.status == "certified"
        height = motion_of(design).object_position[:, 2]
        assert height.mean() < free.object_position[:, 2].mean() - 4e-4
        assert height.min() > least - 1e-8
        assert design.costs["refine"]["low"]["value"] == pytest.approx(100 * (((height - 0.08) / 0.01) ** 2).mean())


def test_a_certified_motion_that_misses_a_bound_is_not_called_so() -> None:
    kept = Record(TASK, None, lambda _: None)
    certified = replace(kept.design, status="certified", reason="")
    assert kept.held_to_bounds(certified) is certified
    model = replace(build_model(TASK), own_terms=(Bound("below", lambda at: at.position[2], "floating", upper=0.085),))
    run_floating(kept, model)
    held = kept.held_to_bounds(certified)
    assert held.status == "feasible"
    assert held.reason.startswith("the stage floating cannot meet 'below'")
    assert kept.held_to_bounds(held) is held


def test_derivatives_are_exact() -> None:
    terms = (  # with a ground, and a palm that moves
        Cost("own_turn", lambda at: at.rotation[0, 1] * at.forces["thumb"], "floating"),
        Cost("own_reach", lambda at: ca.sin(9 * at.points["ground"]) * at.position, "floating", 2.0, "sum"),
        Bound("own_lift", lambda at: at.time * at.position[2] * at.forces["ground"], "floating"),
    )
    task, plain = everything()
    model = replace(plain, own_terms=terms)
    stage, rng = FloatingStage(model), np.random.default_rng(0)
    values = {name: value + 0.1 * rng.normal(size=np.shape(value)) for name, value in stage.start().items()}
    # Alone: where bodies overlap and cones are left, curvatures of the stage's own terms are far larger.
    given = term_weights(stage.solver.problem, model, dict(task.weights.floating) | own_weights(model, "floating"))
    alone = {name: value if "own" in name or "weight" not in name else 0.0 for name, value in given.items()}
    check_derivatives(stage.solver, values, object_parameters(model) | alone)


def test_without_terms_problems_have_nothing_of_them() -> None:
    problem = FloatingStage(everything()[1]).solver.problem
    assert not {"time", "unit_length", "unit_force"} & set(problem.parameters.names())
    assert not any(name.startswith("own") for name in problem.constraint_rows)


def test_workers_get_nothing_of_them() -> None:
    kept = Record(TASK, None, lambda _: None)
    model = replace(build_model(TASK), own_terms=(Cost("low", lambda at: at.position[2], "floating"),))
    search = prepare_search(kept, model, run_floating(kept, model), None)
    assert pickle.loads(pickle.dumps(search.target)).model.own_terms == ()


# What is refused.

LOW = Cost("low", lowered, "floating")


@pytest.mark.parametrize(
    ("terms", "words"),
    [
        ([replace(LOW, stage="synthesis")], "'low' is for the stage 'synthesis'; allowed: floating, whole_hand, re"),
        (
            [replace(LOW, name="goal")],
            "'goal' is a built-in term's name, as are .*angular_momentum, .*task.*; give it another",
        ),
        ([replace(LOW, name="linear_momentum_perturbed")], "is a built-in term's name"),
        ([replace(LOW, name="too low")], "the name 'too low' is refused; allowed: letters, digits and underscores"),
        ([LOW, Bound("low", lowered, "floating")], "the stage floating is given 'low' twice"),
        ([replace(LOW, weight=-1.0)], "'low' has the weight -1.0; allowed: a number, 0 or more"),
        ([replace(LOW, form="cube")], "'low' has the form 'cube'; allowed: square, sum"),
        ([Bound("low", lowered, lower=1.0, upper=0.0)], "'low' has bounds 1.0 to 0.0; allowed: lower <= upper"),
        ([lowered], "given <function lowered .*allowed: casadi_hands.Cost and casadi_hands.Bound"),
    ],
)
def test_terms_that_cannot_be_used_are_refused(terms: list[Any], words: str, tmp_path: Path) -> None:
    with pytest.raises(SolveError, match=f"terms: .*{words}|terms: {words}"):
        solve(TASK, jobs=1, until="floating", terms=terms, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_one_name_may_stand_for_the_same_in_several_stages() -> None:
    terms = [replace(LOW, stage=stage, weight=3.0) for stage in ("floating", "whole_hand")]
    design = solve(TASK, jobs=1, until="whole_hand", terms=terms)
    assert [design.costs[stage]["low"]["weight"] for stage in ("floating", "whole_hand")] == [3.0, 3.0]


@pytest.mark.parametrize("stage", ["floating", "refine"])
@pytest.mark.parametrize(
    ("residual", "error", "words"),
    [
        (lambda at: at.position[2] * (1 / 0), ZeroDivisionError, "division by zero"),
        (lambda at: at.points["thumb"], KeyError, "thumb"),
        (lambda at: at.position + ca.DM.zeros(4), RuntimeError, "[Dd]imension"),
        (lambda at: 1.0, TypeError, "the residual of 'mine' gives 1.0, not an expression of the instant's symbols"),
        (lambda at: at.position[0] * ca.SX.sym("strange"), RuntimeError, "strange"),
    ],
)
def test_a_mistake_in_a_residual_is_raised_before_anything_is_computed(
    stage: str, residual: Any, error: type[Exception], words: str, tmp_path: Path
) -> None:
    with pytest.raises(error, match=words) as raised:
        solve(TASK, jobs=1, terms=[Cost("mine", residual, stage)], out=tmp_path / "out")
    if error in (ZeroDivisionError, KeyError):  # with the line that is wrong
        assert raised.traceback[-1].path == Path(__file__)
    assert not (tmp_path / "out").exists()


def test_bounds_of_another_size_than_their_residual_are_an_error() -> None:
    model = replace(build_model(TASK), own_terms=(Bound("place", lambda at: at.position, "floating", lower=[0, 1]),))
    with pytest.raises(ValueError, match="the bounds of 'place' are for 2 entries, not 3"):
        try_out(model, 2)


# The example.


def test_the_example_is_short_and_stands_in_the_documents() -> None:
    code = EXAMPLE.read_text(encoding="utf-8").partition('"""\n\n')[2]
    assert len([line for line in code.splitlines() if line.strip()]) <= 20
    assert code == blocks(ROOT / "docs/how-to/own-cost.md", "python")[0]


def test_the_example_does_what_it_says(tmp_path: Path) -> None:
    (task,) = blocks(README, "yaml")
    (tmp_path / "task.yaml").write_text(task, encoding="utf-8")
    done = subprocess.run([sys.executable, EXAMPLE], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (height, force), (lower, gentler) = (
        (float(line.split()[2]), float(line.split()[6])) for line in done.stdout.splitlines()
    )
    assert lower < height - 0.015
    assert gentler <= 1.2 < force
