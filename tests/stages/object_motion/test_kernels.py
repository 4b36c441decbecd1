"""Every term of method 4 in the floating problem, against its equation in NumPy at a made-up configuration."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.problem.model import Model
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.stage import FloatingStage
from casadi_hands.stages.object_motion.values import (
    object_parameters,
    pose_bounds,
    straight_path,
    term_weights,
    tool_path,
)
from casadi_hands.task import Task, parse_task
from tests.problem.test_model import rotations
from tests.stages.example import (
    Motion,
    check_derivatives,
    cone,
    doubling_each_weight,
    drawing,
    everything,
    everything_text,
    g,
    linear_at,
    made_up_values,
    marks,
    palm_apart,
    project,
    resting_at,
    rod,
    spline_at,
)

pytestmark = pytest.mark.usefixtures("interpreted")

Array = np.ndarray
GROUND_TERMS = {"ground_friction_cone", "contact_on_ground", "slip_on_ground"}
FORCE_TERMS = {
    "linear_momentum",
    "angular_momentum",
    "force_regularisation",
    "raw_force",
    "friction_cone",
    "contact_on_object",
    "slip_on_object",
    "tangential_slip",
} | GROUND_TERMS


class Witness:
    """The floating stage's terms, unweighted, written once more without CasADi."""

    def __init__(self, model: Model, values: dict[str, Array]) -> None:
        self.model, self.schedule = model, model.schedule
        samples, count = len(self.schedule.samples), values["invariant"].shape[1]
        self.motion = Motion(model, values["pose"])
        self.pose = values["pose"]
        keyframes = np.searchsorted(self.schedule.keyframes, self.schedule.samples + 1e-9) - 1
        self.invariant = values["invariant"][keyframes]
        self.forces = {"": values["force"].reshape(samples, count, 3)}
        if model.disturbance is not None:
            self.forces["_perturbed"] = values["force_perturbed"].reshape(samples, count, 3)
        self.points = [
            spline_at(self.schedule.keyframes, values["point"], self.schedule.samples + k * self.schedule.step).reshape(
                samples, count, 3
            )
            for k in (-1, 0, 1)
        ]

    def terms(self) -> dict[str, float]:
        found = self.motion_terms()
        for suffix in self.forces:
            found |= {name + suffix: value for name, value in self.force_terms(suffix).items()}
        return found

    def motion_terms(self) -> dict[str, float]:
        model, h = self.model, self.schedule.step
        before, now, after = self.points
        patches = model.patches
        return {
            "object_acceleration": ((self.motion.acceleration - self.carried()) ** 2).sum(),
            "object_angular_acceleration": (self.motion.inertial_torque**2).sum() / h**2,
            "contact_acceleration": (((after - 2 * now + before) / h) ** 2).sum(),
            "contact_patch": ((now - patches) ** 2).sum(),
            "palm_clearance": self.palm_clearance(),
            "task": self.task(),
            "path": ((self.pose - self.straight()) ** 2).sum(),
        }

    def carried(self) -> Array:
        """Acceleration of where the object is at first, were it fixed to the palm; motions mirror at their ends."""
        model = self.model
        if model.tool is not None:
            return np.zeros(3)
        step = self.schedule.step
        before, fixed, after = (self.motion.along(self.schedule.samples + k * step)[:, :3] for k in (-1, 0, 1))
        return (before - 2 * fixed + after) / step**2

    def straight(self) -> Array:
        """Goals joined by straight lines as the palm sees it; a drawing's object upright, and at rest at every goal."""
        model, times = self.model, self.schedule.keyframes
        goal_times = times[list(self.schedule.goals)]
        if model.tool is None:
            at = [int(np.argmin(np.abs(self.schedule.samples - time))) for time in times]
            palm, places = rotations(model.palm_quaternion[at]), model.palm_position[at]
            goals = list(self.schedule.goals)
            seen = palm[goals].inv().apply(model.goal_positions - places[goals])
            turns = (palm[0] * palm[goals].inv() * Rotation.from_rotvec(model.goal_vectors)).as_rotvec()
            between = linear_at(goal_times, np.hstack([seen, turns]), times)
            turned = palm * palm[0].inv() * Rotation.from_rotvec(between[:, 3:])
            return np.hstack([places + palm.apply(between[:, :3]), turned.as_rotvec()])
        positions = resting_at(goal_times, model.goal_positions - model.tool, times)
        return np.hstack([positions, np.zeros_like(positions)])

    def drawn(self) -> Array:
        """Where a drawing's tool must be at the samples."""
        goal_times = self.schedule.keyframes[list(self.schedule.goals)]
        return resting_at(goal_times, self.model.goal_positions, self.schedule.samples)

    def task(self) -> float:
        model = self.model
        positions, orientations = self.motion.at(0)
        goal_times = self.schedule.keyframes[list(self.schedule.goals)]
        if model.tool is not None:
            tool = np.array([p + r.apply(model.tool) for p, r in zip(positions, orientations, strict=True)])
            return float(((tool - self.drawn()) ** 2).sum())
        total, reference = 0.0, rotations(model.reference)
        for time, position, vector in zip(goal_times, model.goal_positions, model.goal_vectors, strict=True):
            sample = int(np.argmin(np.abs(self.schedule.samples - time)))
            angle = (orientations[sample].inv() * type(reference).from_rotvec(vector) * reference).magnitude()
            total += ((positions[sample] - position) ** 2).sum() + (2 * np.sin(angle / 2)) ** 2
        return float(total)

    def palm_clearance(self) -> float:
        """Ends and middle of each body's axis against palm (0.02 lengths apart) and ground; a ball's centre thrice."""
        model, total = self.model, 0.0
        positions, orientations = self.motion.at(0)
        for s, (position, turn) in enumerate(zip(positions, orientations, strict=True)):
            palm = rotations(model.palm_quaternion[s])
            for capsule in map(rod, model.bodies):
                for mark in marks(capsule):
                    point = position + turn.apply(mark)
                    seen = palm.inv().apply(point - model.palm_position[s])
                    total += float(g(0.02 + capsule[6] - palm_apart(seen, model.palm_radius)))
                    if model.ground is not None:
                        total += float(g(model.ground + capsule[6] - point[2]))
        return total

    def force_terms(self, suffix: str) -> dict[str, float]:
        model, forces = self.model, self.forces[suffix]
        total = dict.fromkeys(FORCE_TERMS if model.ground is not None else FORCE_TERMS - GROUND_TERMS, 0.0)
        orientations = self.motion.at(0)[1]
        push = twist = np.zeros((len(orientations), 3))
        if suffix:
            assert model.disturbance is not None
            push, twist = model.disturbance.force, model.disturbance.torque
        acceleration, torque_of_motion = self.motion.acceleration, self.motion.inertial_torque
        for s, turn in enumerate(orientations):
            c, force, point = self.invariant[s], forces[s], self.points[1][s]
            net = turn.apply(c @ force) + model.gravity + push[s] - model.units.inertial * acceleration[s]
            torque = c @ np.cross(point, force) + turn.inv().apply(twist[s]) - torque_of_motion[s]
            total["linear_momentum"] += net @ net
            total["angular_momentum"] += torque @ torque
            total["force_regularisation"] += ((c[:, None] * force) ** 2).sum()
            total["raw_force"] += (force**2).sum()
            for i in range(model.contacts):
                self.finger_contact(total, s, i, force[i], c[i])
            if model.ground is not None:
                self.ground_contact(total, s, force[-1], c[-1])
        return total

    def finger_contact(self, total: dict[str, float], s: int, i: int, force: Array, c: float) -> None:
        model, h = self.model, self.schedule.step
        point, before = self.points[1][s, i], self.points[0][s, i]
        (projection, normal), size = project(point, rod(model.touched[i])), np.linalg.norm(force)
        total["friction_cone"] += c * cone(force, -normal, model.friction)
        total["contact_on_object"] += size * c * ((projection - point) ** 2).sum()
        gap_rate = ((projection - point) - (project(before, rod(model.touched[i]))[0] - before)) / h
        total["slip_on_object"] += (c * size) ** 2 * (gap_rate**2).sum()
        total["tangential_slip"] += (c * size) ** 2 * (((point - before) / h) ** 2).sum()

    def ground_contact(self, total: dict[str, float], s: int, force: Array, c: float) -> None:
        """The ground pushes along the world's z; the point that touches is at its height and does not slip."""
        model, h = self.model, self.schedule.step
        assert model.ground is not None
        point, size = self.points[1][s, -1], np.linalg.norm(force)
        (position, turn), (position_before, turn_before) = (
            (p[s], r[s]) for p, r in (self.motion.at(0), self.motion.at(-1))
        )
        projection, normal = project(point, rod(model.touched[-1]))
        in_world = position + turn.apply(point)
        moved = in_world - position_before - turn_before.apply(point)
        total["ground_friction_cone"] += c * cone(turn.apply(force), np.array([0, 0, 1]), model.frictions[-1])
        total["contact_on_object"] += size * c * ((projection - point) ** 2).sum()
        tilt = turn.apply(normal) + np.array([0, 0, 1])
        total["contact_on_ground"] += size * c * ((in_world[2] - model.ground) ** 2 + 0.1 * tilt @ tilt)
        total["slip_on_ground"] += (c * size) ** 2 * ((moved / h) ** 2).sum()


class Case:
    """A task with a made-up configuration, its stage and its witness."""

    def __init__(self, task: Task, model: Model) -> None:
        self.task, self.model = task, model
        self.stage = FloatingStage(model)
        self.values = made_up_values(model)
        self.weights = dict(task.weights.floating)
        self.expected = Witness(model, self.values).terms()

    def evaluate(self, weights: dict[str, float]) -> dict[str, float]:
        parameters = object_parameters(self.model) | term_weights(self.stage.solver.problem, self.model, weights)
        return self.stage.solver.evaluate(self.values, parameters)

    def constraints(self) -> Array:
        """All constraints' values, in the order of the problem's rows."""
        problem = self.stage.solver.problem
        parameters = object_parameters(self.model) | term_weights(problem, self.model, self.weights)
        x = problem.variables.pack(self.values, np.zeros(problem.variables.size))
        p = problem.parameters.pack(parameters, np.zeros(problem.parameters.size))
        return np.asarray(self.stage.solver.functions["nlp"](x, p)[1]).ravel()


@pytest.fixture(scope="module")
def full() -> Case:
    return Case(*everything())


@pytest.fixture(scope="module")
def drawn() -> Case:
    return Case(*drawing())


MOTION_TERMS = [
    "object_acceleration",
    "object_angular_acceleration",
    "contact_acceleration",
    "contact_patch",
    "palm_clearance",
    "task",
    "path",
]
ALL_TERMS = MOTION_TERMS + sorted(FORCE_TERMS) + sorted(f"{term}_perturbed" for term in FORCE_TERMS)
CONTACTS = ("contact0", "contact1", "contact2")
WEIGHT_OF = {
    "ground_friction_cone": "friction_cone",
    "contact_on_ground": "contact_on_object",
    "slip_on_ground": "tangential_slip",
}


def test_the_problem_has_these_terms_and_no_others(full: Case, drawn: Case) -> None:
    assert sorted(full.stage.solver.problem.terms) == sorted(ALL_TERMS)
    assert sorted(drawn.stage.solver.problem.terms) == sorted({*MOTION_TERMS, *FORCE_TERMS} - GROUND_TERMS)


@pytest.mark.parametrize("term", ALL_TERMS)
def test_term_is_its_equation(term: str, full: Case) -> None:
    name = term.removesuffix("_perturbed")
    weight = full.weights[WEIGHT_OF.get(name, name)]
    # All but the task's are divided by the number of keyframes, the task's by the number of goals.
    share = 3 if term == "task" else len(full.model.schedule.keyframes)
    expected = weight / share * full.expected[term]
    assert expected > 1e-3
    assert full.evaluate(full.weights)[term] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("term", [*MOTION_TERMS, *sorted(FORCE_TERMS - GROUND_TERMS)])
def test_term_of_a_drawing_is_its_equation(term: str, drawn: Case) -> None:
    share = len(drawn.model.schedule.samples if term == "task" else drawn.model.schedule.keyframes)
    expected = drawn.weights[term] / share * drawn.expected[term]
    assert drawn.evaluate(drawn.weights)[term] == pytest.approx(expected, rel=1e-4, abs=1e-12)


def test_every_weight_moves_its_own_terms(full: Case) -> None:
    weights = {name: weight for name, weight in full.weights.items() if name != "friction_sharpness"}
    moved = doubling_each_weight(
        lambda w: full.evaluate({**w, "friction_sharpness": full.weights["friction_sharpness"]}), weights
    )
    for name, terms in moved.items():
        expected = {term for term in ALL_TERMS if WEIGHT_OF.get(t := term.removesuffix("_perturbed"), t) == name}
        assert terms == expected, name
        assert terms


def test_sharpness_is_that_of_the_cones(full: Case) -> None:
    changed = full.evaluate({**full.weights, "friction_sharpness": 2.0})
    plain = full.evaluate(full.weights)
    different = {name for name in plain if changed[name] != plain[name]}
    assert different == {f"{a}friction_cone{b}" for a in ("", "ground_") for b in ("", "_perturbed")}


def without(text: str, *lines: str) -> str:
    return "\n".join(line for line in text.splitlines() if not any(word in line for word in lines))


@pytest.mark.parametrize(
    ("removed", "gone"),
    [
        (["perturbations:", "- {from"], lambda term: term.endswith("_perturbed")),
        (["ground:"], lambda term: "ground" in term),
    ],
)
def test_what_a_task_does_not_have_is_not_in_its_problem(removed: list[str], gone: Callable[[str], bool]) -> None:
    task = parse_task(without(everything_text(), *removed))
    case = Case(task, build_model(task))
    assert sorted(case.stage.solver.problem.terms) == sorted(term for term in ALL_TERMS if not gone(term))
    found, keyframes = case.evaluate(case.weights), len(case.model.schedule.keyframes)
    for term, value in case.expected.items():
        name = WEIGHT_OF.get(t := term.removesuffix("_perturbed"), t)
        share = 3 if term == "task" else keyframes
        assert found[term] == pytest.approx(case.weights[name] / share * value, rel=1e-4), term


@pytest.mark.parametrize("fixture", ["full", "drawn"])
def test_derivatives_agree_with_differences(fixture: str, request: pytest.FixtureRequest) -> None:
    case = request.getfixturevalue(fixture)
    problem = case.stage.solver.problem
    parameters = object_parameters(case.model) | term_weights(problem, case.model, case.weights)
    check_derivatives(case.stage.solver, case.values, parameters)


def test_activity_is_boxed_and_a_keyframe_keeps_two_contacts(full: Case) -> None:
    problem = full.stage.solver.problem
    lower, upper = (problem.variables.unpack(v)["invariant"] for v in (problem.lower, problem.upper))
    assert (lower == 0).all()
    assert (upper == 1).all()
    rows = problem.constraint_rows["enough_contacts.sum"]
    assert set(problem.constraint_lower[rows].ravel()) == {2}
    assert set(problem.constraint_upper[rows].ravel()) == {np.inf}
    sums = full.constraints()[rows].ravel()
    np.testing.assert_allclose(sums, full.values["invariant"].sum(axis=1), atol=1e-12)


@pytest.mark.parametrize("suffix", ["", "_perturbed"])
def test_every_contact_force_is_held_in_its_cone(full: Case, suffix: str) -> None:
    model, problem, witness = full.model, full.stage.solver.problem, Witness(full.model, full.values)
    assert model.ground is not None
    orientations, constraints = witness.motion.at(0)[1], full.constraints()
    for c, name in enumerate((*CONTACTS, "ground")):
        rows = problem.constraint_rows[f"{name}{suffix}.in_cone"]
        assert set(problem.constraint_lower[rows].ravel()) == {0}
        assert set(problem.constraint_upper[rows].ravel()) == {np.inf}
        margins = []
        for s, turn in enumerate(orientations):
            force, friction = witness.forces[suffix][s, c], model.friction
            if name == "ground":
                inward, friction = turn.inv().apply([0, 0, 1]), model.frictions[-1]
            else:
                inward = -project(witness.points[1][s, c], rod(model.touched[c]))[1]
            across = np.linalg.norm(np.cross(force, inward))
            # Rounded to the safe side where nothing acts across the normal.
            margins.append(friction * force @ inward - np.hypot(across, 1e-3))
        assert np.ptp(margins) > 1
        np.testing.assert_allclose(constraints[rows].ravel(), margins, atol=2e-4)


def test_there_are_no_other_constraints(full: Case) -> None:
    cones = [f"{name}{suffix}.in_cone" for suffix in ("", "_perturbed") for name in (*CONTACTS, "ground")]
    assert sorted(full.stage.solver.problem.constraint_rows) == sorted([*cones, "enough_contacts.sum"])


def test_poses_are_held_close_to_their_goals_only(full: Case) -> None:
    lower, upper = pose_bounds(full.model)
    goals = list(full.model.schedule.goals)
    middle = (lower[goals] + upper[goals]) / 2
    np.testing.assert_allclose(middle, np.hstack([full.model.goal_positions, full.model.goal_vectors]), atol=1e-12)
    assert (upper - lower)[goals].max() <= 1.01e-3
    free = np.delete(upper - lower, goals, axis=0)
    assert (free[:, :3] == np.inf).all()
    assert (free[:, 3:] > 10).all()


def test_straight_path_joins_the_goals(full: Case, drawn: Case) -> None:
    for case in (full, drawn):
        witness = Witness(case.model, case.values)
        np.testing.assert_allclose(straight_path(case.model), witness.straight(), atol=1e-12)
    np.testing.assert_allclose(tool_path(drawn.model), Witness(drawn.model, drawn.values).drawn(), atol=1e-12)
