"""Planned regrasps: when a contact lets go, where it takes the object anew, and how its point moves meanwhile."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.problem.model import Model, sampled_points
from casadi_hands.problem.regrasp import Regrasp
from casadi_hands.problem.resampling import shortened
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating import stage as floating_stage
from casadi_hands.stages.floating.gate import passes_gate
from casadi_hands.stages.floating.regrasp import FARTHEST, limited_travel, planned_regrasp, resting_intervals
from casadi_hands.stages.floating.stage import (
    BARRIERS,
    LIMITED,
    LIMITED_TRAVEL,
    REGRASP,
    WALKING,
    FloatingStage,
    solve_floating,
)
from casadi_hands.stages.object_motion.values import (
    LANDING_ROOM,
    REGRASP_ROOM,
    landing_bounds,
    point_bounds,
    straight_path,
)
from casadi_hands.stages.refine.touching import resting
from casadi_hands.task import parse_task
from casadi_hands.verify.checks.motion import NEAR
from tests.pencil import pencil
from tests.stages.example import made_up_solution, rod

Array = np.ndarray


def turning(degrees: float, palm: str = "position: [0, 0, 0.3], facing: [1, 0, 0]") -> Model:
    """A capsule that turns between two fingers, pushed by a third; three keyframes between its two goals."""
    return build_model(
        parse_task(f"""
object: {{mass: 0.1, shapes: [{{capsule: {{start: [0, 0, -0.03], end: [0, 0, 0.03], radius: 0.02}}}}]}}
palm: {{radius: 0.06, {palm}}}
motion:
  - {{at: 0, position: [0.11, 0, 0.3]}}
  - {{at: 4, position: [0.11, 0, 0.3], rotation: {{axis: [0, 1, 0], degrees: {degrees}}}}}
fingers:
  left: {{touches: [0, 0.02, 0]}}
  right: {{touches: [0, -0.02, 0]}}
  top: {{touches: [-0.02, 0, 0.025]}}
friction: 0.7
keyframes_between: 3
""")
    )


def test_a_contact_that_travels_little_stays() -> None:
    model = turning(95)
    assert planned_regrasp(model, straight_path(model)) is None


def test_only_the_contact_off_the_axis_lets_go_and_takes_the_object_where_it_first_did() -> None:
    model = turning(170)
    pose = straight_path(model)
    plan = planned_regrasp(model, pose)
    assert plan is not None
    # 42.5 degrees a keyframe: 127.5 are too many, so it lifts at the second and touches at the third.
    np.testing.assert_array_equal(np.argwhere(plan.lifted), [[2, 2]])
    np.testing.assert_allclose(plan.patches[:3], np.tile(model.patches, (3, 1, 1)))
    turned = Rotation.from_rotvec(pose[3, 3:])
    direction = turned.apply(plan.patches[3, 2])
    first = model.patches[2]
    # The object's axis has another direction then: on its surface, as near as that lets it be.
    cosine = direction @ first / np.linalg.norm(direction) / np.linalg.norm(first)
    assert np.arccos(cosine) < np.radians(20)
    capsule = rod(model.touched[2])
    along = np.linspace(0, 1, 10001)[:, None]
    axis = capsule[:3] + along * (capsule[3:6] - capsule[:3])
    distance = np.linalg.norm(plan.patches[3, 2] - axis, axis=1).min()
    assert distance == pytest.approx(capsule[6], abs=1e-6)


def test_the_object_rests_while_two_hold_it_and_makes_up_for_it() -> None:
    model = turning(140)
    plan = planned_regrasp(model, straight_path(model))
    assert plan is not None
    planned = replace(model, regrasp=plan)
    pose = straight_path(planned)
    np.testing.assert_allclose(np.degrees(pose[:, 4]), [0, 140 / 3, 280 / 3, 280 / 3, 140], atol=1e-9)
    # It is touched again where it then is, near where the finger first took it.
    seen = Rotation.from_rotvec(pose[3, 3:]).apply(plan.patches[3, 2])
    cosine = seen @ model.patches[2] / np.linalg.norm(seen) / np.linalg.norm(model.patches[2])
    assert np.arccos(cosine) < np.radians(20)
    times = model.schedule.samples
    np.testing.assert_array_equal(resting(planned), (times > 2 - 1e-9) & (times < 3 + 1e-9))
    # What acts at no time holds nothing: of four, one is off it and one idle.
    acting = np.ones_like(plan.lifted)
    acting[:, 0] = False
    alone = planned_regrasp(model, straight_path(model), acting)
    assert alone is not None
    assert alone.still is not None
    acting[:, 2] = False  # nor is one missed that is off it and would do nothing
    idle = planned_regrasp(model, straight_path(model), acting)
    assert idle is not None
    assert idle.still is None
    assert not resting(model).any()
    assert not resting(replace(model, regrasp=replace(plan, still=None))).any()


@pytest.mark.parametrize("degrees", [134, 145, 155, 170, 180])
def test_it_makes_up_for_no_rest_that_would_carry_a_contact_too_far(degrees: float) -> None:
    model = turning(degrees)
    plan = planned_regrasp(model, straight_path(model))
    assert plan is not None
    assert plan.lifted.any()
    turns = Rotation.from_rotvec(straight_path(replace(model, regrasp=plan))[:, 3:])
    first = model.patches[2] / np.linalg.norm(model.patches[2])
    seen = np.array([turn.apply(patch) for turn, patch in zip(turns, plan.patches[:, 2], strict=True)])[:-1]
    assert np.arccos(seen @ first / np.linalg.norm(seen, axis=1)).max() <= FARTHEST
    assert (plan.still is not None) == (degrees * 2 / 3 < 100)


@pytest.mark.parametrize(
    ("lifted", "fingers", "rests"),
    [
        ([(1, 2)], 3, [1]),
        ([(1, 2), (2, 1)], 3, [1, 2]),
        ([(0, 2), (1, 2), (2, 2), (3, 2)], 3, []),  # all the way from one goal to the next
        ([(1, 2)], 4, []),
        ([(1, 2), (1, 3)], 4, [1]),
    ],
)
def test_it_rests_where_fewer_than_three_hold_it_and_it_has_time_to_move(
    lifted: list[tuple[int, int]], fingers: int, rests: list[int]
) -> None:
    flags = np.zeros((5, fingers), bool)
    for k, c in lifted:
        flags[k, c] = True
    model = turning(170)
    acts = np.ones_like(flags)
    assert np.flatnonzero(resting_intervals(model, flags, acts)).tolist() == rests
    # One that never acts, as the ground of an object in the air, does not hold it.
    idle = np.zeros((5, 1), bool)
    found = resting_intervals(model, np.hstack([flags, idle]), np.hstack([acts, idle]))
    assert np.flatnonzero(found).tolist() == rests
    carried = replace(model, palm_position=model.palm_position + np.linspace(0, 1, len(model.palm_position))[:, None])
    assert not resting_intervals(carried, flags, acts).any()


def ball() -> Model:
    """A ball between three fingers that turns half around and back, a third of that between keyframes."""
    return build_model(
        parse_task("""
object: {mass: 0.05, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {radius: 0.05, position: [0, 0, 0.3], facing: [0, 0, -1]}
motion:
  - {at: 0, position: [0, 0, 0.2]}
  - {at: 3, position: [0, 0, 0.2], rotation: {axis: [0, 0, 1], degrees: 180}}
  - {at: 6, position: [0, 0, 0.2]}
fingers:
  thumb: {touches: [0.03, 0, 0]}
  index: {touches: [-0.015, 0.02598, 0]}
  middle: {touches: [-0.015, -0.02598, 0]}
friction: 0.7
keyframes_between: 2
""")
    )


def test_contacts_that_cannot_let_go_stay_behind_and_are_carried_back() -> None:
    model = ball()
    pose = straight_path(model)
    patches = limited_travel(model, pose).patches
    seen = np.einsum("kij,kcj->kci", Rotation.from_rotvec(pose[:, 3:]).as_matrix(), patches)
    azimuth = np.degrees(np.arctan2(seen[..., 1], seen[..., 0]))
    travelled = (azimuth - azimuth[0] + 180) % 360 - 180
    # The object turns by 60 degrees between keyframes; contacts travel with it until they are 60 from where they began.
    np.testing.assert_allclose(travelled, np.tile([0, 60, 60, 60, 0, -60, -60], (3, 1)).T, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(seen, axis=2), 1.0, atol=1e-4)


def test_a_ball_that_two_fingers_cannot_hold_is_turned_with_contacts_held_back(monkeypatch: pytest.MonkeyPatch) -> None:
    model, solved, solve = ball(), [], FloatingStage._solved
    monkeypatch.setattr(FloatingStage, "_solved", lambda self, *a: solved.append(self.model.regrasp) or solve(self, *a))
    floating = solve_floating(model, parse_task_weights())
    assert floating.solution.status == "Solve_Succeeded"
    # Nothing is solved that would leave too few contacts.
    assert [plan.lifted.any() for plan in solved if plan is not None] == [False]
    assert floating.model.regrasp is not None
    assert floating.active.all()
    assert not floating.model.regrasp.lifted.any()
    seen = np.einsum("kij,kcj->kci", Rotation.from_rotvec(floating.pose[:, 3:]).as_matrix(), floating.point)
    np.testing.assert_allclose(np.linalg.norm(seen, axis=2), 1.0, atol=0.1)
    assert (seen * seen[:1]).sum(axis=2).min() > np.cos(FARTHEST)


def test_contacts_held_back_are_solved_with_a_small_barrier_first_and_a_regrasp_with_the_usual_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model, used = ball(), []
    before: Any = SimpleNamespace(pose=straight_path(model), active=np.ones((7, 3), bool))
    before.solution = made_up_solution({})
    monkeypatch.setattr(FloatingStage, "_solved", lambda self, *given: used.append(given[-1]) or before.solution)
    monkeypatch.setattr(floating_stage, "passes_gate", lambda *_, **__: False)
    for kind in (LIMITED, REGRASP, WALKING):
        plan = limited_travel(model, before.pose)
        plan.lifted[3, 0] = kind is not LIMITED
        assert FloatingStage(replace(model, regrasp=plan)).solve_planned(before, parse_task_weights(), kind) is None
    assert used[:2] == [LIMITED_TRAVEL, BARRIERS]
    assert [replace(each, max_iter=300) for each in used[2]] == list(LIMITED_TRAVEL)
    assert LIMITED_TRAVEL[0].mu_init < min(barrier.mu_init for barrier in BARRIERS)
    assert LIMITED_TRAVEL[1:] == BARRIERS


def test_what_counts_is_the_way_seen_from_the_palm() -> None:
    # A palm that turns with the object sees no contact travel.
    still, facing = turning(170), "facing: [{}, 0, {}]"
    poses = ", ".join(
        f"{{at: {k}, position: [0, 0, 0.3], {facing.format(np.cos(a), -np.sin(a))}}}"
        for k, a in ((k, np.radians(42.5 * k)) for k in range(1, 5))
    )
    along = turning(170, f"position: [0, 0, 0.3], facing: [1, 0, 0], motion: [{poses}]")
    pose = straight_path(still)
    assert planned_regrasp(still, pose) is not None
    assert planned_regrasp(along, straight_path(along)) is None
    assert np.degrees(FARTHEST) == pytest.approx(100)


def lifted_model(model: Model) -> Model:
    lifted = np.zeros((5, 3), bool)
    lifted[2, 2] = True
    patches = model.keyframe_patches.copy()
    patches[3:, 2] = [0.4, 0, -0.5]
    return replace(model, regrasp=Regrasp(lifted, patches))


def test_a_contact_point_rests_where_it_lifts_and_touches() -> None:
    model = lifted_model(turning(170))
    assert model.regrasp is not None
    points = sampled_points(model, model.regrasp.patches)
    at = model.schedule.keyframe_samples
    np.testing.assert_allclose(points[: at[2] + 1, 2], np.tile(model.patches[2], (at[2] + 1, 1)), atol=1e-12)
    np.testing.assert_allclose(points[at[3] :, 2], np.tile([0.4, 0, -0.5], (len(points) - at[3], 1)), atol=1e-12)
    assert np.linalg.norm(np.diff(points[at[2] : at[3] + 1, 2], axis=0), axis=1).min() > 1e-3
    # Before it touches it has not slid: the sample one step earlier stands for the touch itself.
    before = model.point_spline(2, -1.0) @ model.regrasp.patches[:, 2]
    np.testing.assert_allclose(before[at[3]], [0.4, 0, -0.5], atol=1e-12)
    others = model.point_spline(0)
    np.testing.assert_array_equal(others, model.schedule.spline())


def test_two_contacts_pass_as_a_pivot_only_while_one_lifts() -> None:
    model = turning(170)
    values = {
        "pose": np.tile(straight_path(model)[0], (5, 1)),
        "point": model.keyframe_patches.reshape(5, -1),
        "invariant": np.ones((5, 3)),
    }
    assert passes_gate(model, values)
    values["invariant"] = values["invariant"].copy()
    values["invariant"][2, 2] = 0
    assert not passes_gate(model, values)
    assert passes_gate(model, values, pivots=True)
    values["invariant"][2] = 0
    assert not passes_gate(model, values, pivots=True)


def test_the_floating_motion_breaks_its_contact_and_holds_the_object_meanwhile() -> None:
    model = turning(170)
    weights = parse_task_weights()
    floating = solve_floating(model, weights)
    np.testing.assert_array_equal(floating.active[:, 2], [True, True, False, True, True])
    assert floating.active[:, :2].all()
    assert floating.model.regrasp is not None
    assert floating.runs[-1][0] == "regrasp"
    moved = np.linalg.norm(floating.point[3, 2] - floating.point[1, 2])
    assert moved > 0.5
    still = np.linalg.norm(np.diff(floating.point[3:, 2], axis=0), axis=1).max()
    assert still < 0.2 * moved


def parse_task_weights() -> dict[str, float]:
    from casadi_hands.task.weights import Weights

    return dict(Weights().floating)


WALK = pencil(
    4,
    """\
  east: {touches: [0.006, 0, 0.04], regrasps: [{from: 1, to: 2, touches: [0.006, 0, 0.01]}]}
  west: {touches: [-0.006, 0, 0.04], regrasps: [{from: 1, to: 2, touches: [-0.006, 0, 0.01]}]}
  north: {touches: [0, 0.006, 0.04]}
  south: {touches: [0, -0.006, 0.04]}
friction: 0.8
""",
)


def test_fingers_let_go_and_touch_again_as_the_task_asks() -> None:
    model = build_model(parse_task(WALK))
    floating = solve_floating(model, parse_task_weights())
    times, away = model.schedule.keyframes, slice(None, 2)
    lifted = (times > 1 - 1e-9) & (times < 2 - 1e-9)
    np.testing.assert_array_equal(floating.active[:, away], ~np.tile(lifted[:, None], (1, 2)))
    heights = floating.point[:, away, 2] * model.units.length
    due = np.where(times < 2 - 1e-9, 0.04, 0.01)[:, None]
    assert np.abs(heights - due).max() < REGRASP_ROOM * model.units.length + 1e-6
    # The others carry the weight alone meanwhile.
    at = (model.schedule.samples > 1 + 1e-9) & (model.schedule.samples < 2 - 1e-9)
    assert floating.force[at][:, 2:, 2].sum(axis=1).min() > 0.9
    # A part of the way keeps what the task asks for, and no other plan.
    assert shortened(model, 0.5).regrasp is model.regrasp
    assert shortened(replace(model, regrasp=Regrasp(lifted[:, None], model.keyframe_patches)), 0.5).regrasp is None


def test_points_are_bounded_where_fingers_are_asked_to_touch_again() -> None:
    model = build_model(parse_task(WALK))
    low, high = (each.reshape(-1, 2, 3) for each in landing_bounds(model, (0, 2)))
    landing = np.searchsorted(model.schedule.samples, 2 - 1e-9)
    assert [tuple(map(int, each)) for each in np.argwhere(np.isfinite(high).all(axis=2))] == [(landing, 0)]
    point = np.array([0.006, 0, 0.01]) / model.units.length
    np.testing.assert_allclose(high[landing, 0], point + LANDING_ROOM)
    np.testing.assert_allclose(low[landing, 0], point - LANDING_ROOM)
    assert np.sqrt(3) * LANDING_ROOM < NEAR
    assert model.regrasp is not None
    planned = replace(model, regrasp=replace(model.regrasp, asked=False))
    np.testing.assert_allclose(landing_bounds(planned, (0,))[1][landing], point + REGRASP_ROOM)
    assert not np.isfinite(landing_bounds(replace(model, regrasp=None), (0, 2))).any()
    keyframes = point_bounds(model)[1].reshape(-1, 4, 3)
    assert np.isfinite(keyframes[:, :2]).all()
    assert not np.isfinite(keyframes[:, 2:]).any()
