"""A floating solve of figure 3.6b, judged by SciPy's splines and finite differences; and defuzzification."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.nlp import Solution
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.model import Model
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.gate import passes_gate
from casadi_hands.stages.floating.stage import BARRIERS, BROKEN, FloatingStage
from casadi_hands.task import Task, load_task, parse_task
from tests.problem.test_model import rotations
from tests.stages.example import Motion, drawing, palm_apart, project, resting_at, rod, spline_at

PROBLEMS = Path(__file__).parents[3] / "problems"
Solved = tuple[Task, Model, Floating]


def solved(task: Task) -> Solved:
    model = build_model(task)
    return task, model, FloatingStage(model).solve(dict(task.weights.floating))


@pytest.fixture(scope="module")
def carried() -> Solved:
    return solved(load_task(PROBLEMS / "horizontal_translation.yaml"))


@pytest.fixture(scope="module")
def turned() -> Solved:
    return solved(load_task(PROBLEMS / "sphere_rotation.yaml"))


@pytest.fixture(params=["carried", "turned"])
def any_of_them(request: pytest.FixtureRequest) -> Solved:
    return request.getfixturevalue(request.param)


def test_goals_are_kept(any_of_them: Solved) -> None:
    task, model, floating = any_of_them
    positions, orientations = Motion(model, floating.pose).at(0)
    for goal in task.motion:
        sample = int(np.argmin(np.abs(model.schedule.samples - goal.at)))
        assert (
            np.abs(positions[sample] * model.units.length - np.array(goal.position)).max() < 1e-3 * model.units.length
        )
        error = orientations[sample].inv() * Rotation.from_rotvec(goal.rotation.vector)
        assert error.magnitude() < 1e-3 * np.sqrt(3)


def test_turns_go_the_way_that_was_asked(turned: Solved) -> None:
    task, model, floating = turned
    goals = list(model.schedule.goals)
    asked = [goal.rotation.degrees for goal in task.motion]
    np.testing.assert_allclose(np.degrees(floating.pose[goals, 5]), asked, atol=0.1)


def test_forces_and_torques_balance_the_motion(any_of_them: Solved) -> None:
    _, model, floating = any_of_them
    motion = Motion(model, floating.pose)
    schedule, length = model.schedule, model.units.length
    active = floating.active[np.searchsorted(schedule.keyframes, schedule.samples + 1e-9) - 1]
    points = spline_at(schedule.keyframes, floating.point.reshape(len(floating.point), -1), schedule.samples)
    points = points.reshape(*active.shape, 3)
    # Acceleration in SI by second differences of metres, over gravity.
    acceleration, inertial = motion.acceleration * length / 9.81, motion.inertial_torque
    for s, turn in enumerate(motion.at(0)[1]):
        force = floating.force[s] * active[s][:, None]
        residual = turn.apply(force.sum(axis=0)) - [0, 0, 1] - acceleration[s]
        assert np.linalg.norm(residual) < 5e-2
        torque = np.cross(points[s], force).sum(axis=0) - inertial[s]
        assert np.linalg.norm(torque) < 5e-2


def test_friction_is_respected_at_every_sample(any_of_them: Solved) -> None:
    _, model, floating = any_of_them
    schedule = model.schedule
    points = spline_at(schedule.keyframes, floating.point.reshape(len(floating.point), -1), schedule.samples)
    points = points.reshape(len(schedule.samples), -1, 3)
    active = floating.active[np.searchsorted(schedule.keyframes, schedule.samples + 1e-9) - 1]
    assert active.sum(axis=1).min() >= 2
    for s, c in zip(*np.nonzero(active), strict=True):
        inward = -project(points[s, c], rod(model.touched[c]))[1]
        pressing = floating.force[s, c] @ inward
        across = np.linalg.norm(floating.force[s, c] - pressing * inward)
        assert across <= model.friction * pressing
        assert pressing > 0


def test_contacts_are_on_the_object_near_where_the_user_put_them(any_of_them: Solved) -> None:
    _, model, floating = any_of_them
    for keyframe in floating.point:
        for point, capsule, patch in zip(keyframe, map(rod, model.touched), model.patches, strict=True):
            assert np.linalg.norm(project(point, capsule)[0] - point) < 0.02
            assert np.linalg.norm(point - patch) < 0.2


def test_object_is_at_rest_at_both_ends(any_of_them: Solved) -> None:
    _, model, floating = any_of_them
    before, after = (Motion(model, floating.pose).at(k)[0] for k in (-1, 1))
    np.testing.assert_allclose(before[[0, -1]], after[[0, -1]], atol=1e-12)


def test_a_drawing_s_tool_follows_its_path() -> None:
    task, model, floating = solved(drawing()[0])
    positions, orientations = Motion(model, floating.pose).at(0)
    tool = (
        np.array([p + r.apply(model.tool) for p, r in zip(positions, orientations, strict=True)]) * model.units.length
    )
    times = [goal.at for goal in task.motion]
    path = resting_at(np.array(times), np.array([goal.tool_at for goal in task.motion]), model.schedule.samples)
    # The tool cuts the corner a little, and its start and end hang on a soft cost.
    assert np.linalg.norm(tool - path, axis=1).max() < 4e-3


def test_the_ground_carries_what_rests_on_it_and_perturbations_are_resisted() -> None:
    text = """
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {radius: 0.05, position: [0, 0, 0.15], facing: [0, 0, -1]}
motion: [{at: 0, position: [0, 0, 0.03]}, {at: 1, position: [0, 0, 0.03]}]
fingers: {left: {touches: [0, 0.03, 0]}, right: {touches: [0, -0.03, 0]}}
ground: {height: 0}
perturbations: [{from: 0.2, to: 0.8, force: [0.3, 0, 0]}]
"""
    _, model, floating = solved(parse_task(text))
    assert model.ground is not None
    motion = Motion(model, floating.pose)
    weight = 0.1 * 9.81
    active = floating.active[np.searchsorted(model.schedule.keyframes, model.schedule.samples + 1e-9) - 1]
    perturbed = floating.solution.values["force_perturbed"].reshape(floating.force.shape)
    for s, turn in enumerate(motion.at(0)[1]):
        pushed = 0.2 - 1e-6 <= model.schedule.samples[s] <= 0.8 + 1e-6
        for forces, push in ((floating.force[s], 0.0), (perturbed[s], 0.3 / weight if pushed else 0.0)):
            total = turn.apply((forces * active[s][:, None]).sum(axis=0))
            np.testing.assert_allclose(total, [-push, 0, 1], atol=6e-2)
    # A cost on forces lets the ground hold most of the weight, straight up.
    upward = np.array([turn.apply(f[-1]) for turn, f in zip(motion.at(0)[1], floating.force, strict=True)])
    assert active[:, -1].all()
    assert upward[:, 2].min() > 0.2
    touching = spline_at(model.schedule.keyframes, floating.point[:, -1], model.schedule.samples)
    heights = [(p + turn.apply(t))[2] for p, turn, t in zip(*motion.at(0), touching, strict=True)]
    np.testing.assert_allclose(heights, 0, atol=0.03)


def test_the_object_keeps_clear_of_the_palm() -> None:
    # The straight way between the goals leads through the palm, a disc of 4 cm that faces +x.
    text = """
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.02}}]}
palm: {radius: 0.04, position: [0, 0, 0.3], facing: [1, 0, 0]}
motion: [{at: 0, position: [0.005, -0.07, 0.3]}, {at: 2, position: [0.005, 0.07, 0.3]}]
fingers: {left: {touches: [0, 0, 0.02]}, right: {touches: [0, 0, -0.02]}}
"""
    task = parse_task(text)
    stage = FloatingStage(build_model(task))

    def nearest(weight: float) -> float:
        """How near the sphere's surface comes to the palm, mm; negative inside."""
        floating = stage.solve({**dict(task.weights.floating), "palm_clearance": weight})
        centers = Motion(stage.model, floating.pose).at(0)[0] * 0.02
        seen = rotations(stage.model.palm_quaternion).inv().apply(centers - task.palm.position)
        return 1e3 * (min(palm_apart(point, 0.04) for point in seen) - 0.02)

    assert nearest(0.0) < -10
    assert nearest(100.0) > -1


@pytest.fixture(scope="module")
def stage() -> FloatingStage:
    return FloatingStage(build_model(load_task(PROBLEMS / "sphere_rotation.yaml")))


def test_thresholds_give_distinct_flags(stage: FloatingStage) -> None:
    invariant = np.full((len(stage.model.schedule.keyframes), 3), 0.9)
    invariant[3] = [0.9, 0.8, 0.15]
    invariant[5] = [0.9, 0.8, 0.25]
    candidates = {threshold: flags for flags, threshold in stage._candidates(invariant)}
    assert list(candidates) == [0.1, 0.2, 0.3]
    assert candidates[0.1].all()
    assert np.argwhere(candidates[0.2] == 0).tolist() == [[3, 2]]
    assert np.argwhere(candidates[0.3] == 0).tolist() == [[3, 2], [5, 2]]
    assert len(stage._candidates(np.full_like(invariant, 0.9))) == 1


def test_a_keyframe_keeps_its_two_strongest_contacts(stage: FloatingStage) -> None:
    invariant = np.full((len(stage.model.schedule.keyframes), 3), 0.9)
    invariant[2] = [0.02, 0.01, 0.05]
    for flags, _ in stage._candidates(invariant):
        assert flags[2].tolist() == [1, 0, 1]


def test_flags_are_fixed_by_bounds_and_the_result_passes_the_gate(turned: Solved) -> None:
    _, model, floating = turned
    assert set(np.unique(floating.solution.values["invariant"])) <= {0.0, 1.0}
    np.testing.assert_array_equal(floating.active, floating.solution.values["invariant"] == 1)
    assert passes_gate(model, floating.solution.values)
    assert floating.threshold in (0.1, 0.2, 0.3)
    assert rotations(model.reference).magnitude() < 1e-12


def test_where_a_barrier_breaks_down_the_other_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    task = load_task(PROBLEMS / "horizontal_translation.yaml")
    stage, weights = FloatingStage(build_model(task)), dict(task.weights.floating)
    expected, solve = stage.solve(weights), stage.solver.solve
    taken: list[bool] = []

    def broken(start: object, parameters: object, options: object, *bounds: object) -> Solution:
        solution = solve(start, parameters, options, *bounds)  # type: ignore[arg-type]
        taken.append(options == BARRIERS[0])
        return replace(solution, excess={"cone": np.full(1, 2 * BROKEN)}) if taken[-1] else solution

    monkeypatch.setattr(stage.solver, "solve", broken)
    found = stage.solve(weights)
    assert taken == [True, False] * len(expected.runs)
    assert found.solution.violation == 0
    assert found.solution.objective == pytest.approx(expected.solution.objective, rel=1e-3)
