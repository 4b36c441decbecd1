"""Every term of method 6 in the whole-hand problem, against its equation in NumPy at a made-up configuration."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.nlp import Options
from casadi_hands.problem.model import Model
from casadi_hands.stages.object_motion.values import term_weights
from casadi_hands.stages.whole_hand.stage import WholeHandStage
from tests.stages.example import (
    PinFinger,
    check_derivatives,
    cone,
    doubling_each_weight,
    everything,
    fingers_apart,
    folds_apart,
    from_palm_and_self,
    g,
    joints_and_tip,
    made_up_finger,
    made_up_values,
    marks,
    palm_apart,
    project,
    rod,
    segments_apart,
    sizes_of,
    spline_at,
    torques,
    unsupplied,
    with_tips,
)
from tests.stages.object_motion.test_kernels import ALL_TERMS, WEIGHT_OF
from tests.stages.object_motion.test_kernels import Witness as ObjectWitness

pytestmark = pytest.mark.usefixtures("interpreted")

Array = np.ndarray
MARGIN = 0.03
CONTACTS, JOINTS, SEEDS = (0, 1, 2), (1, 2, 3), (0, 1, 4)
BENDS = (1.8, 1.8, 0.4)  # rad: two beyond the joint limits, one straight into the object
FOLDED = (1.5, 0.0)  # rad, of a link that its joint then folds onto the one before
HAND_TERMS = {
    "contact_on_finger",
    "slip_on_finger",
    "friction_cone_hand",
    "null_space",
    "torque",
    "finger_acceleration",
    "joint_limits",
    "collision",
}


class Witness(ObjectWitness):
    """The hand's terms, unweighted; the object's are inherited."""

    def __init__(self, model: Model, values: dict[str, Array], fingers: tuple[FingerSeed, ...]) -> None:
        super().__init__(model, values)
        self.fingers, self.values, self.deepest, self.folded = fingers, values, 0.0, 0.0
        self.radii = [sizes_of(model, seed.joints) for seed in fingers]
        self.pins = [PinFinger(seed, sizes[0]) for seed, sizes in zip(fingers, self.radii, strict=True)]
        self.palms = [self.palm_at(0), self.palm_at(-1)]
        self.objects = [self.motion.at(0), self.motion.at(-1)]

    def palm_at(self, steps: int) -> tuple[Array, Rotation]:
        """Given pose with the offset of a palm that moves."""
        times = self.schedule.samples + steps * self.schedule.step
        position, orientation = self.motion.palm(times)
        if "palm" in self.values:
            offset = spline_at(self.schedule.keyframes, self.values["palm"], times)
            position, orientation = position + offset[:, :3], Rotation.from_rotvec(offset[:, 3:]) * orientation
        return position, orientation

    def angles_at(self, c: int, steps: int) -> Array:
        return spline_at(
            self.schedule.keyframes, self.values[f"angles{c}"], self.schedule.samples + steps * self.schedule.step
        )

    def in_palm(self, s: int, point: Array, before: bool = False) -> Array:
        """A point of the object (3,), object frame, seen from the palm at a sample or a step before it."""
        (positions, turns), (palm, orientation) = self.objects[before], self.palms[before]
        return orientation[s].inv().apply(positions[s] + turns[s].apply(point) - palm[s])

    def palm_clearance(self) -> float:
        """As the object's, from where the palm has moved to."""
        total = 0.0
        for s in range(len(self.schedule.samples)):
            for capsule in map(rod, self.model.bodies):
                for local in marks(capsule):
                    height = (self.objects[0][0][s] + self.objects[0][1][s].apply(local))[2]
                    total += float(g(0.02 + capsule[6] - palm_apart(self.in_palm(s, local), self.model.palm_radius)))
                    total += float(g(self.model.ground + capsule[6] - height))
        return total

    def terms(self) -> dict[str, float]:
        total = super().terms() | dict.fromkeys(HAND_TERMS, 0.0)
        for c in CONTACTS:
            self.touch(total, c)
            self.move(total, c)
        total["collision"] = self.collision()
        return total

    def touch(self, total: dict[str, float], c: int) -> None:
        seed, finger, h = self.fingers[c], self.pins[c], self.schedule.step
        now, before = self.angles_at(c, 0), self.angles_at(c, -1)
        tip = np.array([0, 0, self.model.hinge, 0, 0, seed.lengths[-1], self.model.tip_radius])
        for s in range(len(self.schedule.samples)):
            point, active, force = self.points[1][s, c], self.invariant[s, c], self.forces[""][s, c]
            size, touched = np.linalg.norm(force), self.in_palm(s, point)
            chain, rotation = finger.chain(now[s])
            on_link = rotation.T @ (touched - chain[-2])
            projection, normal = project(on_link, tip)
            total["contact_on_finger"] += size * active * ((projection - on_link) ** 2).sum()
            # Both bodies' material points were elsewhere a step ago; what they moved apart is slip.
            apart = finger.point(before[s], on_link) - self.in_palm(s, point, before=True)
            total["slip_on_finger"] += (active * size) ** 2 * ((apart / h) ** 2).sum()
            seen = self.palms[0][1][s].inv().apply(self.objects[0][1][s].apply(force))
            total["friction_cone_hand"] += active * cone(seen, rotation @ normal, self.model.friction)
            jacobian = finger.jacobian(now[s], on_link)
            total["null_space"] += active * unsupplied(jacobian, seen)
            total["torque"] += active**2 * (torques(jacobian, seen) ** 2).sum()

    def move(self, total: dict[str, float], c: int) -> None:
        low, high = self.model.joint_limits
        angles = [self.angles_at(c, k) for k in (-1, 0, 1)]
        for before, now, after in zip(*angles, strict=True):
            a, b, d = (self.pins[c].chain(q)[0][-1] for q in (before, now, after))
            total["finger_acceleration"] += (((d - 2 * b + a) / self.schedule.step**2) ** 2).sum()
            total["joint_limits"] += (np.maximum(now - high, 0) ** 2 + np.maximum(low - now, 0) ** 2).sum()

    def collision(self) -> float:
        model, total = self.model, 0.0
        angles = [self.angles_at(c, 0) for c in CONTACTS]
        for s in range(len(self.schedule.samples)):
            links = [finger.links(a[s]) for finger, a in zip(self.pins, angles, strict=True)]
            position, palm = self.palms[0][0][s], self.palms[0][1][s]
            for chain, radii in zip(links, self.radii, strict=True):
                apart = from_palm_and_self(chain, radii, model.palm_radius)
                heights = [((palm.apply(p) + position)[2], radius) for p, radius in joints_and_tip(chain, radii)]
                apart += [height - model.ground - radius for height, radius in heights]
                folds = folds_apart(chain, model.link_radius)
                total += float(g(-np.array(folds)).sum())
                self.folded = max([self.folded, *(-fold for fold in folds)])
                for capsule in map(rod, model.bodies):
                    ends = (self.in_palm(s, capsule[:3]), self.in_palm(s, capsule[3:6]))
                    gaps = [
                        segments_apart(*link, *ends) - radius - capsule[6]
                        for link, radius in zip(chain, radii, strict=True)
                    ]
                    apart += gaps[:-1]
                    total += float(g(-gaps[-1]))
                    self.deepest = max(self.deepest, -gaps[-1])
                total += float(g(MARGIN - np.array(apart)).sum())
            for i in range(3):
                for j in range(i):
                    between = fingers_apart(links[i], self.radii[i], links[j], self.radii[j])
                    total += float(g(MARGIN - np.array(between)).sum())
        return total


class Case:
    """The task with everything, three fingers of one, two and three joints; the palm given or free to move."""

    def __init__(self, palm_moves: bool) -> None:
        self.task, model = everything()
        self.model = with_tips(replace(model, hinge=2.1 * model.link_radius))
        self.stage = WholeHandStage(self.model, CONTACTS, JOINTS, palm_moves)
        self.fingers = tuple(made_up_finger(self.model, n, 1, *at) for n, *at in zip(JOINTS, SEEDS, BENDS, strict=True))
        self.fingers[1].bends[1] = FOLDED
        self.values = made_up_values(self.model)
        self.values |= {f"angles{c}": f.angles for c, f in enumerate(self.fingers)}
        if palm_moves:
            self.values["palm"] = np.random.default_rng(7).uniform(-0.3, 0.3, (len(self.model.schedule.keyframes), 6))
        self.weights = dict(self.task.weights.whole_hand)
        witness = Witness(self.model, self.values, self.fingers)
        self.expected = witness.terms()
        # A last link is in the object somewhere, or the cost of that would go unseen.
        assert witness.deepest > 0.02
        assert witness.folded > 0.02

    def parameters(self, weights: dict[str, float]) -> dict[str, object]:
        return self.stage._parameters(self.fingers) | term_weights(self.stage.problem, self.model, weights)

    def evaluate(self, weights: dict[str, float]) -> dict[str, float]:
        return self.stage.solver.evaluate(self.values, self.parameters(weights))


@pytest.fixture(scope="module", params=["palm given", "palm moves"])
def case(request: pytest.FixtureRequest) -> Case:
    return Case(request.param == "palm moves")


def test_the_problem_has_these_terms_and_no_others(case: Case) -> None:
    expected = {*ALL_TERMS, *HAND_TERMS} | ({"base_acceleration"} if case.stage.palm_moves else set())
    assert set(case.stage.problem.terms) == expected


@pytest.mark.parametrize("term", [*sorted(HAND_TERMS), *ALL_TERMS])
def test_term_is_its_equation(term: str, case: Case) -> None:
    name = term.removesuffix("_perturbed")
    share = 3 if term == "task" else len(case.model.schedule.keyframes)
    expected = case.weights[WEIGHT_OF.get(name, name)] / share * case.expected[term]
    assert expected > 1e-6
    # Folds are a small part of the overlaps.
    assert case.evaluate(case.weights)[term] == pytest.approx(expected, rel=1e-5 if term == "collision" else 1e-3)


def test_a_moving_palm_costs_its_acceleration_and_its_distance_from_what_was_given(case: Case) -> None:
    if not case.stage.palm_moves:
        assert "base_acceleration" not in case.evaluate(case.weights)
        return
    keyframes, offset = case.model.schedule.keyframes, case.values["palm"]
    step = np.diff(keyframes).mean()
    padded = np.vstack([offset[:1], offset, offset[-1:]])
    second = (padded[2:] - 2 * offset + padded[:-2]) / step**2
    expected = (second**2).sum() + 0.01 * (offset**2).sum()
    found = case.evaluate(case.weights)["base_acceleration"]
    assert found == pytest.approx(case.weights["base_acceleration"] / len(keyframes) * expected, rel=1e-9)


def test_every_weight_moves_its_own_terms(case: Case) -> None:
    sharpness = case.weights["friction_sharpness"]
    weights = {name: weight for name, weight in case.weights.items() if name != "friction_sharpness"}
    moved = doubling_each_weight(lambda w: case.evaluate({**w, "friction_sharpness": sharpness}), weights)
    for name, terms in moved.items():
        expected = {
            term for term in case.stage.problem.terms if WEIGHT_OF.get(t := term.removesuffix("_perturbed"), t) == name
        }
        assert terms == expected, name
    assert {name for name, terms in moved.items() if not terms} <= {"base_acceleration"}


def test_derivatives_agree_with_differences(case: Case) -> None:
    check_derivatives(case.stage.solver, case.values, case.parameters(case.weights))


# Solves that lose their way.


@pytest.mark.parametrize(
    ("violations", "kept"), [([1e-3, None], 0), ([0.7, 1e-4], 1), ([0.7, 0.9], 0), ([np.inf, 0.9], 1)]
)
def test_a_solve_that_loses_its_way_is_tried_with_a_larger_barrier(
    monkeypatch: pytest.MonkeyPatch, violations: list[float | None], kept: int
) -> None:
    task, model = everything()
    count, contacts = len(model.schedule.keyframes), model.contacts + 1
    stage: Any = WholeHandStage(model, CONTACTS, JOINTS, False)
    barriers: list[float] = []

    def solve(start: Any, parameters: Any, options: Options, lower: Any, upper: Any) -> Any:
        assert set(lower) == set(upper) == {"invariant", "pose"}
        barriers.append(options.mu_init)
        return SimpleNamespace(violation=violations[len(barriers) - 1], number=len(barriers) - 1)

    monkeypatch.setattr(stage, "solver", SimpleNamespace(solve=solve))
    monkeypatch.setattr(stage, "_start_points", lambda *_: np.zeros((count, contacts, 3)))
    monkeypatch.setattr(stage, "_result", lambda solution, *_: solution)
    moving: Any = SimpleNamespace(
        active=np.ones((count, contacts), bool),
        pose=np.zeros((count, 6)),
        force=np.zeros((count, contacts, 3)),
        solution=SimpleNamespace(values={"force_perturbed": None}),
    )
    fingers = tuple(made_up_finger(model, n, count, seed=n) for n in JOINTS)
    found = stage.solve(moving, fingers, dict(task.weights.whole_hand), Options(mu_init=1e-3))
    assert found.number == kept
    assert barriers == ([1e-3] if violations[1] is None else [1e-3, 1e-2])
