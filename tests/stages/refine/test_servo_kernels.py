"""Servos as balls about the joints: what keeps them clear, against coal, in all stages that do."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from casadi_hands.geometry.bodies.capsule import Capsule
from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.nlp import Kernel
from casadi_hands.problem.si import build_model
from casadi_hands.problem.structure import Structure
from casadi_hands.stages.refine import finger_kernels
from casadi_hands.stages.refine.problem import RefineProblem
from casadi_hands.stages.synthesis import kernels as synthesis
from casadi_hands.stages.whole_hand import kernels as whole_hand
from casadi_hands.task import parse_task
from casadi_hands.task.servos import SERVOS
from tests.stages.blocks import Place, between, check_block, frames, numbers, random_finger, shape
from tests.stages.example import PinFinger, everything, everything_text, g, palm_apart

Array = np.ndarray
RADIUS, THICK, SERVO, PALM_RADIUS, GROUND, MARGIN = 0.1, 0.16, 0.25, 1.2, -0.4, 0.03


def radii(finger: FingerSeed) -> list[float]:
    return [*[RADIUS] * (finger.joints - 1), THICK]


def placed(finger: FingerSeed) -> list[tuple[Array, Array]]:
    standing = PinFinger(finger, radii(finger)[0])
    return [(np.asarray(a), np.asarray(b)) for a, b in standing.links(finger.angles[0])]


def expected_rest(finger: FingerSeed, seen: list[tuple[Array, Array, float]], heights: list[float]) -> list[float]:
    """Distances by coal of one finger's servos from the object's rods in the palm frame, and so on."""
    links = placed(finger)
    joints = [start for start, _ in links]
    found = [between((at, at), (a, b), SERVO + radius) for at in joints for a, b, radius in seen]
    found += [palm_apart(at, PALM_RADIUS) - SERVO for at in joints[1:]]
    bodies = list(zip(links, radii(finger), strict=True))
    for j, at in enumerate(joints):
        away = [body for i, body in enumerate(bodies) if i not in (j - 1, j)]
        found += [between((at, at), link, radius + SERVO) for link, radius in away]
        found += [float(np.linalg.norm(at - there)) - 2 * SERVO for there in joints[j + 2 :]]
    return [*found, *[height - SERVO for height in heights]]


def added(distances: Array, without: Array) -> Array:
    """Distances that a kernel has more than the same without servos, all of whose it has, too."""
    left = distances.tolist()
    for each in without.tolist():
        left.remove(each)
    return np.array(left)


def paid_for_servos(
    kernel: Callable[..., Kernel], variables: dict[str, object], parameters: dict[str, object]
) -> float:
    """What a stage's kernel costs more with servos than without."""
    plain = {name: value for name, value in parameters.items() if name != "servo_radius"}
    costs = [
        numbers(kernel(servos=servos), variables, parameters if servos else plain)["collision"].sum()
        for servos in (True, False)
    ]
    return float(costs[0] - costs[1])


def expected_pair(one: FingerSeed, other: FingerSeed) -> list[float]:
    links = placed(one), placed(other)
    joints = [[start for start, _ in each] for each in links]
    bodies = [list(zip(each, radii(f), strict=True)) for each, f in zip(links, (one, other), strict=True)]
    found = [between((at, at), link, r + SERVO) for at, (link, r) in itertools.product(joints[0], bodies[1])]
    found += [between((at, at), link, r + SERVO) for at, (link, r) in itertools.product(joints[1], bodies[0])]
    return found + [float(np.linalg.norm(a - b)) - 2 * SERVO for a, b in itertools.product(*joints)]


@pytest.mark.parametrize("grounded", [False, True])
@pytest.mark.parametrize("joints", [1, 2, 3, 4])
def test_servos_are_as_far_from_all_else_as_coal_says(joints: int, grounded: bool) -> None:
    for seed in range(3):
        rng = np.random.default_rng((joints, seed))
        finger, place = random_finger(joints, rng), Place(rng)
        primitives = np.hstack([rng.normal(size=(2, 6)), [[0.2], [0.3]]])
        variables = {**shape(finger), "pose": place.pose, "angles": finger.angles[0]}
        sizes = {
            "radius": RADIUS,
            "tip_radius": THICK,
            "servo_radius": SERVO,
            "palm_radius": PALM_RADIUS,
            "ground_height": GROUND,
        }
        parameters = {"frames": frames(finger), **place.parameters, **sizes, "bodies": primitives.ravel()}
        kernel = finger_kernels.apart(joints, (Capsule, Capsule), None, grounded, servos=True)
        plain = finger_kernels.apart(joints, (Capsule, Capsule), None, grounded)
        seen = [(place.in_palm(c[:3]), place.in_palm(c[3:6]), c[6]) for c in primitives]
        heights = [(place.palm.apply(at) + place.palm_position)[2] - GROUND for at, _ in placed(finger)]
        due = expected_rest(finger, seen, heights if grounded else [])
        without = numbers(plain, variables, {n: v for n, v in parameters.items() if n != "servo_radius"})["clear"]
        found = added(numbers(kernel, variables, parameters)["clear"], without)
        # Kinks of capsules, and distances that vanish, are rounded.
        np.testing.assert_allclose(found, due, atol=6e-3)
        assert np.median(np.abs(found - due)) < 1e-4
        if seed == 0 and joints == 3:
            check_block(kernel, variables, parameters)


def test_servos_of_two_fingers_are_as_far_apart_as_coal_says() -> None:
    for seed in range(5):
        rng = np.random.default_rng(seed)
        one, other = random_finger(2, rng), random_finger(3, rng)
        variables = {**shape(one, "0"), "angles0": one.angles[0], **shape(other, "1"), "angles1": other.angles[0]}
        sizes = {"radius": RADIUS, "tip_radius": THICK, "servo_radius": SERVO}
        parameters = {"frames0": frames(one), "frames1": frames(other), **sizes}
        kernel, due = finger_kernels.fingers_apart(2, 3, servos=True), expected_pair(one, other)
        plain = {name: value for name, value in parameters.items() if name != "servo_radius"}
        without = numbers(finger_kernels.fingers_apart(2, 3), variables, plain)["clear"]
        found = added(numbers(kernel, variables, parameters)["clear"], without)
        np.testing.assert_allclose(found, due, atol=6e-3)
        assert np.median(np.abs(found - due)) < 1e-4
        if seed == 0:
            check_block(kernel, variables, parameters)


def test_the_stages_before_pay_for_what_is_nearer_than_their_margin() -> None:
    rng = np.random.default_rng(4)
    one, other, place = random_finger(2, rng), random_finger(3, rng), Place(rng)
    primitives = np.hstack([rng.normal(size=(2, 6)), [[0.5], [0.6]]])
    sizes = {"link_radius": RADIUS, "tip_radius": THICK, "servo_radius": SERVO, "margin": MARGIN}
    seen = [(c[:3], c[3:6], c[6]) for c in primitives]
    up = place.palm.inv().apply([0.0, 0.0, 1.0])
    heights = [up @ at - GROUND for at, _ in placed(other)]
    due = g(MARGIN - np.array(expected_rest(other, seen, heights))).sum()
    given = {"frames": frames(other), **sizes, "palm_radius": PALM_RADIUS, "bodies": primitives.ravel()}
    found = paid_for_servos(
        partial(synthesis.collide, 3, (Capsule, Capsule)),
        {**shape(other), "angles": other.angles[0]},
        {**given, "up": up, "ground": GROUND},
    )
    assert due > 0.02
    assert found == pytest.approx(due, rel=1e-2)
    moved = [(place.in_palm(c[:3]), place.in_palm(c[3:6]), c[6]) for c in primitives]
    level = float(place.palm_position[2])  # through the palm's middle
    heights = [place.palm.apply(at)[2] for at, _ in placed(other)]
    due = g(MARGIN - np.array(expected_rest(other, moved, heights))).sum()
    found = paid_for_servos(
        partial(whole_hand.object_clearance, 3, (Capsule, Capsule), False),
        {"pose": place.pose, "angles": other.angles[0]},
        {**given, **shape(other), **place.parameters, "ground_height": level},
    )
    assert due > 0.02
    assert found == pytest.approx(due, rel=1e-2)
    both = {"frames0": frames(one), "frames1": frames(other), **sizes, "servo_radius": 0.6}
    angles = {"angles0": one.angles[0], "angles1": other.angles[0]}
    shapes = {**shape(one, "0"), **shape(other, "1")}
    found_early = paid_for_servos(partial(synthesis.keep_apart, 2, 3), {**shapes, **angles}, both)
    found_late = paid_for_servos(partial(whole_hand.finger_clearance, 2, 3), angles, {**both, **shapes})
    larger = np.array(expected_pair(one, other))
    larger -= np.repeat([0.35, 0.7], [12, 6])  # a servo or two
    assert found_early == pytest.approx(g(MARGIN - larger).sum(), rel=1e-2)
    assert found_late == pytest.approx(found_early, rel=1e-9)


def test_only_a_task_with_servos_has_them_in_its_problem() -> None:
    text = everything_text().replace("joint_limits:", "drive: {servo: SG90}, joint_limits:")
    model = build_model(parse_task(text))
    assert model.servo == pytest.approx(SERVOS["SG90"].reach / model.units.length)
    assert everything()[1].servo == 0.0
    active = np.ones((len(model.schedule.samples), 4), bool)
    for each in (model, replace(model, servo=0.0)):
        problem = RefineProblem(Structure.of(each, (0, 2), (2, 3), active))
        has = {name for name, block in problem.blocks.items() if "servo_radius" in block.kernel.locals}
        kept_clear = {name for name in problem.blocks if name.startswith(("apart", "fingers_apart"))}
        assert len(kept_clear) >= 3
        assert has == (kept_clear if each.servo else set())
        assert ("servo_radius" in problem.problem.parameters) == bool(each.servo)
