"""Holding, friction and torque against closed forms: a ball between two fingers, a capsule between three."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from casadi_hands.diagnosis.holding import MOST_NORMAL_FORCE, holdings, least_friction, least_torque
from casadi_hands.export.design import Design
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.hand import Finger, Hand, Link
from casadi_hands.problem.loads import HELD
from casadi_hands.problem.model import Model
from casadi_hands.problem.motion import Motion
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.gate import needed_wrenches, passes_gate
from casadi_hands.task import parse_task
from tests.stages.example import made_up_solution

# The ball stays where it is; each finger bears half its weight by friction, wherever that can be.
STILL = """
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {radius: 0.06, position: [0, 0, 0], facing: [0, 0, 1], up: [1, 0, 0]}
motion: [{at: 0, position: [0, 0, 0.09]}, {at: 0.6, position: [0, 0, 0.09]}]
fingers: {left: {touches: [0, -0.03, 0]}, right: {touches: [0, 0.03, 0]}}
keyframes_between: 1
"""
WEIGHT = 0.1 * 9.81


def still(
    friction: float, right: tuple[float, float, float] = (0, 1, 0), torsion: float = 0.0
) -> tuple[Model, Floating]:
    """The ball at rest; ``right`` is where the right finger touches, in radii."""
    model = build_model(parse_task(STILL + f"friction: {friction}\nfingertip: {{torsion: {torsion}}}\n"))
    keyframes, samples = len(model.schedule.keyframes), len(model.schedule.samples)
    pose = np.zeros((keyframes, 6))
    pose[:, 2] = 3
    point = np.tile(np.array([[0.0, -1, 0], right]), (keyframes, 1, 1))
    active = np.ones((keyframes, 2), bool)
    values = {"pose": pose, "point": point.reshape(keyframes, -1), "invariant": active.astype(float)}
    force = np.zeros((samples, 2, 3))
    return model, Floating(pose, point, force, active, active.astype(float), 0.0, made_up_solution(values), (), model)


@pytest.mark.parametrize("friction", [0.05, 0.2, 1.0])
def test_two_opposed_fingers_press_with_half_the_weight_over_the_friction(friction: float) -> None:
    for holding in holdings(*still(friction)):
        assert holding.held
        assert holding.hardest == pytest.approx(0.5 / friction, rel=1e-5)


def test_another_friction_takes_the_task_s_place() -> None:
    assert holdings(*still(0.05), friction=0.4)[0].hardest == pytest.approx(1.25, rel=1e-5)


def test_the_least_friction_is_where_the_grip_is_the_most() -> None:
    assert least_friction(*still(0.05)) == pytest.approx(0.5 / MOST_NORMAL_FORCE, rel=0.011)


def test_fingers_that_press_down_from_above_need_more_friction() -> None:
    # Contacts 20 degrees above the equator: N (μ cos - sin) is half the weight.
    angle = np.radians(20)
    model, floating = still(0.3, right=(0, np.cos(angle), np.sin(angle)))
    floating.point[:, 0] = [0, -np.cos(angle), np.sin(angle)]
    assert not holdings(model, floating)[0].held
    needed = (0.5 / MOST_NORMAL_FORCE + np.sin(angle)) / np.cos(angle)
    assert least_friction(model, floating) == pytest.approx(needed, rel=0.011)


def test_where_the_line_between_contacts_misses_the_centre_no_friction_will_do() -> None:
    assert least_friction(*still(0.5, right=(1, 0, 0))) is None


def test_what_cannot_be_made_is_missing_whole() -> None:
    # Both fingers on top of the ball: no friction under 2 lifts it.
    model, floating = still(0.5, right=(0, 0, 1))
    floating.point[:, 0] = [0, 0, 1]
    holding = holdings(model, floating)[0]
    assert not holding.held
    np.testing.assert_allclose(holding.missing, [0, 0, 1, 0, 0, 0], atol=1e-9)
    assert least_friction(model, floating) is None


def jerked(model: Model, floating: Floating) -> float:
    """The torque, N·m, that it takes to jerk the ball about the line through both contacts, as it then is."""
    floating.pose[:, 4] = [0, 2, 0]
    spins = model.schedule.spline(1) @ floating.pose - 2 * model.schedule.spline() @ floating.pose
    spins += model.schedule.spline(-1) @ floating.pose
    accelerations = spins[model.schedule.keyframe_samples, 4] / model.schedule.step**2
    return float(0.4 * 0.1 * 0.03**2 * abs(accelerations).max())  # of a homogeneous ball


def test_what_turns_the_ball_between_two_soft_fingertips_is_their_torsion() -> None:
    model, floating = still(0.5, torsion=0.002)
    pressed = jerked(model, floating) / (2 * 0.002)
    assert pressed > 0.1 * WEIGHT
    found = holdings(model, floating)
    assert all(holding.held for holding in found)
    # What bears the weight twists nothing. Pyramids have less friction than cones where the ball's turn has no edge.
    hardest = max(holding.hardest for holding in found) - pressed / WEIGHT
    assert 1.0 - 1e-6 < hardest < (1.0 + 1e-6) / np.cos(np.pi / 8)
    assert not all(holding.held for holding in holdings(still(0.5)[0], floating))


@pytest.mark.parametrize("right", [(0, 1, 0), (1, 0, 0), (0, 0, 1), (0, np.sin(1), -np.cos(1)), (0.6, 0.8, 0)])
@pytest.mark.parametrize("friction", [0.1, 0.6])
@pytest.mark.parametrize("torsion", [0.0, 0.001])
def test_it_agrees_with_the_floating_stage_s_gate(
    right: tuple[float, float, float], friction: float, torsion: float
) -> None:
    model, floating = still(friction, right, torsion)
    held = all(holding.held for holding in holdings(model, floating))
    assert held == passes_gate(model, floating.solution.values)


def test_the_missing_wrench_is_the_least_that_any_forces_in_the_cones_leave() -> None:
    # Circular cones, by SciPy: never more is missing than the inscribed pyramids say, and little less.
    model, floating = still(0.4, right=(0.8, 0.6, 0))
    needed = needed_wrenches(model, floating.pose)[0]
    points = floating.point[0]

    def left(forces: np.ndarray) -> float:
        total = np.concatenate([forces.reshape(2, 3).sum(axis=0), np.cross(points, forces.reshape(2, 3)).sum(axis=0)])
        return float(((needed - total) ** 2).sum())

    def inside(forces: np.ndarray) -> np.ndarray:
        normal = -(forces.reshape(2, 3) * points).sum(axis=1)
        across = forces.reshape(2, 3) + normal[:, None] * points
        return np.concatenate([0.4 * normal - np.sqrt((across**2).sum(axis=1) + 1e-12), normal])

    start = -0.3 * points.reshape(-1)
    best = minimize(left, start, constraints=[{"type": "ineq", "fun": inside}], options={"maxiter": 500, "ftol": 1e-12})
    missing = float(np.linalg.norm(holdings(model, floating)[0].missing))
    assert missing > HELD
    assert np.sqrt(best.fun) <= missing + 1e-6
    assert missing <= np.sqrt(best.fun) + 0.08


# Torque: upright fingers of one joint at their base press sideways; what they bear of the weight has no lever.


def upright(joints_apart: float, active: bool = True) -> tuple[Model, Design]:
    task = parse_task(STILL + "friction: 0.5\nlimits: {unsupplied_force: 1.0}\n")
    model = build_model(task)
    samples = len(model.schedule.samples)
    links = (Link(0.06, 0.006, (1.0, 0, 0)), Link(0.03 - 0.006, 0.006, (1.0, 0, 0)))
    fingers = tuple(Finger(name, (0, side * 0.036, 0), links) for name, side in (("left", -1), ("right", 1)))
    hand = Hand(0.06, 0.01, fingers, -1.5, 1.5, 1.0, 1.0, 1150.0)
    force = np.array([[0, WEIGHT, WEIGHT / 2], [0, -WEIGHT, WEIGHT / 2]])

    def tile(value: object) -> np.ndarray:
        return np.tile(np.array(value, float), (samples,) + (1,) * np.ndim(value))

    motion = Motion(
        time=model.schedule.samples,
        object_position=tile([0, 0, 0.09]),
        object_orientation=tile([1, 0, 0, 0]),
        base_position=tile([0, 0, 0]),
        base_orientation=tile([1, 0, 0, 0]),
        joint_angles=tile([0, 0, 0, 0]),
        joint_names=hand.joint_names,
        contact_names=("left", "right"),
        contact_link=("finger0_link1", "finger1_link1"),
        contact_active=np.full((samples, 2), active),
        contact_force=tile(force),
        contact_point_object=tile([[0, -0.03, 0], [0, 0.03, 0]]),
        contact_point_link=tile([[0, joints_apart, 0.03], [0, -joints_apart, 0.03]]),
        external_force=tile([0, 0, 0]),
        external_torque=tile([0, 0, 0]),
    )
    return model, Design(task=task, status="failed", hand=hand, motion=motion)


def test_the_torque_of_an_upright_finger_is_its_least_press_times_its_height() -> None:
    # The contact is straight above the joints: the weight has no lever, and 1 weight is pressed sideways 9 cm up.
    load = least_torque(*upright(0.0))
    assert load is not None
    assert load.torque == pytest.approx(WEIGHT * 0.09, rel=1e-4)
    assert load.joint == 0


def test_a_lever_of_the_weight_relieves_or_loads_the_joint() -> None:
    # 6 mm inside the joint's axis the half weight that a finger bears turns it outwards, as pressing does inwards.
    load = least_torque(*upright(0.006))
    assert load is not None
    with_lever = [abs(WEIGHT * 0.09 + sign * WEIGHT / 2 * 0.006) for sign in (-1, 1)]
    assert load.torque == pytest.approx(min(with_lever), rel=1e-3) or load.torque == pytest.approx(
        max(with_lever), rel=1e-3
    )


def test_the_least_torque_is_the_hardest_sample_s() -> None:
    model, design = upright(0.0)
    assert design.motion is not None
    forces = design.motion.contact_force.copy()
    forces[4, :, 2] *= 1.5  # the ball is pulled upwards here
    load = least_torque(model, replace(design, motion=replace(design.motion, contact_force=forces)))
    assert load is not None
    assert load.time == design.motion.time[4]
    assert load.torque == pytest.approx(1.5 * WEIGHT * 0.09, rel=1e-4)


def test_without_contacts_there_is_no_load() -> None:
    assert least_torque(*upright(0.0, active=False)) is None
