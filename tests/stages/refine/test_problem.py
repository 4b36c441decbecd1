"""The refine stage's problem: what is bound to which knots, against SciPy's rotations on a made-up hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from casadi_hands.geometry.bodies import packed
from casadi_hands.problem.resampling import resampled_model
from casadi_hands.problem.si import build_model
from casadi_hands.problem.structure import Inner, Structure
from casadi_hands.stages.object_motion.values import tool_path
from casadi_hands.stages.refine import finger_kernels
from casadi_hands.stages.refine.settings import WEIGHTS
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.task import parse_task
from tests.stages.blocks import frames, numbers, surface
from tests.stages.example import check_derivatives, doubling_each_weight, drawing, everything, rod, with_tips
from tests.stages.refining import MadeUp, carrying, sketching

pytestmark = pytest.mark.usefixtures("interpreted")

Array = np.ndarray


@pytest.fixture(scope="module")
def loaded() -> MadeUp:
    return carrying()


@pytest.fixture(scope="module")
def unloaded() -> MadeUp:
    return carrying(on_ground=0)


@pytest.fixture(scope="module")
def drawn() -> MadeUp:
    return sketching()


CASES = ("loaded", "unloaded", "drawn")


@pytest.fixture(params=CASES)
def case(request: pytest.FixtureRequest) -> MadeUp:
    found: MadeUp = request.getfixturevalue(request.param)
    return found


# The structure.


def test_the_ground_is_a_contact_where_it_ever_bears_load() -> None:
    _, model = everything()
    flags = np.ones((5, 4), bool)
    flags[:, 3] = [False, False, True, False, False]
    structure = Structure.of(model, (0, 2), (1, 2), flags)
    assert structure.grounded
    assert structure.columns == [0, 2, 3]
    np.testing.assert_array_equal(structure.active, flags[:, [0, 2, 3]])
    np.testing.assert_array_equal(structure.touching[:, 2], [False, False, True, True, False])
    flags[:, 3] = False
    structure = Structure.of(model, (0, 2), (1, 2), flags)
    assert not structure.grounded
    assert structure.columns == [0, 2]
    np.testing.assert_array_equal(structure.active, flags[:, [0, 2]])


def test_without_a_ground_the_last_contact_is_a_finger_s() -> None:
    _, model = drawing()
    structure = Structure.of(model, (0,), (2,), np.ones((5, 2), bool))
    assert not structure.grounded
    assert structure.columns == [0]
    assert structure.active.shape == (5, 1)


# What is bound.


def test_a_contact_is_held_to_its_surfaces_until_it_lifts(loaded: MadeUp) -> None:
    # Held from its first active sample up to the first broken one, where it still touches.
    rows, active, touching = loaded.stage.problem.constraint_rows, loaded.active, loaded.touching
    assert touching[:, 1].tolist() == [True] * 5 + [False] * 2 + [True] * (len(active) - 7)
    assert len(rows["contact2.on_link"]) == touching[:, 1].sum()
    assert len(rows["rolling2.no_slip"]) == active[:-1, 2].sum()
    assert len(rows["contact0.on_link"]) == len(active)
    assert len(rows["apart2.clear"]) == (~touching[:, 1]).sum()
    assert len(rows["apart_touching2.clear"]) == touching[:, 1].sum()
    assert len(rows["fingers_apart2_0.clear"]) == len(active)
    disturbed = (loaded.model.schedule.samples > 0.3 - 1e-9) & (loaded.model.schedule.samples < 0.9 + 1e-9)
    np.testing.assert_array_equal(loaded.stage.built.disturbed, np.flatnonzero(disturbed))
    for name, contact in (("disturbed_contact0", 0), ("disturbed_contact2", 2), ("disturbed_ground", 3)):
        assert len(rows[f"{name}.pressing"]) == (disturbed & active[:, contact]).sum() > 0


def test_the_object_is_kept_off_the_ground_whether_or_not_it_bears_load(loaded: MadeUp, unloaded: MadeUp) -> None:
    has = set(loaded.stage.problem.constraint_rows)
    ground = {name for name in has if name.split(".")[0] in ("ground", "ground_rolling", "disturbed_ground")}
    assert {name.split(".")[0] for name in ground} == {"ground", "ground_rolling", "disturbed_ground"}
    assert set(unloaded.stage.problem.constraint_rows) == has - ground
    assert "object_apart.ground" in has
    assert loaded.stage.problem.variables["force"].shape[1] == 9
    assert unloaded.stage.problem.variables["force"].shape[1] == 6


def test_wrenches_are_those_of_all_contacts_at_every_knot(case: MadeUp) -> None:
    found, values = case.constraints(WEIGHTS), case.values
    points, forces = case.points, case.forces
    twist = values["twist_torque"]
    wrench = np.hstack([forces.sum(axis=1), np.cross(points, forces).sum(axis=1) + twist])
    np.testing.assert_allclose(found["wrench.sum"], wrench - values["wrench"], atol=1e-12)
    middle = np.cross((points[1:] + points[:-1]) / 2, (forces[1:] + forces[:-1]) / 2).sum(axis=1)
    middle = middle + (twist[1:] + twist[:-1]) / 2
    np.testing.assert_allclose(found["middle_torque.sum"], middle - values["middle_torque"], atol=1e-12)


def test_disturbances_are_held_at_their_time(loaded: MadeUp) -> None:
    model, values = loaded.model, loaded.values
    second = values["force_disturbed"].reshape(-1, 3, 3)
    found = loaded.constraints(WEIGHTS)["disturbed.sum"]
    assert len(found) == len(second)
    for row, k, forces in zip(found, loaded.stage.built.disturbed, second, strict=True):
        inverse = loaded.turns[k].inv()
        force = forces.sum(axis=0) + inverse.apply(model.disturbance.force[k])
        torque = np.cross(loaded.points[k], forces).sum(axis=0) + inverse.apply(model.disturbance.torque[k])
        torque = torque + values["twist_torque"][k]
        np.testing.assert_allclose(row, np.r_[force, torque] - values["wrench"][k], atol=1e-12)


def test_the_ground_is_where_it_is_while_it_bears_load(loaded: MadeUp) -> None:
    found, position = loaded.constraints(WEIGHTS), loaded.values["pose"][:, :3]
    world = np.array([p + r.apply(q) for p, r, q in zip(position, loaded.turns, loaded.points[:, 2], strict=True)])
    exerted = np.array([r.apply(f) for r, f in zip(loaded.turns, loaded.forces[:, 2], strict=True)])
    touching = np.flatnonzero(loaded.touching[:, 2])
    assert touching.tolist() == list(range(10))
    height, capsule = 0.001 / 0.0475, rod(loaded.model.touched[-1])
    np.testing.assert_allclose(found["ground.on_surfaces"][:, 1], world[touching, 2] - height, atol=1e-12)
    np.testing.assert_allclose(found["ground.pressing"].ravel(), exerted[touching, 2], atol=1e-12)
    # Half the ground's friction of 0.4 may be used.
    cone = (0.2 * exerted[:, 2]) ** 2 - exerted[:, 0] ** 2 - exerted[:, 1] ** 2
    np.testing.assert_allclose(found["ground.cone"].ravel(), cone[touching], atol=1e-12)
    for row, k in zip(found["ground_rolling.no_slip"], range(9), strict=True):
        over = loaded.points[k + 1, 2] - loaded.points[k, 2]
        # Along the chord stretched to an arc, and turned nearly as the object is halfway.
        bend = np.subtract(*(surface(loaded.points[i, 2], capsule)[1] for i in (k + 1, k)))
        sine = np.linalg.norm(bend) / 2
        arc = over + (np.arcsin(sine) / sine - 1) * (over @ bend) / (bend @ bend) * bend
        mean = (loaded.turns[k].as_matrix() + loaded.turns[k + 1].as_matrix()) / 2
        halfway = mean @ (3 * np.eye(3) - mean.T @ mean) / 2
        np.testing.assert_allclose(row, (halfway @ arc - world[k + 1] + world[k])[:2], atol=2e-3)
    second = loaded.values["force_disturbed"].reshape(-1, 3, 3)[:, 2]
    held = [(k, f) for k, f in zip(loaded.stage.built.disturbed, second, strict=True) if loaded.active[k, 3]]
    expected = [loaded.turns[k].apply(f)[2] for k, f in held]
    np.testing.assert_allclose(found["disturbed_ground.pressing"].ravel(), expected, atol=1e-12)


def test_times_between_knots_divide_their_intervals_evenly() -> None:
    times = np.array([0, 0.1, 0.3, 0.7, 0.76])
    inner = Inner.of(np.array([0, 1, 3, 0]))
    np.testing.assert_allclose(inner.weights() @ times, [0.2, 0.4, 0.5, 0.6])
    np.testing.assert_allclose(inner.weights(np.array([3, 0])) @ times, [0.6, 0.2])
    np.testing.assert_array_equal(inner.interval, [1, 2, 2, 2])
    none = Inner.of(np.zeros(4, int))
    assert none.weights().shape == (0, 5)


@pytest.fixture(scope="module")
def wide() -> MadeUp:
    """Fingers with thick tips that lift for a while, on knots up to 0.3 s apart."""
    model = with_tips(everything()[1])
    return MadeUp(resampled_model(model, model.schedule.stepped(0.3)), (0, 2), lifted={2: (2, 4)}, guarded=True)


def test_forces_are_actuated_in_the_middle_between_knots_too(loaded: MadeUp) -> None:
    model, values, found = loaded.model, loaded.values, loaded.constraints(WEIGHTS)
    palms = Rotation.from_quat(model.palm_quaternion, scalar_first=True)
    turning = Slerp(np.arange(len(palms)), palms)
    for i, c in enumerate((0, 2)):
        finger = loaded.start.fingers[i]
        intervals = np.flatnonzero(loaded.active[:-1, c])
        assert len(found[f"inter_knot{c}.structural"]) == len(intervals)
        for row, k in zip(found[f"inter_knot{c}.structural"], intervals, strict=True):
            moving = (values["pose"], loaded.points[:, i], values[f"angles{c}"], loaded.forces[:, i])
            middles = [(array[k] + array[k + 1]) / 2 for array in moving]
            variables = {name: values[f"{name}{c}"] for name in ("base", "lengths", "axes", "bends")}
            parameters = {
                "frames": frames(finger),
                "reference": model.reference,
                "palm_position": (model.palm_position[k] + model.palm_position[k + 1]) / 2,
                "palm_quaternion": turning(k + 0.5).as_quat(scalar_first=True),
                "body": model.touched[c].parameters,
                "radius": model.link_radius,
                "tip_radius": model.tip_radius,
                "hinge": model.hinge,
            }
            variables |= dict(zip(("pose", "point", "angles", "force"), middles, strict=True))
            expected = numbers(finger_kernels.actuated(finger.joints, type(model.touched[c])), variables, parameters)
            np.testing.assert_allclose(row, expected["structural"], atol=1e-12)


def test_lifted_fingers_are_clear_in_the_middle_between_knots_too(loaded: MadeUp) -> None:
    model, values, found = loaded.model, loaded.values, loaded.constraints(WEIGHTS)
    palms = Rotation.from_quat(model.palm_quaternion, scalar_first=True)
    turning = Slerp(np.arange(len(palms)), palms)
    intervals = np.flatnonzero(~loaded.active[:-1, 2])
    assert len(found["apart_between2.clear"]) == len(intervals) > 0
    kernel = finger_kernels.apart(2, model.kinds, None, model.ground is not None)
    for row, k in zip(found["apart_between2.clear"], intervals, strict=True):
        variables = {name: values[f"{name}2"] for name in ("base", "lengths", "axes", "bends")}
        variables |= {
            name: (values[of][k] + values[of][k + 1]) / 2 for name, of in (("pose", "pose"), ("angles", "angles2"))
        }
        parameters = {
            "frames": frames(loaded.start.fingers[1]),
            "reference": model.reference,
            "palm_position": (model.palm_position[k] + model.palm_position[k + 1]) / 2,
            "palm_quaternion": turning(k + 0.5).as_quat(scalar_first=True),
            "radius": model.link_radius,
            "tip_radius": model.tip_radius,
            "palm_radius": model.palm_radius,
            "ground_height": model.ground_height,
            "bodies": packed(model.bodies),
        }
        np.testing.assert_allclose(row, numbers(kernel, variables, parameters)["clear"], atol=1e-12)


def test_guarded_fingers_are_clear_of_each_other_every_tenth_of_a_second(loaded: MadeUp, wide: MadeUp) -> None:
    assert not any("fingers_between" in name for name in loaded.stage.problem.constraint_rows)
    values, found, times = wide.values, wide.constraints(WEIGHTS), wide.model.schedule.samples
    rows = iter(found["fingers_between2_0.clear"])
    for k, step in enumerate(np.diff(times)):
        parts = next(n for n in range(1, 9) if step / n <= 0.1 + 1e-9)
        assert parts > 1
        for share in np.arange(1, parts) / parts:
            variables, parameters = {}, {}
            for tag, i, c in (("0", 1, 2), ("1", 0, 0)):
                variables |= {f"{name}{tag}": values[f"{name}{c}"] for name in ("base", "lengths", "axes", "bends")}
                variables[f"angles{tag}"] = (1 - share) * values[f"angles{c}"][k] + share * values[f"angles{c}"][k + 1]
                parameters[f"frames{tag}"] = frames(wide.start.fingers[i])
            parameters |= {"radius": wide.model.link_radius, "tip_radius": wide.model.tip_radius}
            expected = numbers(finger_kernels.fingers_apart(2, 1), variables, parameters)
            np.testing.assert_allclose(next(rows), expected["clear"], atol=1e-12)
    assert next(rows, None) is None


def test_contacts_that_touch_only_at_the_end_do_not_roll() -> None:
    # An object that is put down at the last sample, where a finger reaches it, too.
    _, model = everything()
    count = len(model.schedule.samples)
    landing = MadeUp(model, (0, 2), lifted={0: (0, count - 1), 3: (0, count - 1)})
    values = landing.constraints(dict.fromkeys(WEIGHTS, 1.0))
    instances = {name: len(values[name]) for name in ("ground.pressing", "contact0.pressing", "contact2.pressing")}
    assert instances == {"ground.pressing": 1, "contact0.pressing": 1, "contact2.pressing": count}
    for name, rows in (("ground_rolling.no_slip", 0), ("rolling0.no_slip", 0), ("rolling2.no_slip", count - 1)):
        assert len(values[name]) == rows


def test_the_ground_s_contact_wanders_only_while_it_touches() -> None:
    _, model = everything()
    times, bounds = model.schedule.samples, (2, len(model.schedule.samples) - 4)
    lifted = MadeUp(model, (0, 2), lifted={3: bounds})
    points, weights = lifted.values["point"][:, 6:9], dict.fromkeys(lifted.stage.problem.terms, 1.0)
    found = lifted.stage.solver.evaluate(lifted.values, lifted.parameters(weights))  # type: ignore[arg-type]
    rates = np.diff(points, axis=0) / np.diff(times)[:, None]
    away = set(range(*bounds))
    alone = [k for k in range(len(times) - 2) if not away & {k, k + 1}]
    assert 0 < len(alone) < len(times) - 4
    expected = sum(((rates[k + 1] - rates[k]) ** 2).sum() for k in alone)
    assert found["ground_wander"] == pytest.approx(expected, rel=1e-12)


def test_a_drawing_s_tool_is_held_to_its_path_at_every_knot(drawn: MadeUp) -> None:
    model, position = drawn.model, drawn.values["pose"][:, :3]
    tool = np.array([p + r.apply(model.tool) for p, r in zip(position, drawn.turns, strict=True)])
    np.testing.assert_allclose(drawn.constraints(WEIGHTS)["tool_point.on_path"], tool - tool_path(model), atol=1e-12)


def test_goals_cost_what_the_object_is_off_them(loaded: MadeUp) -> None:
    model = loaded.model
    at = [int(np.argmin(np.abs(model.schedule.samples - time))) for time in (0, 0.6, 1.5)]
    off = loaded.values["pose"][at] - np.hstack([model.goal_positions, model.goal_vectors])
    terms = loaded.stage.solver.evaluate(loaded.values, loaded.parameters({**WEIGHTS, "goal": 2.0}))  # type: ignore[arg-type]
    assert terms["goal"] == pytest.approx(2 * (off**2).sum(), rel=1e-12)


# Weights and derivatives.


def test_every_weight_moves_its_own_term(case: MadeUp) -> None:
    weights = {
        name: WEIGHTS[name] or 1.0 for name in case.stage.problem.terms
    }  # the proximal term weighs in restorations only
    # Second forces are there for disturbances alone, the ground's terms and those of shared motors where there are any.
    on_ground = case.stage.problem.variables["force"].shape[1] == 9
    absent = {"motor_acceleration"} | (set() if on_ground else {"ground_load", "ground_wander"})
    assert set(WEIGHTS) - set(weights) == absent | ({"force_regularisation"} if case.model.tool is not None else set())
    evaluate = case.stage.solver.evaluate
    plain = evaluate(case.values, case.parameters(weights))  # type: ignore[arg-type]
    assert min(plain.values()) > 1e-9
    moved = doubling_each_weight(
        lambda weights: evaluate(case.values, case.parameters(weights)),  # type: ignore[arg-type]
        weights,
    )
    assert moved == {name: {name} for name in weights}


def test_derivatives_agree_with_differences(case: MadeUp) -> None:
    weights = {name: WEIGHTS[name] for name in case.stage.problem.terms}
    check_derivatives(case.stage.solver, case.values, case.parameters(weights))


def test_what_touches_one_part_may_be_as_near_to_those_that_it_goes_on_in() -> None:
    """Next to a seam there is no way to be clear of the other part; bodies of no faces, and far ones, stay clear."""
    box = "box: {center: [%g, 0, 0], size: [0.04, 0.03, 0.03]}"
    ball = "sphere: {center: [-0.02, 0, 0.02], radius: 0.012}"
    shapes = ", ".join(f"{{{each}}}" for each in (box % -0.02, box % 0.02, box % 0.07, ball))
    task = parse_task(
        f"object: {{mass: 0.1, shapes: [{shapes}]}}\n"
        "palm: {position: [0, 0, 0.2], facing: [0, 0, -1]}\n"
        "motion: [{at: 0, position: [0, 0, 0]}, {at: 1, position: [0, 0, 0.01]}]\n"
        "fingers: {thumb: {touches: [-0.02, 0.015, 0]}, index: {touches: [0.02, -0.015, 0]}}\n"
        "hand: {clearance: 0.001}\n"
    )
    model = build_model(task)
    active = np.ones((len(model.schedule.samples), 2), bool)
    problem = RefineStage(model, (0, 1), (1, 1), active).problem
    bounds = problem.constraint_lower[problem.constraint_rows["apart_touching0.clear"]]
    far = model.clearance
    assert far > 0
    # The other box of the same block, that which stands apart, and the ball.
    np.testing.assert_allclose(bounds[:, -3:], np.tile([0, far, far], (len(bounds), 1)))
    assert np.all(bounds[:, :-3] == far)
