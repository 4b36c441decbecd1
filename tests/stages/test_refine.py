"""The refine stage: its problem on a made-up hand, and a solve that the audit, which shares nothing with it, judges."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.design import Design
from casadi_hands.search.algorithm import Search
from casadi_hands.stages.floating import FloatingStage
from casadi_hands.stages.model import Model, build_model
from casadi_hands.stages.outcome import hand_of, joint_loads, whole_hand_motion
from casadi_hands.stages.refine import ACCEPTED, HOPELESS, WEIGHTS, Margin, Refined, RefineStage
from casadi_hands.stages.target import target_of
from casadi_hands.stages.whole_hand import WholeHand, WholeHandStage
from casadi_hands.task import Task, load_task
from casadi_hands.verify import Audit, audit
from tests.stages.example import (
    check_derivatives,
    doubling_each_weight,
    everything,
    made_up_finger,
    made_up_solution,
    project,
)

PROBLEMS = Path(__file__).parents[2] / "problems"
Array = np.ndarray

# The problem of a task in which everything has something to see.


class MadeUp:
    """A stage for fingers of one and two joints, the second lifted for a while, and a motion out of order."""

    def __init__(self) -> None:
        _, self.model = everything()
        model, rng = self.model, np.random.default_rng(0)
        count, contacts = len(model.schedule.samples), (0, 2)
        active = np.ones((count, model.contacts), bool)
        active[4:7, 2] = False
        fingers = tuple(made_up_finger(model, n, 2, seed=n) for n in (1, 2))
        self.start = WholeHand(
            fingers=fingers,
            contacts=contacts,
            pose=np.zeros((len(model.schedule.keyframes), 6)),
            angles=tuple(rng.uniform(-0.8, 0.8, (count, n)) for n in (1, 2)),
            palm_position=model.palm_position,
            palm_quaternion=model.palm_quaternion,
            position=rng.uniform(-0.5, 0.9, (count, 3)),
            vector=rng.uniform(-1, 1, (count, 3)),
            point=np.tile(model.patches, (count, 1, 1)) + 0.1 * rng.normal(size=(count, model.contacts, 3)),
            force=rng.normal(size=(count, model.contacts, 3)),
            active=active,
            solution=made_up_solution({}),
        )
        self.stage = RefineStage(model, contacts, (1, 2), active)
        self.values = self.stage._start(self.start)
        # Away from what the start would have it stay near.
        self.values = {name: v + 0.05 * rng.normal(size=np.shape(v)) for name, v in self.values.items()}

    def parameters(self, weights: dict[str, float], margin: Margin | None = None) -> dict[str, object]:
        given = self.stage._parameters(self.start, margin or Margin())
        return {**given, **{f"weight.{name}": weight for name, weight in weights.items()}}


@pytest.fixture(scope="module")
def made_up() -> MadeUp:
    return MadeUp()


def test_every_weight_moves_its_own_term(made_up: MadeUp) -> None:
    assert sorted(made_up.stage.problem.terms) == sorted(WEIGHTS)
    evaluate = made_up.stage.solver.evaluate
    plain = evaluate(made_up.values, made_up.parameters(WEIGHTS))
    assert min(plain.values()) > 1e-9
    moved = doubling_each_weight(
        lambda weights: evaluate(made_up.values, made_up.parameters(weights)),  # type: ignore[arg-type]
        WEIGHTS,
    )
    assert moved == {name: {name} for name in WEIGHTS}


def test_derivatives_agree_with_differences(made_up: MadeUp) -> None:
    check_derivatives(made_up.stage.solver, made_up.values, made_up.parameters(WEIGHTS))


def test_forces_vanish_where_contacts_are_broken_and_the_object_rests_at_both_ends(made_up: MadeUp) -> None:
    lower, upper = made_up.stage._bounds()
    np.testing.assert_array_equal(upper["force"][:, :3] > 0, True)
    np.testing.assert_array_equal(upper["force"][:, 3] == 0, ~made_up.start.active[:, 2])
    np.testing.assert_array_equal(upper["force"], -lower["force"])
    np.testing.assert_array_equal(upper["rate"][[0, -1]], 0)
    assert np.isinf(upper["rate"][1:-1]).all()


def test_goals_are_bounds(made_up: MadeUp) -> None:
    lower, upper = made_up.stage._bounds()
    model = made_up.model
    at = [int(np.argmin(np.abs(model.schedule.samples - time))) for time in (0, 0.6, 1.5)]
    goals = np.hstack([model.goal_positions, model.goal_vectors])
    np.testing.assert_allclose((lower["pose"][at] + upper["pose"][at]) / 2, goals, atol=1e-12)
    assert (upper["pose"] - lower["pose"])[at].max() < 1.1e-3
    assert (np.delete(upper["pose"] - lower["pose"], at, axis=0) > 10).all()


def test_a_contact_is_held_to_its_surfaces_until_it_lifts(made_up: MadeUp) -> None:
    # Held from its first active sample up to the first broken one, where it still touches.
    rows = made_up.stage.problem.constraint_rows
    active = made_up.start.active[:, 2]
    touching = active | np.r_[False, active[:-1]]
    assert len(rows["contact2.on_surfaces"]) == touching.sum()
    assert len(rows["rolling2.no_slip"]) == active[:-1].sum()
    assert len(rows["contact0.on_surfaces"]) == len(active)
    assert len(rows["apart2.clear"]) == (~touching).sum()
    assert len(rows["apart_touching2.clear"]) == touching.sum()
    assert len(rows["fingers_apart2_0.clear"]) == len(active)


# A solve: figure 3.6a with two joints a finger, from three random starts each.


@dataclass
class Solved:
    """The stage's result, and what the audit says of the files written of it."""

    task: Task
    model: Model
    whole: WholeHand
    refined: Refined
    design: Design
    verdict: Audit


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Solved:
    task = load_task(PROBLEMS / "horizontal_translation_no_gravity.yaml")
    model = build_model(task)
    floating = FloatingStage(model).solve(dict(task.weights.floating))
    search = Search(
        target_of(model, floating),
        dict(task.weights.synthesis),
        trials=3,
        recombinations=1,
        max_joints=2,
        threshold=None,
        seed=0,
        executor=None,
        progress=lambda _: None,
    )
    hand = search.run(dict.fromkeys(range(model.contacts), 2)).candidates[0].hand
    joints = (2,) * model.contacts
    stage = WholeHandStage(model, hand.contacts, joints, palm_moves=False)
    whole = stage.solve(floating, hand.fingers, dict(task.weights.whole_hand))
    refined = RefineStage(model, whole.contacts, joints, whole.active).solve(whole)
    result = refined.hand
    torque, speed = joint_loads(model, result)
    built = hand_of(task, model, result.fingers, result.contacts, torque, speed)
    design = Design(task=task, status="feasible", hand=built, motion=whole_hand_motion(model, result))
    folder = tmp_path_factory.mktemp("refined")
    design.save(folder)
    return Solved(task, model, whole, refined, design, audit(folder))


def test_the_result_is_exact_and_the_audit_certifies_it(solved: Solved) -> None:
    assert solved.refined.exact
    assert solved.refined.worst[1] <= ACCEPTED
    assert not solved.refined.slips_hopelessly
    assert solved.verdict.reasons == []
    assert solved.verdict.certified
    assert [what for what, _ in solved.refined.runs] == ["soft", "firm", "exact"]


def test_the_margins_are_kept(solved: Solved) -> None:
    motion, task, margin = solved.design.motion, solved.task, Margin()
    assert motion is not None
    weight = task.object.mass * 9.81
    for s, c in zip(*np.nonzero(motion.contact_active), strict=True):
        turn = Rotation.from_quat(motion.object_orientation[s], scalar_first=True)
        force = turn.inv().apply(motion.contact_force[s, c])
        capsule = solved.model.capsules[c] * solved.model.units.length
        inward = -project(motion.contact_point_object[s, c], capsule)[1]
        pressing = force @ inward
        assert pressing >= (margin.normal_force - 1e-3) * weight
        assert np.linalg.norm(force - pressing * inward) <= 1.002 * margin.friction * task.friction * pressing


def test_what_moved_is_told(solved: Solved) -> None:
    # The design is free: how far it went is a figure of the result, from start and end.
    length = solved.model.units.length
    for finger, contact, before in zip(
        solved.refined.hand.fingers, solved.refined.hand.contacts, solved.whole.fingers, strict=True
    ):
        moved = solved.refined.moved[solved.model.contact_names[contact]]
        assert moved["base"] == pytest.approx(np.hypot(*(finger.base - before.base)), rel=1e-9)
        assert moved["lengths"] == pytest.approx(np.abs(finger.lengths - before.lengths).max(), rel=1e-9)
        turned = [
            Rotation.align_vectors([a], [b])[0].magnitude()
            for a, b in zip(finger.axis_vectors, before.axis_vectors, strict=True)
        ]
        assert moved["axes"] == pytest.approx(max(turned), abs=1e-6)
    hand = solved.design.hand
    assert hand is not None
    for built, finger in zip(hand.fingers, solved.refined.hand.fingers, strict=True):
        np.testing.assert_allclose([link.length for link in built.links], finger.lengths * length, rtol=1e-12)
        assert np.hypot(*built.base[:2]) <= solved.task.palm.radius


def test_the_slip_left_by_the_firm_solve_is_told(solved: Solved) -> None:
    assert set(solved.refined.slips) == set(solved.task.fingers)
    assert 0 < max(solved.refined.slips.values()) < HOPELESS
    firm = dict(solved.refined.runs)["firm"].constraints
    for contact, name in enumerate(solved.model.contact_names):
        steps = np.linalg.norm(firm[f"rolling{contact}.no_slip"], axis=1)
        assert solved.refined.slips[name] == pytest.approx(steps.sum(), rel=1e-12)


def test_one_joint_cannot_roll_with_the_object_and_no_exact_solve_is_tried(solved: Solved) -> None:
    # The same motion by fingers whose outer joints are locked away: upright ones of one joint.
    model, whole = solved.model, solved.whole
    fingers = tuple(
        replace(
            finger,
            lengths=finger.lengths.sum(keepdims=True),
            frames=finger.frames[:1],
            axes=finger.axes[:1],
            angles=finger.angles[:, :1],
        )
        for finger in whole.fingers
    )
    start = replace(whole, fingers=fingers, angles=tuple(angles[:, :1] for angles in whole.angles))
    refined = RefineStage(model, whole.contacts, (1, 1, 1), whole.active).solve(start)
    assert refined.slips_hopelessly
    assert not refined.exact
    assert max(refined.slips.values()) > HOPELESS
    assert [what for what, _ in refined.runs] == ["soft", "firm"]
