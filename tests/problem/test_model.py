"""SI to nondimensional numbers, by hand, and the same task ten times larger."""

from __future__ import annotations

import dataclasses
import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML
from scipy.integrate import quad
from scipy.spatial.transform import Rotation, Slerp

from casadi_hands.geometry.bodies.capsule import Capsule
from casadi_hands.geometry.bodies.sphere import Sphere
from casadi_hands.problem.model import Model
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.stage import FloatingStage
from casadi_hands.task import parse_task
from tests.stages.example import drawing, everything, everything_text

PROBLEMS = Path(__file__).parents[2] / "problems"
LENGTHS = {"start", "end", "center", "radius", "position", "touches", "gravity"}
LIMITS = ("goal_position", "gap", "gap_between", "slip", "penetration")  # those in metres


def rotations(quaternions: np.ndarray) -> Rotation:
    return Rotation.from_quat(quaternions, scalar_first=True)


def test_units_by_hand() -> None:
    task, model = everything()
    units = model.units
    # The largest extent is z: from -0.045 to 0.05, whatever the origin.
    assert units.length == pytest.approx(0.0475)
    assert units.force == pytest.approx(0.2 * 9.81)
    assert units.torque == pytest.approx(0.2 * 9.81 * 0.0475)
    assert units.inertial == pytest.approx(0.0475 / 9.81)
    assert task.object.characteristic_length == pytest.approx(0.0475)


def test_force_unit_without_gravity_is_the_weight_it_would_have() -> None:
    model = build_model(parse_task((PROBLEMS / "horizontal_translation_no_gravity.yaml").read_text()))
    assert model.units.force == pytest.approx(0.1 * 9.81)
    np.testing.assert_array_equal(model.gravity, 0)


def test_every_number_is_the_task_s_over_its_unit() -> None:
    task, model = everything()
    length = 0.0475
    np.testing.assert_allclose(model.gravity, [0, 0, -1])
    np.testing.assert_allclose(model.inertia, np.array(task.object.inertia) / (0.2 * length**2), rtol=1e-11)
    capsule, sphere = model.bodies
    assert isinstance(capsule, Capsule)
    assert isinstance(sphere, Sphere)
    np.testing.assert_allclose([capsule.radius * length, sphere.radius * length], [0.015, 0.02])
    np.testing.assert_allclose((capsule.end - capsule.start) * length, [0, 0.01, 0.06], atol=1e-14)
    touches = [*(finger.touches for finger in task.fingers.values()), task.ground.touches]
    np.testing.assert_allclose(model.patches * length, touches, atol=1e-12)
    assert model.palm_radius * length == pytest.approx(0.05)
    assert model.link_radius * length == pytest.approx(0.006)
    np.testing.assert_allclose(np.array(model.link_length) * length, [0.012, 0.1])
    np.testing.assert_allclose(np.degrees(model.joint_limits), [-80, 85])
    assert model.torque_limit * 0.2 * 9.81 * length == pytest.approx(0.05)
    assert model.speed_limit == 6
    assert model.friction == 0.6
    assert model.ground is not None
    assert model.ground * length == pytest.approx(0.001)
    assert model.frictions[-1] == 0.4
    # The thumb and the index are on the capsule, the top finger on the sphere.
    assert model.touched[:3] == (capsule, capsule, sphere)


def test_goals_are_turns_from_the_first() -> None:
    task, model = everything()
    for goal, vector in zip(task.motion, model.goal_vectors, strict=True):
        turn = Rotation.from_rotvec(vector) * rotations(model.reference)
        expected = Rotation.from_rotvec(goal.rotation.vector)
        assert (turn * expected.inv()).magnitude() < 1e-12
        np.testing.assert_allclose(
            model.goal_positions[task.motion.index(goal)] * 0.0475, np.array(goal.position), atol=1e-12
        )


@pytest.mark.parametrize("degrees", [180, -180, 250, -250])
def test_turns_about_one_axis_keep_their_winding(degrees: float) -> None:
    text = (
        everything_text()
        .replace("degrees: 70", "degrees: 0")
        .replace("axis: [0, 0, 1], degrees: -40", "axis: [1, 0, 0], degrees: " + str(20 + degrees))
    )
    model = build_model(parse_task(text))
    np.testing.assert_allclose(np.degrees(model.goal_vectors[2]), [degrees, 0, 0], atol=1e-9)


def test_turns_about_mirrored_axes_are_not_taken_for_one_axis() -> None:
    # [1, 1, 0] and [1, -1, 0] differ in a sign only, yet the way between the turns is not the difference of their
    # vectors: as between any two axes, it is the shortest.
    text = everything_text().replace("axis: [1, 0, 0], degrees: 20", "axis: [1, 1, 0], degrees: 10")
    text = text.replace("axis: [0, 1, 1], degrees: 70", "axis: [1, -1, 0], degrees: 250")
    task = parse_task(text.replace("height: 0.001", "height: -0.03"))
    first, second = (Rotation.from_rotvec(goal.rotation.vector) for goal in task.motion[:2])
    np.testing.assert_allclose(build_model(task).goal_vectors[1], (second * first.inv()).as_rotvec(), atol=1e-9)


def test_palm_moves_between_its_waypoints_and_then_stands() -> None:
    task, model = everything()
    (_, p0, r0), (t1, p1, r1) = task.palm.waypoints
    times = np.minimum(model.schedule.samples, t1)
    # The quintic that starts and ends at rest: the running integral of s²(1 - s)², to one.
    s = times / t1
    passed = np.array([quad(lambda x: 30 * x**2 * (1 - x) ** 2, 0, end)[0] for end in s])
    expected = p0 + passed[:, None] * (p1 - p0)
    np.testing.assert_allclose(model.palm_position * 0.0475, expected, atol=1e-12)
    slerp = Slerp([0, t1], Rotation.from_matrix([r0, r1]))
    assert (rotations(model.palm_quaternion) * slerp(passed * t1).inv()).magnitude().max() < 1e-7


def test_goals_are_missed_by_no_more_than_the_task_allows() -> None:
    # Of 0.8 mm and 0.3 degrees nine tenths, in whatever direction the three coordinates are off together.
    text = everything_text().replace("goal_position: 0.0005", "goal_position: 0.0008, goal_angle: 0.3")
    task = parse_task(text)
    model = build_model(task)
    position, angle = model.goal_tolerance
    assert position * 0.0475 == pytest.approx(0.9 * 0.0008 / 3**0.5, rel=1e-9)
    assert np.degrees(angle) == pytest.approx(0.9 * 0.3 / 3**0.5, rel=1e-9)
    goals = [Rotation.from_rotvec(goal.rotation.vector) for goal in task.motion]
    for corner in itertools.product((-1, 1), repeat=3):
        assert np.linalg.norm(corner) * position * 0.0475 == pytest.approx(0.9 * 0.0008)
        for goal, vector in zip(goals, model.goal_vectors, strict=True):
            missed = Rotation.from_rotvec(vector + angle * np.array(corner)) * rotations(model.reference)
            # Coordinates of turns that are not small turn by less than they change.
            assert 0.7 * 0.27 < np.degrees((missed * goal.inv()).magnitude()) < 0.27 * (1 + 1e-6)


def test_gaps_and_slips_are_a_part_of_the_task_s_limits_and_never_large() -> None:
    # A fifth of a gap of 30 µm and of a slip of 0.2 mm; 2e-4 and 2e-3 lengths of 47.5 mm at most.
    text = everything_text().replace("gap: 5e-05", "gap: 3e-05")
    model = build_model(parse_task(text))
    assert model.gap_tolerance * 0.0475 == pytest.approx(6e-6, rel=1e-9)
    assert model.slip_tolerance * 0.0475 == pytest.approx(4e-5, rel=1e-9)
    lax = build_model(parse_task(text.replace("gap: 3e-05", "gap: 1.0").replace("slip: 0.0002", "slip: 1.0")))
    assert (lax.gap_tolerance, lax.slip_tolerance) == (2e-4, 2e-3)


def test_a_perturbation_between_two_samples_acts_at_the_nearest() -> None:
    text = everything_text().replace("from: 0.3", "from: 0.33").replace("to: 0.9", "to: 0.36")
    task = parse_task(text)
    assert task.perturbations[0].end == 0.36
    model = build_model(task)
    pushed = model.schedule.samples[model.disturbance.torque.any(axis=1)]
    (nearest,) = pushed
    assert abs(nearest - 0.345) == np.abs(model.schedule.samples - 0.345).min()


def test_perturbations_act_in_their_time_and_add_up() -> None:
    _, model = everything()
    weight = 0.2 * 9.81
    for time, force, torque in zip(
        model.schedule.samples, model.disturbance.force, model.disturbance.torque, strict=True
    ):
        first, second = 0.3 - 1e-6 <= time <= 0.9 + 1e-6, 0.5 - 1e-6 <= time <= 0.7 + 1e-6
        expected = first * np.array([0.3, 0, -0.5]) + second * np.array([0, 0.2, 0])
        np.testing.assert_allclose(force * weight, expected, atol=1e-12)
        np.testing.assert_allclose(torque * weight * 0.0475, first * np.array([0, 0.004, 0]), atol=1e-12)
    assert model.disturbance is not None


def test_a_drawing_has_points_for_goals() -> None:
    _, model = drawing()
    assert model.units.length == pytest.approx(0.055)
    np.testing.assert_allclose(model.tool * 0.055, [0, 0.001, -0.055], atol=1e-12)
    np.testing.assert_allclose(model.goal_positions * 0.055, [[0, 0, 0], [0.04, 0, 0], [0.04, 0.03, 0.01]], atol=1e-12)
    np.testing.assert_array_equal(model.goal_vectors, 0)


def same(one: object, other: object, name: str) -> None:
    if dataclasses.is_dataclass(one):
        assert type(one) is type(other), name
        for field in dataclasses.fields(one):
            same(getattr(one, field.name), getattr(other, field.name), f"{name}.{field.name}")
    elif isinstance(one, tuple) and isinstance(other, tuple):
        for k, pair in enumerate(zip(one, other, strict=True)):
            same(*pair, f"{name}[{k}]")
    else:
        assert np.array_equal(np.asarray(one), np.asarray(other)), name


def check_same_but_for_units(one: Model, other: Model) -> None:
    for field in dataclasses.fields(Model):
        if field.name != "units":
            same(getattr(one, field.name), getattr(other, field.name), field.name)
    assert one.units.inertial == other.units.inertial


def scaled(node: object, factor: float, key: str = "") -> object:
    if isinstance(node, dict):
        return {k: scaled(v, factor, str(k)) for k, v in node.items()}
    if isinstance(node, list):
        return [scaled(v, factor, key) for v in node]
    return factor * node if key in LENGTHS and isinstance(node, int | float) else node


def ten_times_larger(name: str) -> Model:
    task = parse_task((PROBLEMS / name).read_text())
    data = YAML(typ="safe").load(PROBLEMS / name)
    data.setdefault("gravity", [0, 0, -9.81])
    data["limits"] = {**data.get("limits", {}), **{name: 10 * getattr(task.limits, name) for name in LIMITS}}
    # Torques grow with both, and with them what joints resist a turn with.
    data["actuator"] = {"stiffness": 100 * task.actuator.stiffness}
    return build_model(parse_task(json.dumps(scaled(data, 10.0))))


def test_lengths_and_gravity_ten_times_larger_give_the_same_model() -> None:
    # Forces of perturbations grow with gravity, torques with gravity and length; limits in metres with length.
    check_same_but_for_units(everything()[1], build_model(parse_task(everything_text(10.0))))


@pytest.mark.parametrize("name", ["horizontal_translation.yaml", "sphere_rotation.yaml"])
def test_lengths_and_gravity_ten_times_larger_give_the_same_motion(name: str) -> None:
    task = parse_task((PROBLEMS / name).read_text())
    model, larger = build_model(task), ten_times_larger(name)
    check_same_but_for_units(model, larger)
    assert larger.units.length == pytest.approx(10 * model.units.length)
    assert larger.units.force == pytest.approx(10 * model.units.force)
    weights = dict(task.weights.floating)
    one, other = FloatingStage(model).solve(weights), FloatingStage(larger).solve(weights)
    for field in ("pose", "point", "force", "active", "invariant"):
        np.testing.assert_array_equal(getattr(one, field), getattr(other, field))
