"""Every term of method 5 in the synthesis problem, against its equation in NumPy at made-up fingers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.nlp import Options
from casadi_hands.problem.model import Model
from casadi_hands.problem.si import build_model
from casadi_hands.stages.synthesis.seeds import random_finger
from casadi_hands.stages.synthesis.stage import Synthesised, SynthesisStage
from casadi_hands.stages.synthesis.target import Target, target_of
from casadi_hands.task import Task, parse_task
from tests.stages.example import (
    PinFinger,
    check_derivatives,
    doubling_each_weight,
    everything,
    everything_text,
    fingers_apart,
    folds_apart,
    from_palm_and_self,
    g,
    joints_and_tip,
    linear_at,
    made_up_finger,
    made_up_floating,
    rods,
    segments_apart,
    sizes_of,
    torques,
    unsupplied,
    with_tips,
)

pytestmark = pytest.mark.usefixtures("interpreted")

Array = np.ndarray
MARGIN = 0.03  # clearance asked of what need not touch, lengths
JOINTS = (1, 2, 3)
BENDS = (1.8, 1.8, 0.4)  # rad: two beyond the joint limits, one straight into the object
FOLDED = (1.5, 0.0)  # rad, of a link that its joint then folds onto the one before
TERMS = {
    "bend",
    "tip_target",
    "null_space",
    "torque",
    "joint_limits",
    "length",
    "minimum_length",
    "finger_base",
    "collision",
    "fingertip_acceleration",
}


class Witness:
    """The terms, unweighted, of some fingers together."""

    def __init__(self, model: Model, target: Target, fingers: tuple[FingerSeed, ...]) -> None:
        self.model, self.target, self.fingers, self.deepest, self.folded = model, target, fingers, 0.0, 0.0
        self.radii = [sizes_of(model, seed.joints) for seed in fingers]
        self.pins = [PinFinger(seed, sizes[0]) for seed, sizes in zip(fingers, self.radii, strict=True)]
        self.collision_times = np.unique(
            np.concatenate([np.linspace(a, b, 4) for a, b in zip(target.times[:-1], target.times[1:], strict=True)])
        )

    def terms(self) -> dict[str, float]:
        total = dict.fromkeys(TERMS, 0.0)
        for c, (seed, pin_finger) in enumerate(zip(self.fingers, self.pins, strict=True)):
            self.follow(total, c, seed, pin_finger)
            self.build(total, seed)
            self.travel(total, c, seed, pin_finger)
        total["collision"] = self.collision()
        return total

    def follow(self, total: dict[str, float], c: int, seed: FingerSeed, finger: PinFinger) -> None:
        low, high = self.model.joint_limits
        string, started = -1, False
        for k, active in enumerate(self.target.active[:, c]):
            total["joint_limits"] += float((g(seed.angles[k] - high) + g(low - seed.angles[k])).sum())
            if active and not started:
                string += 1
            started = bool(active)
            if not active:
                continue
            on_link = self.on_tip(seed, seed.tips[string])
            jacobian = finger.jacobian(seed.angles[k], on_link)
            miss = finger.point(seed.angles[k], on_link) - self.target.points[k, c]
            total["tip_target"] += miss @ miss
            total["null_space"] += unsupplied(jacobian, self.target.forces[k, c])
            total["torque"] += (torques(jacobian, self.target.forces[k, c]) ** 2).sum()

    def on_tip(self, seed: FingerSeed, coordinates: Array) -> Array:
        """Along the cap by the coordinates' length, on down the cylinder."""
        arc, radius = np.linalg.norm(coordinates), self.model.tip_radius
        angle = min(arc / radius, np.pi / 2)
        side = np.append(coordinates / arc, 0) * radius * np.sin(angle)
        along = seed.lengths[-1] + radius * np.cos(angle) - max(arc - radius * np.pi / 2, 0)
        return np.append(side[:2], along)

    def build(self, total: dict[str, float], seed: FingerSeed) -> None:
        shortest, longest = self.model.link_length
        least = np.full(seed.joints, shortest)
        least[-1] = self.model.shortest_last
        total["length"] += (seed.lengths**2).sum()
        total["bend"] += (seed.bends**2).sum()
        total["minimum_length"] += float((g(least - seed.lengths) + g(seed.lengths - longest)).sum())
        edge = self.model.palm_radius - sizes_of(self.model, seed.joints)[0]
        total["finger_base"] += float(g(np.linalg.norm(seed.base) - edge))

    def travel(self, total: dict[str, float], c: int, seed: FingerSeed, finger: PinFinger) -> None:
        times = self.target.times
        for k in range(1, len(times) - 1):
            if not self.target.active[k, c]:
                tips = [finger.chain(seed.angles[k + i])[0][-1] for i in (-1, 0, 1)]
                step = (times[k + 1] - times[k - 1]) / 2
                total["fingertip_acceleration"] += (((tips[2] - 2 * tips[1] + tips[0]) / step**2) ** 2).sum()

    def collision(self) -> float:
        model, total = self.model, 0.0
        bodies, up, ground = self.target.scene(self.collision_times)
        angles = [linear_at(self.target.times, seed.angles, self.collision_times) for seed in self.fingers]
        for t in range(len(self.collision_times)):
            links = [finger.links(a[t]) for finger, a in zip(self.pins, angles, strict=True)]
            for chain, radii in zip(links, self.radii, strict=True):
                apart = from_palm_and_self(chain, radii, model.palm_radius)
                apart += [up[t] @ p - ground[t] - radius for p, radius in joints_and_tip(chain, radii)]
                folds = folds_apart(chain, model.link_radius)
                total += float(g(-np.array(folds)).sum())
                self.folded = max([self.folded, *(-fold for fold in folds)])
                for capsule in rods(self.model.bodies, bodies[t]):
                    gaps = [
                        segments_apart(*link, capsule[:3], capsule[3:6]) - radius - capsule[6]
                        for link, radius in zip(chain, radii, strict=True)
                    ]
                    apart += gaps[:-1]
                    total += float(g(-gaps[-1]))  # the last link may touch
                    self.deepest = max(self.deepest, -gaps[-1])
                total += float(g(MARGIN - np.array(apart)).sum())
            for i in range(len(links)):
                for j in range(i):
                    between = fingers_apart(links[i], self.radii[i], links[j], self.radii[j])
                    total += float(g(MARGIN - np.array(between)).sum())
        return total


class Case:
    """Three fingers of one, two and three joints, with every term at work."""

    def __init__(self) -> None:
        self.task: Task
        self.task, model = everything()
        self.model = with_tips(model)
        self.target = target_of(self.model, made_up_floating(self.model))
        self.stage = SynthesisStage(self.target, (0, 1, 2), JOINTS)
        self.fingers = tuple(
            made_up_finger(self.model, n, self.target.strings(c), seed=c, bend=BENDS[c]) for c, n in enumerate(JOINTS)
        )
        self.fingers[1].lengths[0] = 0.5 * self.model.link_length[0]
        self.fingers[0].base[:] = [0.9, -0.8]
        self.fingers[1].bends[1] = FOLDED
        self.weights = dict(self.task.weights.synthesis)
        witness = Witness(self.model, self.target, self.fingers)
        self.expected = witness.terms()
        # A last link is in the object somewhere, or the cost of that would go unseen.
        assert witness.deepest > 0.02
        assert witness.folded > 0.02

    def evaluate(self, weights: dict[str, object], step: int = 2) -> dict[str, float]:
        parameters = {**self.stage._parameters(self.fingers), **self.stage._weights(weights, step)}
        return self.stage.solver.evaluate(self.stage._values(self.fingers), parameters)


@pytest.fixture(scope="module")
def case() -> Case:
    return Case()


def test_the_problem_has_these_terms_and_no_others(case: Case) -> None:
    # Eq. 2.19 has no term: a contact in coordinates of the tip's surface is on it.
    assert set(case.stage.problem.terms) == TERMS


@pytest.mark.parametrize("step", [0, 1, 2])
@pytest.mark.parametrize("term", sorted(TERMS))
def test_term_is_its_equation(term: str, step: int, case: Case) -> None:
    weight = case.weights[term]
    weight = weight[step] if isinstance(weight, tuple) else weight
    keyframes = len(case.target.times)
    once = {"length": 1, "bend": 1, "minimum_length": 1, "finger_base": 1, "collision": 3 * (keyframes - 1) + 1}
    expected = weight * case.expected[term] / once.get(term, keyframes)
    assert expected > 1e-6
    assert case.evaluate(case.weights, step)[term] == pytest.approx(expected, rel=2e-3)


def test_every_weight_moves_its_own_term(case: Case) -> None:
    assert doubling_each_weight(case.evaluate, case.weights) == {term: {term} for term in TERMS}


def test_the_annealing_is_that_of_table_2_3(case: Case) -> None:
    values = [case.evaluate(case.weights, step) for step in range(3)]
    assert values[1]["tip_target"] / values[0]["tip_target"] == pytest.approx(10 / 50)
    assert values[2]["tip_target"] / values[0]["tip_target"] == pytest.approx(1)
    assert values[1]["collision"] / values[0]["collision"] == pytest.approx(5 / 0.1)
    assert values[2]["collision"] / values[0]["collision"] == pytest.approx(100 / 0.1)


def test_derivatives_agree_with_differences(case: Case) -> None:
    parameters = {**case.stage._parameters(case.fingers), **case.stage._weights(case.weights, 2)}
    check_derivatives(case.stage.solver, case.stage._values(case.fingers), parameters)


@pytest.fixture(scope="module")
def solved(case: Case) -> Synthesised:
    return case.stage.solve(case.fingers, case.weights)


def test_a_solve_runs_the_schedule_and_lowers_the_last_step_s_cost(case: Case, solved: Synthesised) -> None:
    assert [step for step, _ in solved.runs] == ["anneal 0", "anneal 1", "anneal 2"]
    assert solved.solution is solved.runs[-1][1]
    assert solved.solution.objective < 0.5 * sum(case.evaluate(case.weights, 2).values())


def test_the_last_step_keeps_limits_as_bounds(case: Case, solved: Synthesised) -> None:
    low, high = case.model.joint_limits
    shortest, longest = case.model.link_length
    for n, finger in zip(JOINTS, solved.fingers, strict=True):
        assert finger.joints == n
        assert finger.angles.min() >= low - 1e-6
        assert finger.angles.max() <= high + 1e-6
        assert finger.lengths.min() >= shortest - 1e-6
        assert finger.lengths.max() <= longest + 1e-6


def hinge_angles(fingers: tuple[FingerSeed, ...]) -> tuple[Array, Array]:
    """Degrees of bends, and of axes from their links and those before them, of all fingers; by SciPy."""
    bends, off = [], []
    for finger in fingers:
        for j, (bend, axis) in enumerate(zip(finger.bends, PinFinger(finger, 1.0).axes, strict=True)):
            turn = Rotation.from_rotvec([*bend, 0.0])
            bends.append(np.degrees(turn.magnitude()))
            beside = [axis, turn.apply(axis)][: 2 if j else 1]
            off += [np.degrees(np.arctan2(np.hypot(x, y), abs(z))) for x, y, z in beside]
    return np.array(bends), np.array(off)


def test_a_solve_keeps_bends_and_hinges_from_a_start_that_has_them_not(case: Case, solved: Synthesised) -> None:
    bends, off = hinge_angles(case.fingers)
    assert bends.max() > 80
    assert off.min() < 55
    bends, off = hinge_angles(solved.fingers)
    assert bends.max() <= 90 + 1e-2
    assert off.min() >= 60 - 0.1  # to the solver's tolerance of squared cosines


@pytest.mark.parametrize(("bend", "least", "largest"), [(20, 89, 90), (0, 60, 90), (15, 0, 10)])
def test_a_solve_keeps_narrow_ranges(bend: float, least: float, largest: float) -> None:
    text = everything_text().replace("hand: {", f"hand: {{bend: {bend}, axes: {{from_link: [{least}, {largest}]}}, ")
    model = build_model(parse_task(text))
    target = target_of(model, made_up_floating(model))
    stage, rng = SynthesisStage(target, (1,), (2,)), np.random.default_rng(0)
    found = stage.solve((random_finger(target, 1, 2, rng),), dict(parse_task(text).weights.synthesis))
    bends, off = hinge_angles(found.fingers)
    assert bends.max() <= bend + 1e-2
    assert off.min() >= least - 0.2
    assert off.max() <= largest + 0.2
    if not bend:
        assert not found.fingers[0].bends.any()


def test_the_result_s_terms_are_those_of_its_fingers(case: Case, solved: Synthesised) -> None:
    expected = Witness(case.model, case.target, solved.fingers).terms()
    keyframes = len(case.target.times)
    terms = solved.solution.terms
    assert terms["tip_target"] == pytest.approx(50 * expected["tip_target"] / keyframes, rel=1e-2, abs=1e-5)
    assert terms["null_space"] == pytest.approx(expected["null_space"] / keyframes, rel=1e-2)


def test_a_finger_alone_is_a_hand_of_one_and_contacts_without_idle_times_have_no_travel(case: Case) -> None:
    floating = made_up_floating(case.model)
    floating.active[:] = True
    target = target_of(case.model, floating)
    stage = SynthesisStage(target, (1,), (2,))
    assert set(stage.problem.terms) == TERMS - {"fingertip_acceleration"}
    seed = made_up_finger(case.model, 2, 1, 3)
    capped = stage.solve((seed,), case.weights, Options(max_iter=2))
    assert capped.contacts == (1,)
    assert [solution.iterations for _, solution in capped.runs] == [2, 2, 2]
    np.testing.assert_array_equal(capped.fingers[0].frames, seed.frames)
