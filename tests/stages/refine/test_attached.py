"""The blocks of an object on a joint against SciPy's integrator and rotations, in SI, and virtual work."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from casadi_hands.problem.attachment import Attachment
from casadi_hands.problem.model import Model
from casadi_hands.stages.refine import attached
from tests.problem.test_attachment import CASES, held
from tests.stages.blocks import STEP, check_block, numbers

Array = np.ndarray
NAMES = ("turn_axis", "freedom", "joint_mass", "joint_friction", "joint_stiffness", "joint_damping")


def given(of: Model) -> dict[str, object]:
    """Parameters of the joint and of the world."""
    own = attached.parameters(of)
    return {name: own[name] for name in NAMES} | {"reference": of.reference, "gravity": of.gravity}


class Driven:
    """An object on a joint that contacts drive from one knot to the next, integrated by SciPy.

    Wrenches are about the centre of mass in the object's frame, so that their work is that of any point's.
    """

    def __init__(self, of: Model, joint: Attachment, share: float) -> None:
        rng = np.random.default_rng(3)
        self.of, self.joint, self.step = of, joint, share * STEP
        self.points, self.forces = rng.normal(size=(2, 3, 3)), 0.1 * rng.normal(size=(2, 3, 3))
        self.world = 0.3 * rng.normal(size=(2, 2, 3))
        self.drags = rng.uniform(-1, 1, 2)
        for pair in (self.points, self.forces, self.world, self.drags):
            pair[1] = (1 - share) * pair[0] + share * pair[1]
        self.start = np.array([0.2, 0.4])
        solved = solve_ivp(self.slope, (0, self.step), self.start, method="DOP853", rtol=1e-13, atol=1e-15)
        self.end = solved.y[:, -1]

    def slope(self, t: float, state: Array) -> Array:
        """Power of all forces over the speed, by the velocities of the points they act at."""
        s, (q, speed) = t / self.step, state
        points, forces, (force, torque) = ((1 - s) * a[0] + s * a[1] for a in (self.points, self.forces, self.world))
        rate = self.joint.rates(np.array([q]), np.array([1.0]))[0]
        turn = Rotation.from_rotvec(q * self.joint.turn_axis) * Rotation.from_quat(self.of.reference, scalar_first=True)
        velocity = turn.inv().apply(rate[:3]) + np.cross(rate[3:], points)
        power = np.sum(velocity * forces) + rate[:3] @ (self.of.gravity + force) + turn.apply(rate[3:]) @ torque
        power += self.joint.friction * ((1 - s) * self.drags[0] + s * self.drags[1])
        power -= self.joint.stiffness * q + self.joint.damping * speed
        return np.array([speed, power / (self.of.units.inertial * self.joint.mass)])

    def block(self) -> tuple[dict[str, object], dict[str, object]]:
        def wrench(points: Array, forces: Array) -> Array:
            return np.r_[forces.sum(axis=0), np.cross(points, forces).sum(axis=0)]

        states = np.array([self.start, self.end])
        variables: dict[str, object] = {"middle_torque": wrench(self.points.mean(axis=0), self.forces.mean(axis=0))[3:]}
        for i in range(2):
            variables[f"coordinate{i}"], variables[f"coordinate_speed{i}"] = states[i]
            variables[f"drag{i}"] = self.drags[i]
            variables[f"rate{i}"] = self.joint.rates(states[i, :1], states[i, 1:])[0]
            variables[f"wrench{i}"] = wrench(self.points[i], self.forces[i])
        world = {f"planned_{name}{i}": self.world[i, k] for i in range(2) for k, name in enumerate(("force", "torque"))}
        return variables, {**given(self.of), **world, "step": self.step, "inertial": self.of.units.inertial}


@pytest.mark.parametrize(("joint", "goal"), CASES)
def test_physics_along_a_joint_is_that_of_scipy_s_integrator(joint: str, goal: str) -> None:
    of, attachment = held(joint, goal)
    defects, moved = [], []
    for share in (0.1, 0.05):
        driven = Driven(of, attachment, share)
        found = numbers(attached.physics(), *driven.block())["defect"]
        defects.append(np.abs(found).max())
        moved.append(abs(driven.end[1] - driven.start[1]))
    # What depends on where the object is, or how fast, is integrated along a cubic: third order, of damping.
    # In forces: of the weight.
    assert defects[1] < max(defects[0] / 2**2.5, 1e-9)
    assert moved[1] > 0.01


@pytest.mark.parametrize(("joint", "goal"), CASES)
def test_derivatives_of_the_blocks(joint: str, goal: str) -> None:
    of, attachment = held(joint, goal)
    check_block(attached.physics(), *Driven(of, attachment, 0.2).block(), h=1e-6)


@pytest.mark.parametrize(("joint", "goal"), CASES)
def test_the_pose_is_the_joint_s(joint: str, goal: str) -> None:
    of, attachment = held(joint, goal)
    rng = np.random.default_rng(0)
    pose, rate, (q, speed) = rng.normal(size=6), rng.normal(size=6), rng.normal(size=2)
    own = attached.parameters(of)
    names = ("turn_axis", "joint_axis", "pivot", "joint_start", "advance", "freedom")
    parameters = {name: own[name] for name in names} | {"reference": of.reference}
    variables = {"pose": pose, "rate": rate, "coordinate": q, "coordinate_speed": speed}
    due = np.r_[attachment.poses(np.array([q]))[0], attachment.rates(np.array([q]), np.array([speed]))[0]]
    found = numbers(attached.on_joint(), variables, parameters)["on_joint"]
    np.testing.assert_allclose(found, np.r_[pose, rate] - due, atol=1e-12)


@pytest.mark.parametrize(("joint", "goal"), CASES)
def test_rest_takes_weight_spring_and_the_world_s_answer(joint: str, goal: str) -> None:
    of, attachment = held(joint, goal)
    rng = np.random.default_rng(1)
    wrench, force, torque = rng.normal(size=6), *rng.normal(size=(2, 3))
    keys = ("turn_axis", "freedom", "joint_friction", "joint_stiffness", "reference", "gravity")
    parameters = {name: given(of)[name] for name in keys} | {"planned_force": force, "planned_torque": torque}
    variables = {"coordinate": 0.3, "wrench": wrench, "drag": 0.25}
    rate = attachment.rates(np.array([0.3]), np.array([1.0]))[0]
    turn = Rotation.from_rotvec(0.3 * attachment.turn_axis) * Rotation.from_quat(of.reference, scalar_first=True)
    due = rate[:3] @ (turn.apply(wrench[:3]) + of.gravity + force) + rate[3:] @ (wrench[3:] + turn.inv().apply(torque))
    due += 0.25 * attachment.friction - 0.3 * attachment.stiffness
    assert numbers(attached.equilibrium(), variables, parameters)["sum"] == pytest.approx(due, rel=1e-10)


def test_friction_is_against_the_way_to_the_next_goal() -> None:
    joint = "hinge: {point: [0, 0, 0], axis: [0, 0, 1], friction_torque: 0.02}"
    goal = "angle: 40}\n  - {at: 3, angle: 40}\n  - {at: 5, angle: 10}\n  - {at: 6, angle: -10"
    of, _ = held(joint, goal)
    lower, upper = attached.bounds(of)
    times = of.schedule.samples
    for k, time in enumerate(times):
        least, most = lower["drag"][k, 0], upper["drag"][k, 0]
        slow, fast = lower["coordinate_speed"][k, 0], upper["coordinate_speed"][k, 0]
        if 0 < time < 2 - 1e-9:
            assert (least, most, slow, fast) == (-1, -1, 0, np.inf)
        elif 3 + 1e-9 < time < 6 - 1e-9:
            assert (least, most, slow, fast) == (1, 1, -np.inf, 0)
        else:  # at both ends, from 2 s to 3 s, and where it turns back
            assert (least, most, slow, fast) == (-attached.HOLDING, attached.HOLDING, 0, 0)
