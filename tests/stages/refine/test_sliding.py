"""Contacts that may slide: friction on its cone against the slip, and nothing of it where they must roll."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from casadi_hands import solve
from casadi_hands.geometry.bodies.capsule import Capsule
from casadi_hands.geometry.bodies.sphere import Sphere
from casadi_hands.problem.si import build_model
from casadi_hands.problem.structure import Structure
from casadi_hands.stages.refine import finger_kernels, sliding
from casadi_hands.stages.refine.declaration import Declaration
from casadi_hands.stages.refine.problem import RefineProblem
from casadi_hands.stages.refine.settings import ALL_STEPS, LAST_STEP, SHARPER, VISCOUS, graded
from casadi_hands.stages.refine.sliding import SLIP_SCALE, WHOLE
from casadi_hands.stages.refine.touching import runs
from casadi_hands.stages.refine.values import Margin
from casadi_hands.task import parse_task
from tests.stages.blocks import STEP, check_block, numbers
from tests.stages.example import everything, everything_text
from tests.stages.refine.test_finger_kernels import BALL, TIP, Block, on_cap, rolling_block
from tests.stages.refining import MadeUp

pytestmark = pytest.mark.usefixtures("interpreted")

Array = np.ndarray
FRICTION, MARGIN, SCALE = 0.6, 0.5, 0.01


# The law. A ball's contact at its top: the normal is z, and of a helper along x the tangents are -y and x.


def law_block(force: Array, slip: Array, sticking: Array, change: float = 0.0) -> Block:
    """A contact whose force, on the ball, is (along the first tangent, along the second, pressing)."""
    along = np.array([force[1], -force[0], -force[2]])
    variables = {"force0": (1 + change) * along, "force1": (1 - change) * along}
    variables |= {"point0": [0, 0, BALL], "point1": [0, 0, BALL], "slip": slip, "sticking": sticking}
    parameters = {"body": [0, 0, 0, BALL], "helper": [1.0, 0, 0], "sliding_friction": FRICTION}
    return variables, {**parameters, "slide_margin": MARGIN, "slip_scale": SCALE}


def law(force: Array, slip: Array, sticking: Array, change: float = 0.0) -> dict[str, Array]:
    return numbers(sliding.law(Sphere), *law_block(force, slip, sticking, change))


@pytest.mark.parametrize("change", [0.0, 0.3])
def test_at_rest_the_law_leaves_any_force_in_the_cone_with_its_margin(change: float) -> None:
    for used in ([0.0, 0.0], [0.4, -0.2], [-0.3, -0.4]):
        force = 2.0 * np.array([FRICTION * used[0], FRICTION * used[1], 1.0])
        found = law(force, np.zeros(2), np.array(used), change)
        np.testing.assert_allclose(found["law"], 0, atol=1e-6)
        assert found["sticking"][0] == pytest.approx(MARGIN**2 - np.sum(np.square(used)))


def test_where_a_contact_slides_friction_is_on_its_cone_along_the_slip() -> None:
    slip = 100 * SCALE * np.array([0.6, -0.8])
    force = 2.0 * np.array([FRICTION * 0.6, -FRICTION * 0.8, 1.0])
    for sticking in ([0.0, 0.0], [0.3, 0.4]):
        np.testing.assert_allclose(law(force, slip, np.array(sticking))["law"], 0, atol=2e-4)
    off = law(np.array([-force[0], -force[1], force[2]]), slip, np.zeros(2))["law"]
    np.testing.assert_allclose(off, -4 * np.array([0.6, -0.8]), rtol=1e-3)


def test_in_between_it_is_a_share_of_both() -> None:
    slip, sticking = SCALE * np.array([1.0, 0.0]), np.array([0.1, 0.2])
    used = np.array([1.0, 0.0]) / np.sqrt(2) + sticking / 2
    force = 3.0 * np.array([FRICTION * used[0], FRICTION * used[1], 1.0])
    np.testing.assert_allclose(law(force, slip, sticking)["law"], 0, atol=1e-6)


def test_derivatives_of_the_law_and_of_the_path() -> None:
    rng = np.random.default_rng(0)
    variables, parameters = law_block(np.array([0.3, 0.4, 1.2]), 0.7 * SCALE * rng.normal(size=2), rng.normal(size=2))
    variables = {name: value + 0.01 * rng.normal(size=np.shape(value)) for name, value in variables.items()}
    check_block(sliding.law(Sphere), variables, {**parameters, "slip_scale": 0.5})
    body = [0, -1, 0, 0, 1, 0, BALL]
    check_block(sliding.law(Capsule), variables, {**parameters, "body": body, "slip_scale": 0.5})
    slips = {f"slip{i}": rng.normal(size=2) for i in range(3)}
    check_block(sliding.path(3), slips, {f"step{i}": 0.1 * (i + 1) for i in range(3)} | {"slip_scale": 0.1})


def test_the_path_is_the_length_of_all_slips() -> None:
    slips = {"slip0": [0.3, 0.4], "slip1": [0.0, 0.0], "slip2": [-1.2, 0.5]}
    steps = {"step0": 0.1, "step1": 0.2, "step2": 0.3}
    found = numbers(sliding.path(3), slips, {**steps, "slip_scale": 1e-3})["path"][0]
    assert found == pytest.approx(0.5 * 0.1 + 1.3 * 0.3, abs=1e-4)


def test_friction_drags_the_object_the_way_the_kernel_s_slip_goes() -> None:
    # The ball goes along with +x over a fingertip that stands: friction on the ball is towards -x.
    before, after = on_cap(0.0, 0.0), on_cap(0.02, 0.0)
    variables, parameters = rolling_block(before, after)
    kernel = finger_kernels.rolling(1, Sphere, False, True)
    found = numbers(kernel, {**variables, "slip": [0.0, 0.0]}, parameters)
    np.testing.assert_allclose(found["slip_rate"], found["no_slip"] / STEP, rtol=1e-12)
    # The contact is below the ball: normal -z, helper along the x axis turned; its tangents, as the kernel has them.
    normal, helper = np.array([0, 0, -1.0]), parameters["helper"]
    first = np.cross(helper, normal)
    first = first / np.linalg.norm(first)
    along = found["no_slip"][0] * first + found["no_slip"][1] * np.cross(normal, first)
    np.testing.assert_allclose(along, [-(TIP + BALL) * 0.02, 0, 0], atol=1e-4)


# What tasks get.


def sliding_task(slip: float) -> str:
    return everything_text().replace("slip: 0.0002", f"slip: {slip}")


def declared(slip: float) -> Declaration:
    model = build_model(parse_task(sliding_task(slip)))
    active = np.ones((len(model.schedule.samples), 4), bool)
    active[2:7, 0] = False
    return RefineProblem(Structure.of(model, (0, 1), (2, 2), active))


def test_only_a_limit_of_a_millimetre_or_more_lets_contacts_slide() -> None:
    plain, still, loose = declared(0.0002), declared(0.0009), declared(0.001)
    names = [[*d.problem.variables.names(), *d.problem.parameters.names()] for d in (plain, still, loose)]
    assert names[0] == names[1]
    new = {"slip", "sticking", "cone_friction", "slide_margin", "slip_scale", "near.slip", "near.sticking"}
    assert set(names[2]) - set(names[0]) <= new
    assert {"slip", "sticking", "cone_friction", "slide_margin", "slip_scale"} <= set(names[2])
    assert plain.blocks.keys() == still.blocks.keys()
    assert loose.blocks.keys() - plain.blocks.keys() == {"sliding0", "sliding1", "slide0_0", "slide0_1", "slide1_0"}
    assert list(plain.problem.constraint_rows) == list(still.problem.constraint_rows)
    length = loose.structure.model.units.length
    assert loose.structure.model.sliding * length == pytest.approx(0.8e-3)
    assert plain.structure.model.sliding == still.structure.model.sliding == 0


@pytest.fixture(scope="module")
def made_up() -> MadeUp:
    return MadeUp(replace(everything()[1], sliding=0.3), (0, 2), lifted={2: (4, 7), 3: (9, 99)})


def test_slip_is_bound_by_its_path_and_where_a_disturbance_acts_by_nothing_less_than_before(made_up: MadeUp) -> None:
    given, model = made_up.stage.given, made_up.model
    _, exact = given.constraint_bounds(Margin())
    assert exact["slide0_0.path"] == exact["slide2_0.path"] == exact["slide2_1.path"] == (0.0, 0.3)
    upper = np.ravel(exact["rolling0.no_slip"][1])
    disturbed = made_up.stage.built.disturbed
    pushed = np.isin(np.arange(len(upper)), [*disturbed, *disturbed - 1])
    assert pushed.any()
    assert np.isinf(upper[~pushed]).all()
    assert (upper[pushed] <= model.slip_tolerance).all()
    parameters = given.parameters(made_up.start, Margin(friction=0.4))
    assert parameters["cone_friction"] == WHOLE * model.friction
    assert parameters["friction"] == 0.4 * model.friction
    assert parameters["slide_margin"] == 0.4
    assert parameters["slip_scale"] == SLIP_SCALE / model.units.length


def test_a_motion_starts_with_the_slip_that_it_has(made_up: MadeUp) -> None:
    # Small steps: of large ones the mean of two rotations falls short of a rotation.
    start, given = made_up.start, made_up.stage.given
    slow = replace(
        start,
        **{
            n: getattr(start, n)[:1] + 0.01 * (getattr(start, n) - getattr(start, n)[:1])
            for n in ("position", "vector")
        },
        point=start.point[:1] + 0.01 * (start.point - start.point[:1]),
        angles=tuple(a[:1] + 0.01 * (a - a[:1]) for a in start.angles),
    )
    values, problem, solver = given.start(slow), made_up.stage.problem, made_up.stage.solver
    parameters = given.parameters(slow, Margin())
    x = problem.variables.pack(values, np.zeros(problem.variables.size))
    p = problem.parameters.pack(parameters, np.zeros(problem.parameters.size))
    g = np.asarray(solver.functions["nlp"](x, p)[1]).ravel()
    for contact in (0, 2):
        rate = g[problem.constraint_rows[f"rolling{contact}.slip_rate"]]
        slip = g[problem.constraint_rows[f"rolling{contact}.no_slip"]]
        assert np.abs(slip).max() > 1e-3
        assert np.abs(rate).max() < 0.15 * np.abs(slip).max() / np.diff(made_up.model.schedule.samples).min()
    idle = ~made_up.active[:-1, 2]
    assert not values["slip"][idle, 2:].any()
    assert (np.linalg.norm(values["sticking"].reshape(-1, 2, 2), axis=2) < 0.4).all()


def test_friction_is_viscous_first_and_sharper_step_by_step() -> None:
    assert [scale for _, scale in graded(LAST_STEP)] == [1.0]
    assert [scale for _, scale in graded(ALL_STEPS)] == [VISCOUS] * 3 + list(SHARPER)
    assert [step[0] for step, _ in graded(ALL_STEPS)][3:] == ["hard constraints"] * len(SHARPER)


def test_runs_are_the_stretches_of_set_flags() -> None:
    flags = np.array([True, True, False, True, False, False, True])
    assert [run.tolist() for run in runs(flags)] == [[0, 1], [3], [6]]
    assert runs(np.zeros(3, bool)) == []


# A solve. A post stands on the ground while the palm rises farther than the links reach: fingertips slide up along it.

POST = """
object: {mass: 0.3, shapes: [{capsule: {start: [0, 0, -0.05], end: [0, 0, 0.05], radius: 0.015}}]}
palm:
  radius: 0.05
  position: [0, 0, 0.16]
  facing: [0, 0, -1]
  motion: [{at: 1.5, position: [0, 0, 0.205]}]
ground: {height: 0}
motion: [{at: 0, position: [0, 0, 0.065]}, {at: 1.5, position: [0, 0, 0.065]}]
fingers:
  thumb: {touches: [0.015, 0, 0.02]}
  index: {touches: [-0.0075, 0.013, 0.02]}
  middle: {touches: [-0.0075, -0.013, 0.02]}
friction: 0.5
hand: {link_length: [0.01, 0.05]}
search: {max_joints: 2}
"""


@pytest.mark.slow
def test_fingers_too_short_to_hold_on_slide_and_are_certified_where_the_task_allows_it(tmp_path: Path) -> None:
    strict = solve(parse_task(POST), jobs=1, out=tmp_path / "strict")
    assert strict.status != "certified"
    assert {"slip", "slide_shortfall"} <= {name for name, figure in strict.certificate.items() if not figure["holds"]}
    loose = solve(parse_task(POST + "limits: {slip: 0.05}\n"), jobs=1, out=tmp_path / "loose")
    assert loose.status == "certified"
    assert 0.006 < loose.certificate["slip"]["value"] < 0.03
    assert "slides at" in loose.certificate["slide_shortfall"]["where"]
    assert loose.certificate["slide_shortfall"]["value"] < 0.05
    motion = loose.motion
    assert motion is not None
    # All three drag the post up in the middle of the way, with all of their friction.
    force = motion.contact_force[len(motion.time) // 2, :3]
    np.testing.assert_allclose(force[:, 2] / np.linalg.norm(force[:, :2], axis=1), 0.5, rtol=0.05)
