"""The refine stage: its problem on a made-up hand, and a solve that the audit, which shares nothing with it, judges."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.export.design import Design
from casadi_hands.nlp import Options, Solution
from casadi_hands.pipeline.record import Record
from casadi_hands.pipeline.steps import adopt
from casadi_hands.problem.commands import coupled
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.outcome import whole_hand_motion
from casadi_hands.problem.regrasp import Regrasp
from casadi_hands.problem.si import build_model, design_change, hand_of, joint_loads
from casadi_hands.stages.floating.stage import FloatingStage
from casadi_hands.stages.refine import continuation
from casadi_hands.stages.refine import stage as refine
from casadi_hands.stages.refine.continuation import Continuation
from casadi_hands.stages.refine.finger_binding import lifted_clearance
from casadi_hands.stages.refine.result import Refined, Worst
from casadi_hands.stages.refine.settings import (
    ACCEPTED,
    ALL_STEPS,
    HARD_CONSTRAINTS,
    HOPELESS,
    RESTORATION,
    SPIN_WEIGHT,
    WEIGHTS,
)
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.stages.refine.touching import longest_run
from casadi_hands.stages.refine.values import TOOL_TOLERANCE, Margin, RefineValues
from casadi_hands.task import Task, load_task
from casadi_hands.terms import constraints as limits
from casadi_hands.verify import Audit, audit_files, replay
from casadi_hands.verify.reading.folder import read_folder
from tests.stages.example import STAND, project, rod
from tests.stages.refining import MadeUp, carrying, sketching
from tests.stages.searched import whole_hand_of_two_joints

PROBLEMS = Path(__file__).parents[3] / "problems"
Array = np.ndarray

# What it is given, on a made-up hand.


@pytest.fixture(scope="module")
def made_up() -> MadeUp:
    return carrying()


@pytest.fixture(scope="module")
def drawn() -> MadeUp:
    return sketching()


def test_forces_vanish_where_contacts_bear_nothing_and_the_object_rests_at_both_ends(made_up: MadeUp) -> None:
    lower, upper = made_up.stage.given.bounds()
    # One that touches anew, the second at sample 7, bears nothing yet: forces grow from zero.
    assert made_up.bearing[:, 1].tolist() == [True] * 4 + [False] * 4 + [True] * (len(upper["force"]) - 8)
    for column in range(3):
        for row in range(3 * column, 3 * column + 3):
            np.testing.assert_array_equal(upper["force"][:, row] == 0, ~made_up.bearing[:, column])
    disturbed = made_up.stage.built.disturbed
    # What holds against a disturbance that begins with a touch need not grow.
    active = made_up.stage.structure.active[disturbed]
    np.testing.assert_array_equal(upper["force_disturbed"][:, ::3] > 0, active)
    assert (active & ~made_up.bearing[disturbed]).any()
    assert not active.all()
    np.testing.assert_array_equal(upper["rate"][[0, -1]], 0)
    assert np.isinf(upper["rate"][1:-1]).all()
    for name in ("force", "force_disturbed", "rate"):
        np.testing.assert_array_equal(upper[name], -lower[name])


def test_goals_are_bounds_as_wide_as_the_task_allows(made_up: MadeUp) -> None:
    lower, upper = made_up.stage.given.bounds()
    model = made_up.model
    at = [int(np.argmin(np.abs(model.schedule.samples - time))) for time in (0, 0.6, 1.5)]
    goals = np.hstack([model.goal_positions, model.goal_vectors])
    np.testing.assert_allclose((lower["pose"][at] + upper["pose"][at]) / 2, goals, atol=1e-12)
    # 0.5 mm and half a degree, of which each of three coordinates may use 0.9 / sqrt(3).
    wide = np.tile([0.0005 / 0.0475] * 3 + [np.radians(0.5)] * 3, (3, 1)) * 0.9 / np.sqrt(3)
    np.testing.assert_allclose((upper["pose"] - lower["pose"])[at] / 2, wide, rtol=1e-9)
    assert (np.delete(upper["pose"] - lower["pose"], at, axis=0) > 10).all()


def test_a_drawing_s_goals_bound_its_tool_and_not_its_pose(drawn: MadeUp) -> None:
    lower, upper = drawn.stage.given.bounds()
    assert (upper["pose"] - lower["pose"] > 10).all()
    always = drawn.stage.given.constraint_bounds(Margin())[0]
    low, high = (np.asarray(bound) for bound in always["tool_point.on_path"])
    np.testing.assert_array_equal(low, -high)
    at = np.isin(np.round(drawn.model.schedule.samples, 9), [0, 0.7, 1.5])
    assert at.sum() == 3
    np.testing.assert_allclose(high[at], 0.9 / np.sqrt(3) * 0.0005 / 0.055, rtol=1e-9)
    np.testing.assert_array_equal(high[~at], TOOL_TOLERANCE)


def test_margins_are_bounds_of_contacts_while_they_bear(made_up: MadeUp) -> None:
    always, *others = made_up.stage.given.constraint_bounds(Margin(normal_force=0.7, structural=0.02))
    low, high = always["contact2.pressing"]
    # Lifted in samples 4 to 6, so that it bears nothing in 4 to 7; within half a second of these it bears less.
    times = made_up.model.schedule.samples
    homotopy = np.array([min(1.0, max(0, times[4] - t, t - times[7]) / 0.5) for t in times])
    assert 0 < homotopy[3] < 0.3
    assert 0 < homotopy[8] < 0.3
    np.testing.assert_allclose(np.ravel(low), 0.7 * homotopy[made_up.touching[:, 1]])
    assert high == np.inf
    exact = {name: bounds for part in others for name, bounds in part.items()}
    for c in (0, 2):
        for block in ("contact", "disturbed_contact"):
            assert exact[f"{block}{c}.structural"] == (-0.02, 0.02)
        assert exact[f"inter_knot{c}.structural"] == pytest.approx((-0.2, 0.2))
    # None of them is the name of nothing.
    assert {*always, *exact} <= set(made_up.stage.problem.constraint_rows)


def test_contacts_that_touch_anew_are_tied_to_their_plan_more_than_others_and_sliding_ones_less(
    made_up: MadeUp,
) -> None:
    model = made_up.model
    count = len(model.schedule.keyframes)
    lifted = np.zeros((count, model.contacts), bool)
    lifted[1, 2] = True
    patches = np.zeros((count, model.contacts, 3))
    patches[-1] = 0.1
    plan = Regrasp(lifted, patches)
    planned = RefineValues(made_up.stage.built, replace(model, regrasp=plan)).parameters(made_up.start, Margin())
    assert (planned["tie0"], planned["tie2"]) == (0.3, 2.0)
    plain = RefineValues(made_up.stage.built, replace(model, regrasp=None)).parameters(made_up.start, Margin())
    assert (plain["tie0"], plain["tie2"]) == (1.0, 1.0)


def test_an_object_that_rests_is_slow_and_pressed_more_firmly_then(made_up: MadeUp) -> None:
    model = made_up.model
    count = len(model.schedule.keyframes)
    lifted, still = np.zeros((count, len(model.patches)), bool), np.zeros(count, bool)
    lifted[1, 2] = still[1] = True
    plan = Regrasp(lifted, model.keyframe_patches, still=still)
    planned = RefineValues(made_up.stage.built, replace(model, regrasp=plan))
    plain = RefineValues(made_up.stage.built, replace(model, regrasp=None))
    at = model.schedule.keyframe_samples
    rests = np.zeros(len(model.schedule.samples), bool)
    rests[at[1] : at[2] + 1] = True
    (low, high), (_, free) = planned.bounds(), plain.bounds()
    np.testing.assert_allclose(high["rate"], np.where(rests[:, None], np.minimum(free["rate"], 0.03), free["rate"]))
    np.testing.assert_allclose(low["rate"], -high["rate"])
    name = "contact0.pressing"
    floors = [np.asarray(each.constraint_bounds(Margin(normal_force=0.8))[0][name][0]) for each in (planned, plain)]
    touching = planned.structure.touching[:, 0]
    np.testing.assert_allclose(floors[0][:, 0], floors[1][:, 0] * np.where(rests, 2.5, 1.0)[touching])
    # With half of what a contact may press with, at most.
    weak = RefineValues(made_up.stage.built, replace(model, regrasp=plan, force_limit=2.4))
    floor = np.asarray(weak.constraint_bounds(Margin(normal_force=0.8))[0][name][0])
    np.testing.assert_allclose(floor[:, 0], floors[1][:, 0] * np.where(rests, 1.5, 1.0)[touching])


def test_a_finger_that_has_let_go_keeps_farther_off_the_object_the_longer() -> None:
    times = np.array([0.0, 0.1, 0.3, 0.6, 0.7, 1.5])
    touching = np.array([True, True, False, False, True, False])
    np.testing.assert_allclose(lifted_clearance(touching, times), [0.0, 0.0, 0.04, 0.02, 0.0, 0.06])
    np.testing.assert_allclose(lifted_clearance(np.zeros(6, bool), times), 0.06)


def test_the_longest_run_is_that_of_a_sum() -> None:
    rng = np.random.default_rng(0)
    for flags in (*(rng.random((50, 12)) < 0.7), np.ones(12, bool), np.zeros(12, bool)):
        lengths = rng.uniform(0.02, 0.1, 12)
        pairs = itertools.groupby(zip(flags.tolist(), lengths, strict=True), key=lambda pair: pair[0])
        runs = [sum(length for _, length in run) for flag, run in pairs if flag]
        assert longest_run(flags, lengths) == pytest.approx(max([*runs, 0]))


def test_steps_without_slip_add_up_to_less_than_the_task_allows(made_up: MadeUp) -> None:
    always, *others = made_up.stage.given.constraint_bounds(Margin())
    exact = {name: bounds for part in others for name, bounds in part.items()}
    allowed = 0.0002 / 0.0475
    for name, contact in (("rolling0", 0), ("rolling2", 2), ("ground_rolling", 3)):
        assert f"{name}.no_slip" not in always
        low, high = exact[f"{name}.no_slip"]
        np.testing.assert_array_equal(low, -np.asarray(high))
        farthest = iter(np.sqrt(2) * np.ravel(high))
        together = longest = 0.0
        for flag in made_up.active[:-1, contact]:
            together = together + next(farthest) if flag else 0.0
            longest = max(longest, together)
        assert next(farthest, None) is None
        assert longest <= 0.9 * allowed


def test_surfaces_touch_within_what_the_task_allows(made_up: MadeUp) -> None:
    always, *others = made_up.stage.given.constraint_bounds(Margin())
    problem = made_up.stage.problem
    low, high = problem.constraint_lower.copy(), problem.constraint_upper.copy()
    for part in (always, *others):
        for name, bounds in part.items():
            low[problem.constraint_rows[name]], high[problem.constraint_rows[name]] = bounds
    for c in (0, 2):
        apart = sum(
            np.linalg.norm(np.maximum(np.abs(low[rows]), np.abs(high[rows])), axis=1).max()
            for rows in (problem.constraint_rows[f"contact{c}.{name}"] for name in ("on_object", "on_link"))
        )
        assert apart <= 0.00005 / 0.0475


def test_friction_keeps_its_margin_on_fingers_and_ground(made_up: MadeUp) -> None:
    given = made_up.stage.given.parameters(made_up.start, Margin(friction=0.25))
    assert given["friction"] == pytest.approx(0.25 * 0.6)
    assert given["ground_friction"] == pytest.approx(0.25 * 0.4)


def test_a_result_has_every_contact_in_its_own_place(made_up: MadeUp) -> None:
    # The middle finger is not in use: its point stays, and it bears nothing.
    start, values = made_up.start, made_up.values
    excess = {"near_design0.on_palm": np.array([[ACCEPTED]]), "near_design2.on_palm": np.zeros((1, 1))}
    refined = made_up.refined(made_up.solution(excess), Margin(friction=0.3))
    assert refined.margin == Margin(friction=0.3)
    hand, count = refined.hand, len(start.position)
    for column, contact in enumerate((0, 2, 3)):
        for name in ("point", "force"):
            given = values[name].reshape(count, 3, 3)[:, column]
            np.testing.assert_array_equal(getattr(hand, name)[:, contact], given)
        np.testing.assert_array_equal(hand.active[:, contact], start.active[:, contact])
    np.testing.assert_array_equal(hand.point[:, 1], start.point[:, 1])
    assert not hand.force[:, 1].any()
    assert not hand.active[:, 1].any()
    np.testing.assert_array_equal(np.hstack([hand.position, hand.vector]), values["pose"])
    assert refined.exact
    assert refined.worst == Worst("near_design0.on_palm", ACCEPTED, None, (0,), limits.ON_PALM)
    # Nor is it a contact of the motion that is written: no link is there to touch.
    first, _, last = made_up.model.contact_names
    motion = whole_hand_motion(made_up.model, replace(hand, fingers=start.fingers, angles=start.angles))
    assert motion.contact_names == (first, last, "ground")
    assert motion.contact_link == ("finger0_link0", "finger1_link1", "ground")
    np.testing.assert_array_equal(motion.contact_active, hand.active[:, [0, 2, 3]])
    assert motion.contact_point_link.shape == (count, 3, 3)


@pytest.mark.parametrize("violation", [1.01 * ACCEPTED, np.inf])
def test_a_motion_that_violates_is_not_exact(made_up: MadeUp, violation: float) -> None:
    refined = made_up.refined(
        made_up.solution(
            {name: np.array([[x]]) for name, x in (("near_design0.on_palm", 0.0), ("near_design2.on_palm", violation))}
        )
    )
    assert not refined.exact
    assert refined.worst == Worst("near_design2.on_palm", violation, None, (2,), limits.ON_PALM)


@pytest.mark.parametrize(
    ("constraint", "instance", "sample", "contacts"),
    [
        # The second finger in use is lifted in samples 4 to 6; its point is on both bodies until the first of these.
        ("contact2.on_link", 5, 7, (2,)),
        ("rolling2.no_slip", 4, 7, (2,)),
        ("apart2.clear", 1, 6, (2,)),
        ("contact0.cone", 5, 5, (0,)),
        ("disturbed_contact2.cone", 1, 7, (2,)),
        ("disturbed.sum", 0, 3, ()),
        ("physics.defect", 14, 14, ()),
        ("fingers_apart2_0.clear", 6, 6, (2, 0)),
    ],
)
def test_the_worst_violation_is_told_with_its_time_and_whom_it_is_about(
    made_up: MadeUp, constraint: str, instance: int, sample: int, contacts: tuple[int, ...]
) -> None:
    rows = made_up.stage.problem.constraint_rows[constraint]
    excess = np.zeros(rows.shape)
    excess[instance, -1] = 2.0
    worst = made_up.refined(made_up.solution({constraint: excess, "near_design0.on_palm": np.ones((1, 1))})).worst
    assert (worst.constraint, worst.violation, worst.contacts) == (constraint, 2.0, contacts)
    assert worst.declared.name == constraint.split(".")[1]
    assert worst.time == pytest.approx(made_up.model.schedule.samples[sample])


@pytest.mark.parametrize("options", [HARD_CONSTRAINTS, RESTORATION])
def test_no_exact_solve_may_end_with_more_violation_than_is_accepted(options: Options) -> None:
    assert options.ipopt()["constr_viol_tol"] <= ACCEPTED
    assert options.ipopt()["acceptable_constr_viol_tol"] <= ACCEPTED


def test_costs_hold_near_to_the_wanted_motion_and_constraints_to_where_it_is(made_up: MadeUp) -> None:
    given, motion = made_up.stage.given, made_up.start
    finger = replace(motion.fingers[0], lengths=motion.fingers[0].lengths + 0.5)
    wanted = replace(
        motion,
        position=motion.position + 1,
        point=motion.point + 0.1,
        force=motion.force + 2,
        fingers=(finger, *motion.fingers[1:]),
    )
    own, other = given.parameters(motion, Margin()), given.parameters(motion, Margin(), wanted)
    for name, shift in (("wanted_pose", [1] * 3 + [0] * 3), ("wanted_point0", 0.1), ("wanted_force0", 2)):
        np.testing.assert_allclose(
            np.asarray(other[name]) - np.asarray(own[name]), np.broadcast_to(shift, np.shape(own[name]))
        )
    np.testing.assert_allclose(np.asarray(other["wanted_lengths0"]) - np.asarray(own["wanted_lengths0"]), 0.5)
    held = {
        "wanted_pose",
        *(f"wanted_{what}{c}" for what in ("point", "force") for c in made_up.stage.structure.columns),
    }
    for name in own.keys() - held - {"wanted_lengths0"}:
        np.testing.assert_array_equal(np.asarray(other[name]), np.asarray(own[name]), name)


def test_a_start_that_is_no_number_is_never_accepted(drawn: MadeUp) -> None:
    # IPOPT does not even begin; what it says of such a solve is that nothing is violated.
    values = drawn.stage.given.start(drawn.start) | {"point": np.full_like(drawn.values["point"], np.nan)}
    solution = drawn.stage.solver.solve(values, drawn.parameters(WEIGHTS), HARD_CONSTRAINTS)
    assert solution.objective == np.inf
    assert solution.violations["wrench.sum"] == np.inf
    assert not drawn.refined(solution).exact


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
    whole = whole_hand_of_two_joints(task, model, floating, trials=3)
    refined = Continuation(model, whole.contacts, (2,) * model.contacts, whole.active).solve(whole, Margin())
    result = refined.hand
    torque, speed = joint_loads(model, result)
    built = hand_of(task, model, result.fingers, result.contacts, torque, speed)
    design = Design(task=task, status="feasible", hand=built, motion=whole_hand_motion(model, result))
    folder = tmp_path_factory.mktemp("refined")
    design.save(folder)
    return Solved(task, model, whole, refined, design, audit_files(folder))


def test_the_result_is_exact_and_the_audit_certifies_it(solved: Solved) -> None:
    assert solved.refined.exact
    assert solved.refined.worst.violation <= ACCEPTED
    assert not solved.refined.slips_hopelessly
    assert not solved.refined.barely_rolls
    assert solved.verdict.reasons == []
    assert solved.verdict.certified
    names = [run.what for run in solved.refined.runs]
    assert (names[0], names[-1]) == ("sparse penalty", "hard constraints")


def test_two_motors_turn_its_six_joints_and_move_them_in_the_replay(solved: Solved, tmp_path: Path) -> None:
    model, hand = replace(solved.model, motors=2), solved.refined.hand
    begun = coupled(model, hand, 2)
    refined = Continuation(model, hand.contacts, (2,) * model.contacts, hand.active).solve(begun, Margin(), near=True)
    assert refined.exact
    record = Record(solved.task.model_copy(update={"motors": 2}), None, lambda _: None)
    adopt(record, model, refined.hand)
    record.design.save(tmp_path)
    verdict = audit_files(tmp_path)
    assert verdict.reasons == []
    assert verdict.figures["coupling"].value < 2e-5
    found = read_folder(tmp_path)
    assert found.drive is not None
    assert found.drive.ratios.shape == (6, 2)
    told = []
    played = replay(tmp_path, observer=lambda _, data: told.append(data.ctrl.copy()))
    assert np.shape(told)[1] == 2
    assert not played.dropped
    assert played.position_max < 2e-3


def test_the_files_have_the_points_and_forces_that_balance(solved: Solved) -> None:
    # A point moved onto the surface by a gap of 1e-5 lengths is another lever: a torque that nothing exerts.
    motion, hand, units = solved.design.motion, solved.refined.hand, solved.model.units
    assert motion is not None
    np.testing.assert_allclose(motion.contact_point_object, hand.point * units.length, atol=1e-7 * units.length)
    for k, vector in enumerate(hand.vector):
        turn = Rotation.from_rotvec(vector) * Rotation.from_quat(solved.model.reference, scalar_first=True)
        np.testing.assert_allclose(motion.contact_force[k], turn.apply(hand.force[k]) * units.force, atol=1e-9)


def test_the_margins_are_kept(solved: Solved) -> None:
    motion, task, margin = solved.design.motion, solved.task, Margin()
    assert motion is not None
    weight = task.object.mass * 9.81
    for s, c in zip(*np.nonzero(motion.contact_active), strict=True):
        turn = Rotation.from_quat(motion.object_orientation[s], scalar_first=True)
        force = turn.inv().apply(motion.contact_force[s, c])
        capsule = rod(solved.model.touched[c]) * solved.model.units.length
        inward = -project(motion.contact_point_object[s, c], capsule)[1]
        pressing = force @ inward
        assert pressing >= (margin.normal_force - 1e-3) * weight
        assert np.linalg.norm(force - pressing * inward) <= 1.002 * margin.friction * task.friction * pressing


def test_links_are_bent_and_joints_hinged_as_the_task_allows(solved: Solved) -> None:
    least, largest = solved.task.hand.axes.from_link
    assert (solved.task.hand.bend, least, largest) == (90, 60, 90)
    assert solved.design.hand is not None
    seen = []
    for built, finger in zip(solved.design.hand.fingers, solved.refined.hand.fingers, strict=True):
        for j, link in enumerate(built.links):
            np.testing.assert_allclose(link.bend, finger.bends[j], rtol=1e-12)
            turn = Rotation.from_rotvec([*link.bend, 0.0])
            assert np.degrees(turn.magnitude()) <= 90 + 1e-4
            for x, y, z in [link.axis, turn.apply(link.axis)][: 2 if j else 1]:
                seen.append(np.degrees(np.arctan2(np.hypot(x, y), abs(z))))
    assert min(seen) >= least - 1e-4
    assert max(seen) <= largest + 1e-4
    # Bends are variables: they are used.
    assert max(np.abs(finger.bends).max() for finger in solved.refined.hand.fingers) > 0.01


def test_what_moved_is_told(solved: Solved) -> None:
    # The design is free: how far it went is a figure of the result, from start and end.
    length = solved.model.units.length
    changes = design_change(solved.model, solved.whole, solved.refined.hand)
    for finger, contact, before in zip(
        solved.refined.hand.fingers, solved.refined.hand.contacts, solved.whole.fingers, strict=True
    ):
        moved = changes[solved.model.contact_names[contact]]
        assert moved["base"] == pytest.approx(length * np.hypot(*(finger.base - before.base)), rel=1e-9)
        assert moved["lengths"] == pytest.approx(length * np.abs(finger.lengths - before.lengths).max(), rel=1e-9)
        assert min(moved.values()) > 0
        turned = [
            Rotation.align_vectors([a], [b])[0].magnitude()
            for a, b in zip(finger.axis_vectors, before.axis_vectors, strict=True)
        ]
        assert moved["axes"] == pytest.approx(max(turned), abs=1e-6)
        assert moved["bends"] == pytest.approx(np.hypot(*(finger.bends - before.bends).T).max(), rel=1e-9)
    hand = solved.design.hand
    assert hand is not None
    for built, finger in zip(hand.fingers, solved.refined.hand.fingers, strict=True):
        np.testing.assert_allclose([link.length for link in built.links], finger.lengths * length, rtol=1e-12)
        assert np.hypot(*built.base[:2]) <= solved.task.palm.radius
        assert built.base[2] == pytest.approx(STAND * solved.task.hand.link_radius, rel=1e-12)


def test_one_joint_cannot_roll_with_the_object_and_no_exact_solve_is_tried(solved: Solved) -> None:
    # The same motion by fingers whose outer joints are locked away: upright ones of one joint.
    model, whole = solved.model, solved.whole
    fingers = tuple(
        replace(
            finger,
            lengths=finger.lengths.sum(keepdims=True),
            frames=finger.frames[:1],
            axes=finger.axes[:1],
            bends=finger.bends[:1],
            angles=finger.angles[:, :1],
        )
        for finger in whole.fingers
    )
    start = replace(whole, fingers=fingers, angles=tuple(angles[:, :1] for angles in whole.angles))
    refined = Continuation(model, whole.contacts, (1, 1, 1), whole.active).solve(start, Margin())
    assert refined.slips_hopelessly
    assert refined.barely_rolls
    assert not refined.exact
    assert max(refined.slips.values()) > HOPELESS
    assert set(refined.slips) == set(solved.task.fingers)
    last = refined.runs[-1].solution.constraints
    for contact, name in enumerate(model.contact_names):
        steps = np.linalg.norm(last[f"rolling{contact}.no_slip"], axis=1)
        assert refined.slips[name] == pytest.approx(steps.sum(), rel=1e-12)
    names = [run.what for run in refined.runs]
    assert names[0] == "sparse penalty"
    assert not any("hard constraints" in name for name in names)
    assert len(refined.hand.position) == len(model.schedule.samples)
    given = {f"sparse {what}": weights | {"spin": SPIN_WEIGHT[what]} for what, weights, _ in ALL_STEPS}
    assert refined.weights == given[names[-1]] | {"pivot_slip": 0.0}


def test_an_exact_motion_stays_itself_by_the_short_way(solved: Solved) -> None:
    model, before = solved.model, solved.refined.hand
    ways = Continuation(model, before.contacts, (2,) * model.contacts, before.active)
    again = ways.solve(before, Margin(), near=True)
    assert again.exact
    assert {run.margin for run in again.runs} == {Margin()}
    names = [run.what for run in again.runs]
    assert (names[0], names[-1]) == ("hard constraints", "hard constraints")
    assert not any("penalty" in name for name in names)
    # It could have stayed as it was: what it leaves, it leaves for a gain.
    assert again.hand.solution.objective <= sum(ways.fine.costs(ALL_STEPS[-1], before, Margin()).values())
    np.testing.assert_allclose(again.hand.position, before.position, atol=0.02)
    assert all(0 < slip < 4e-3 for slip in again.slips.values())


def farther_to_the_side(solved: Solved) -> Model:
    """The task with its second goal a little farther to the side."""
    shift = [[0, 0, 0], [0, 0.05, 0], [0, 0, 0], [0, 0, 0]]
    return replace(solved.model, goal_positions=np.add(solved.model.goal_positions, shift))


def test_an_exact_solve_that_is_cut_short_ends_with_the_exact_motion_nearest_to_it(
    solved: Solved, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, before = farther_to_the_side(solved), solved.refined.hand
    stage = RefineStage(model, before.contacts, (2,) * model.contacts, before.active)
    last, weights, options = ALL_STEPS[-1]
    steps = ((last, weights, replace(options, max_iter=1)),)
    found = stage.take(steps, before, Margin())
    assert found.exact
    solution = found.hand.solution
    assert (solution.terms.keys(), solution.violation <= ACCEPTED) == (set(stage.problem.terms), True)
    assert solution.objective == pytest.approx(sum(solution.terms.values()))
    assert solution.objective == pytest.approx(sum(stage.costs(steps[0], found.hand, Margin()).values()), rel=0.5)
    # The second goal is 0.05 away, and nothing has to go farther.
    assert np.abs(found.hand.position - before.position).max() < 0.06
    with monkeypatch.context() as brief:
        for name in ("GOOD", "RESTORATION"):
            brief.setattr(refine, name, replace(getattr(refine, name), max_iter=1))
        assert stage.take(steps, before, Margin()).runs[-1].solution.iterations == 3  # what was in vain is told, too
    monkeypatch.setattr(RefineStage, "_restored", lambda self, solution, *_: solution)
    assert not stage.take(steps, before, Margin()).met


def test_where_the_short_way_leads_nowhere_the_long_one_is_taken(
    solved: Solved, monkeypatch: pytest.MonkeyPatch
) -> None:
    last, weights, options = continuation.NEARBY_STEPS[-1]
    vain = continuation.NEARBY_STEPS[0], (last, weights, replace(options, max_iter=1))
    monkeypatch.setattr(continuation, "NEARBY_STEPS", vain)
    monkeypatch.setattr(continuation, "NEARLY_EXACT", 0.0)
    projected = RefineStage._restored

    def unless_vain(self: RefineStage, solution: Solution, *given: Any) -> Solution:
        return solution if solution.iterations == 1 else projected(self, solution, *given)

    monkeypatch.setattr(RefineStage, "_restored", unless_vain)
    before, farther = solved.refined.hand, farther_to_the_side(solved)
    model = solved.model
    again = Continuation(farther, before.contacts, (2,) * model.contacts, before.active).solve(
        before, Margin(), near=True
    )
    assert again.exact
    names = [run.what for run in again.runs]
    assert (names[0], names[-1]) == ("sparse stiff penalty", "hard constraints")
    assert "sparse penalty" in names
